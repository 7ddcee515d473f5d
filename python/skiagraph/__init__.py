"""Exact synthetic truth for markerless human motion trackers, from Python.

>>> import skiagraph
>>> walk = skiagraph.Set("sets/walk")
>>> def stay(frame):
...     return frame.info.start.markers
>>> result = walk.evaluate(skiagraph.track(walk, stay))
>>> result.metrics["humaneva_mm"] > 50
True

Units are metres, radians and seconds, in a world with Z up; metrics state theirs in their names. docs/python.md
describes the package. Nothing is printed unless ``progress=True``.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .public import *  # noqa: F403


def __getattr__(name: str) -> Any:
    # read at the first use, with NumPy: pytest imports every plugin's package, whether a test uses it or not
    if name == "__version__":
        from .executable import package_version

        return package_version() or "0+checkout"
    from importlib import import_module

    public = import_module(f"{__name__}.public")
    names = sorted(each for each in vars(public) if each[0] != "_")
    globals().update({each: getattr(public, each) for each in names}, __all__=names)
    if name in globals():
        return globals()[name]
    raise AttributeError(f"module 'skiagraph' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__getattr__("__all__"), "__version__"]
