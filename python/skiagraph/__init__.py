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

from .benchmark_set import Arrays, Images, Keypoints, Set, Truth
from .camera import Camera
from .commands import Cell, Program, Sweep, render, sweep, track
from .comparing import Comparison, Gate, RegressionCheck, SetMaker, Verdict, compare, gate, save_baseline
from .errors import (
    InputError,
    MisreadWarning,
    MissingNameError,
    MissingPackageError,
    NoTruthError,
    ProgramError,
    SkiagraphError,
    TrackerError,
)
from .executable import program
from .measuring import Metrics, Result, Run, evaluate
from .rerun import to_rerun
from .session import Session
from .tracking import Answer, AnyTracker, Frame, SetInfo, Start, Tracker, View, serve

__all__ = [
    "Answer",
    "AnyTracker",
    "Arrays",
    "Camera",
    "Cell",
    "Comparison",
    "Frame",
    "Gate",
    "Images",
    "InputError",
    "Keypoints",
    "Metrics",
    "MisreadWarning",
    "MissingNameError",
    "MissingPackageError",
    "NoTruthError",
    "Program",
    "ProgramError",
    "RegressionCheck",
    "Result",
    "Run",
    "Session",
    "Set",
    "SetInfo",
    "SetMaker",
    "SkiagraphError",
    "Start",
    "Sweep",
    "Tracker",
    "TrackerError",
    "Truth",
    "Verdict",
    "View",
    "compare",
    "evaluate",
    "gate",
    "program",
    "render",
    "save_baseline",
    "serve",
    "sweep",
    "to_rerun",
    "track",
]


def __getattr__(name: str) -> str:
    if name != "__version__":
        raise AttributeError(f"module 'skiagraph' has no attribute {name!r}")
    from .executable import package_version

    return package_version() or "0+checkout"
