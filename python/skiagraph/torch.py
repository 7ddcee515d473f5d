"""Sets for PyTorch: windows of frames as tensors. Needs the package torch."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from .arrays import index_of
from .benchmark_set import Set
from .errors import InputError, imported, reading
from .paths import PathName, absolute

if TYPE_CHECKING:
    from torch.utils.data import Dataset  # pyright: ignore[reportMissingImports]
else:
    Dataset = Sequence


class SilhouetteDataset(Dataset[dict[str, Any]]):
    """Windows of W frames of sets with C cameras, for ``torch.utils.data.DataLoader``; it can be pickled.

    An item is a dictionary of tensors: ``masks`` bool (W, C, height, width), empty where a camera took no image; ``K``
    (C, 3, 3), ``distortion`` (C, 5), ``R`` (W, C, 3, 3) and ``t`` (W, C, 3) as OpenCV has them; ``time`` (W,) in
    seconds; ``set`` and ``frame``, the numbers of its set and of its first frame; and, where they are asked for,
    ``joints`` (W, J, 3) in metres, and ``keypoints`` (W, C, K, 3): column, row, confidence. Numbers are float32.

    Args:
        sets: folders of sets or sets; or an index, a text file with a folder on every line, relative to it.
        window: frames of an item.
        step: frames from an item to the next, by default as many as it has.
        joints: of the truth: ``"markers"``, ``"joints"``, or a layout of :meth:`Truth.joints_as` such as ``"smpl24"``.
        keypoints: whether items have what a 2-D detector found.
        tensors: False gives arrays of NumPy, and does not need torch.
    """

    def __init__(
        self,
        sets: PathName | Set | Sequence[PathName | Set],
        window: int = 1,
        step: int | None = None,
        *,
        joints: str | None = None,
        keypoints: bool = False,
        tensors: bool = True,
    ) -> None:
        step = window if step is None else step
        if not (isinstance(window, int) and isinstance(step, int) and window > 0 and step > 0):
            raise InputError(f"expected window and step as numbers of frames from 1, found {window!r} and {step!r}")
        if tensors:
            imported("torch", "SilhouetteDataset")
        self._window, self._step, self._joints, self._keypoints = window, step, joints, keypoints
        self._tensors = tensors
        self.sets = [each if isinstance(each, Set) else Set(each) for each in _listed(sets)]
        self._ends = list(accumulate(max(0, (each.frames - window) // step + 1) for each in self.sets))
        if not len(self):
            counts = ", ".join(str(each.frames) for each in self.sets) or "none"
            raise InputError(f"no set has a window of {window} frames; frames of the sets: {counts}")
        # what one set lacks is said now, not by a worker in the middle of an epoch
        self._points = [self._points_of(each) for each in self.sets]
        self._images = [[each.masks(camera) for camera in each.cameras] for each in self.sets]

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __getitem__(self, index: int) -> dict[str, Any]:
        index = index_of(index, len(self), "window")
        number = bisect_right(self._ends, index)
        first = self._step * (index - (self._ends[number - 1] if number else 0))
        of, frames = self.sets[number], range(first, first + self._window)
        cameras = [of.cameras_at(frame) for frame in frames]
        numbers: dict[str, Any] = {
            "K": [camera.K for camera in of.cameras],
            "distortion": [camera.distortion for camera in of.cameras],
            "R": [[camera.R for camera in row] for row in cameras],
            "t": [[camera.t for camera in row] for row in cameras],
            "time": [frame / of.fps for frame in frames],
            **{name: points[first : first + self._window] for name, points in self._points[number].items()},
        }
        arrays: dict[str, Any] = {name: np.array(values, np.float32) for name, values in numbers.items()}
        sizes = {(camera.height, camera.width) for camera in of.cameras}
        if len(sizes) > 1:
            raise InputError(f"{of.path}: the cameras have images of several sizes, which are no tensor")
        arrays["masks"] = np.zeros((self._window, len(of.cameras), *sizes.pop()), np.bool_)
        for camera, images in enumerate(self._images[number]):
            for place, frame in zip(arrays["masks"][:, camera], frames, strict=True):
                if (mask := images[frame]) is not None:
                    place[:] = mask
        found = {"set": number, "frame": first}
        if not self._tensors:
            return {**arrays, **found}
        torch = imported("torch", "SilhouetteDataset")
        return {**{name: torch.from_numpy(array) for name, array in arrays.items()}, **found}

    def _points_of(self, of: Set) -> dict[str, Any]:
        points: dict[str, Any] = {}
        if self._joints is not None:
            if self._joints in ("markers", "joints"):
                points["joints"] = of.truth[self._joints]
            else:
                points["joints"] = np.stack(list(of.truth.joints_as(self._joints).values()), axis=1)
        if self._keypoints:
            if of.keypoints is None:
                raise InputError(f"{of.path} has no keypoints; render it with observation__keypoints__layout='coco17'")
            points["keypoints"] = np.concatenate([of.keypoints.points, of.keypoints.confidence[..., None]], axis=-1)
        return points


def _listed(sets: PathName | Set | Sequence[PathName | Set]) -> Sequence[PathName | Set]:
    """Sets one by one; those of an index are found from its folder."""
    if isinstance(sets, Set):
        return [sets]
    if not isinstance(sets, (str, PathLike)):
        return sets
    if (path := absolute(sets, "sets")).is_dir():
        return [path]
    with reading(path, "a set, or a text file with a folder on every line", "name one"):
        return [path.parent / line.strip() for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
