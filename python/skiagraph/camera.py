"""Cameras in OpenCV's convention."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import Fixed, numbers, shaped
from .errors import InputError

MOST_PIXELS = 16_384


@dataclass(frozen=True, eq=False)
class Camera(Fixed):
    """A pinhole camera with a lens: ``x_camera = R x_world + t``, metres; x right, y down, z forward.

    ``width`` and ``height`` are pixels; ``K`` (3, 3), ``R`` (3, 3), ``t`` (3,) and ``distortion`` (5,: k1 k2 p1 p2 k3)
    are as OpenCV takes them, with pixel centres at integers, and cannot be changed in place. Nothing nearer than
    ``near`` metres is seen; every row of the image is exposed ``line_delay`` seconds after the row above it. A camera
    that moves is described as it was for one image.
    """

    _arrays = ("K", "R", "t", "distortion")

    name: str
    width: int
    height: int
    K: NDArray[np.float64]
    R: NDArray[np.float64]
    t: NDArray[np.float64]
    distortion: NDArray[np.float64]
    near: float = 0.0
    line_delay: float = 0.0

    @classmethod
    def from_record(cls, record: Mapping[str, Any]) -> Camera:
        """A camera as ``cameras.json`` and the protocol of trackers write it.

        Raises:
            KeyError, TypeError, ValueError: the record is not as they write it.
        """
        name, width, height = record["name"], record["width"], record["height"]
        if not isinstance(name, str):
            raise TypeError(f"the name of a camera is {name!r:.80}")
        if not all(isinstance(side, int) and 0 < side <= MOST_PIXELS for side in (width, height)):
            raise ValueError(f"camera {name!r:.80} has {width!r:.80} x {height!r:.80} pixels")
        shapes = {"K": (3, 3), "R": (3, 3), "t": (3,), "distortion": (5,)}
        K, R, t, distortion = (shaped(record[key], shape, f"{key} of a camera") for key, shape in shapes.items())
        near, delay = (float(shaped(record.get(key, 0.0), (), key)) for key in ("near", "line_delay_s"))
        return cls(name, width, height, K, R, t, distortion, near, delay)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Where the camera is in the world (3,), metres."""
        return np.asarray(-self.R.T @ self.t)

    @property
    def P(self) -> NDArray[np.float64]:
        """The projection matrix ``K [R | t]`` (3, 4), without the lens."""
        return np.asarray(self.K @ np.column_stack([self.R, self.t]))

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Pixels (..., 2) of points (..., 3) in the world, metres, through the lens; NaN before the near plane, and
        where the lens model folds back, which no lens does.

        Raises:
            InputError: the last axis of `points` is not 3 long.
        """
        world = numbers(points, "points of shape (..., 3) in metres")
        if world.ndim == 0 or world.shape[-1] != 3:
            raise InputError(f"expected points of shape (..., 3) in metres, found shape {world.shape}")
        local = world @ self.R.T + self.t
        z = np.where(local[..., 2] >= max(self.near, np.finfo(float).tiny), local[..., 2], np.nan)
        x, y = local[..., 0] / z, local[..., 1] / z
        if np.any(self.distortion):
            x = np.where(self._before_fold(x, y), x, np.nan)
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        across = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        down = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.asarray((np.stack([across, down, np.ones_like(x)], axis=-1) @ self.K.T)[..., :2])

    def _before_fold(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether the lens model preserves orientation from the centre to (x, y), looked at in 16 places."""
        k1, k2, p1, p2, k3 = self.distortion
        u, v = (np.multiply.outer(np.arange(1, 17) / 16, place) for place in (x, y))
        r2 = u * u + v * v
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
        mixed = u * v * slope + 2 * p1 * u + 2 * p2 * v
        across = radial + u * u * slope + 2 * p1 * v + 6 * p2 * u
        down = radial + v * v * slope + 6 * p1 * v + 2 * p2 * u
        return np.asarray(np.all(across * down - mixed * mixed > 0, axis=0))
