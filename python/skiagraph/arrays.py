"""Arrays that users give: masked values count as missing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from .errors import InputError, MissingNameError

T = TypeVar("T")


class Named(dict[str, T]):
    """Values by name, which cannot be changed in place; an unknown name is answered with similar ones.

    ``kind`` is what the names are of, in messages; ``absent`` what those without a value lack.
    """

    def __init__(self, values: Mapping[str, T], kind: str = "name", absent: Mapping[str, str] | None = None) -> None:
        super().__init__(values)
        self._kind, self._absent = kind, absent or {}
        for value in self.values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def __missing__(self, name: str) -> T:
        if needs := self._absent.get(name):
            raise MissingNameError(f"{name} could not be computed: it {needs}")
        raise MissingNameError.of(self._kind, name, self)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self), self._kind, self._absent)

    def _refuse(self, *_: Any, **__: Any) -> Any:
        raise TypeError("these values cannot be changed in place; change a copy, dict(values)")

    __setitem__ = __delitem__ = __ior__ = update = pop = popitem = setdefault = clear = _refuse  # pyright: ignore


class Fixed:
    """A record whose arrays cannot be changed in place, also in another process."""

    _arrays: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for name in self._arrays:
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(vars(self).values())


def index_of(item: Any, count: int, what: str = "frame") -> int:
    """The number from 0 of an item of a sequence; negative ones count from its end."""
    is_number = isinstance(item, (int, np.integer)) and not isinstance(item, bool)
    if not is_number or not -count <= item < count:
        raise IndexError(f"{what} {item!r:.80}: expected an integer from 0 to {count - 1}")
    return int(item) % count


def unmasked(values: Any) -> NDArray[Any]:
    """An array with NaN in place of masked values, which ``np.asarray`` would take for numbers."""
    if isinstance(values, (list, tuple)):
        nested = (list, tuple, np.ma.MaskedArray)
        parts = [unmasked(value) if isinstance(value, nested) else value for value in values]
        try:
            return np.asarray(parts)
        except ValueError:
            found = f"a {type(values).__name__} of parts that differ in shape"
            raise InputError(f"expected an array, found {found}") from None
    if not isinstance(values, np.ma.MaskedArray) or not np.ma.is_masked(values):
        try:
            return np.asarray(values)
        except (TypeError, ValueError, RuntimeError) as error:
            # tensors on another device or with gradients say what to do
            raise InputError(f"expected an array, found {type(values).__name__}: {error}") from None
    if values.dtype.kind not in "fiu":
        raise InputError(f"expected masked values to be numbers, found a masked array of dtype {values.dtype}")
    numbers = np.array(values.data, values.dtype if values.dtype.kind == "f" else np.float64)
    numbers[np.ma.getmaskarray(values)] = np.nan
    return numbers


def numbers(values: Any, wanted: str = "numbers") -> NDArray[np.float64]:
    """An array of the numbers that a user gives; NaN for masked ones."""
    array = unmasked(values)
    if array.dtype.kind not in "fiu":
        raise InputError(f"expected {wanted}, found {described(values, array)}")
    if array.dtype == np.float16:
        steps = "whose steps are centimetres at 10 m; keep estimates in float32 or float64"
        raise InputError(f"expected {wanted}, found {described(values, array)}, {steps}")
    return array.astype(np.float64, copy=False)


def frozen(values: Any) -> NDArray[np.float64]:
    """A copy that cannot be changed in place, since others read it too."""
    array = np.array(values, np.float64)
    array.flags.writeable = False
    return array


def shaped(values: Any, shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
    """Finite numbers of a file as an array of this shape, which cannot be changed in place."""
    array = frozen(values)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{name} is not {' x '.join(map(str, shape))} finite numbers")
    return array


def described(given: Any, array: NDArray[Any]) -> str:
    """What was given in place of numbers, for messages."""
    if not array.shape or (array.dtype.kind in "OUS" and not isinstance(given, np.ndarray)):
        return f"{type(given).__name__} {given!r:.80}"
    return f"{array.dtype} of shape {array.shape}"
