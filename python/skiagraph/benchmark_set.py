"""A benchmark set on disk: what trackers may see, and the truth where the set has it."""

from __future__ import annotations

import json
import os
import re
import zlib
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .camera import Camera
from .errors import InputError, NoTruthError
from .images import exr, picture, silhouette
from .paths import PathName, absolute

if TYPE_CHECKING:
    from concurrent.futures import Future

    from .measuring import Result

#: Threads that unpack images; more would only wait for the interpreter.
_MOST_THREADS = 8
#: Bytes of the images that a thread unpacks in one go.
_BATCH_BYTES = 1 << 21
#: Bytes of a block of a tar file, which ends with two empty ones.
_BLOCK = 512


class Arrays(Mapping[str, NDArray[Any]]):
    """The arrays of an ``.npz`` file of a set, by name and as attributes; each is read when it is first asked for.

    They cannot be changed in place; ``array.copy()`` can.

    >>> truth = Set("sets/walk").truth
    >>> truth.markers.shape[1:] == (len(truth["marker_names"]), 3)
    True
    """

    def __init__(self, *paths: Path) -> None:
        self._read: dict[str, NDArray[Any]] = {}
        self._places: dict[str, Path] = {}
        for path in paths:
            with _opened(path) as file:
                self._places.update(dict.fromkeys(file.files, path))

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._read:
            with _opened(self._places[name]) as file:
                array = file[name]
            # a change in place would change what everybody else reads
            array.flags.writeable = False
            self._read[name] = array
        return self._read[name]

    def __getattr__(self, name: str) -> NDArray[Any]:
        if name.startswith("_") or name not in self._places:
            raise AttributeError(f"no array {name!r}; there are {', '.join(self.__dict__.get('_places', ()))}")
        return self[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self)})"

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._places]


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """An ``.npz`` file, closed afterwards so that its folder can be removed on every system."""
    from zipfile import BadZipFile

    try:
        # np.load leaves a damaged file open that it opened itself
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            yield file
    except (OSError, ValueError, EOFError, BadZipFile, zlib.error) as error:
        raise InputError(
            f"{path}: expected arrays that skiagraph wrote, but {error}; skiagraph verify checks a set"
        ) from error


class Images:
    """The images of one camera, one for every frame of the set; each is read when it is asked for.

    ``images[frame]`` is (height, width) or (height, width, 3), or None if the camera took no image of that frame;
    ``images[a:b]`` and ``images[[3, 5]]`` are stacks (frames, height, width...), which need every image. Negative
    frames count from the end.

    >>> masks = Set("sets/walk").masks("cam00")
    >>> masks, masks[-1].shape, masks[2:5].shape, np.array_equal(masks[[3]][0], masks[3])
    (Images(19 frames), (120, 160), (3, 120, 160), True)
    """

    def __init__(self, files: _Files, paths: list[str | None], decode: Callable[[bytes, object], NDArray[Any]]) -> None:
        self._files, self._paths, self._decode = files, paths, decode

    def __len__(self) -> int:
        return len(self._paths)

    def __repr__(self) -> str:
        return f"Images({len(self)} frames)"

    @overload
    def __getitem__(self, frame: int) -> NDArray[Any] | None: ...
    @overload
    def __getitem__(self, frame: slice | Sequence[int] | NDArray[Any]) -> NDArray[Any]: ...
    def __getitem__(self, frame: int | slice | Sequence[int] | NDArray[Any]) -> NDArray[Any] | None:
        # NumPy's own rules and messages for indices
        chosen = np.arange(len(self))[frame]
        if chosen.ndim == 0:
            return self._one(self._paths[chosen])
        if chosen.ndim > 1:
            raise IndexError(f"expected frames in one dimension, found {chosen.ndim}")
        paths = [self._paths[index] for index in chosen]
        if None in paths:
            index = chosen[paths.index(None)]
            raise InputError(f"the camera has no image of frame {index}; read the frames one by one")
        some = self._one(next((path for path in self._paths if path is not None), None))
        if some is None:
            return np.empty((0, 0, 0), np.bool_)
        stack = np.empty((len(paths), *some.shape), some.dtype)
        for place, image in zip(stack, self._in_order(paths), strict=True):
            place[:] = image
        return stack

    def __iter__(self) -> Iterator[NDArray[Any] | None]:
        return self._in_order(self._paths)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:].astype(dtype, copy=False) if dtype is not None else self[:]

    def _in_order(self, paths: Sequence[str | None]) -> Iterator[NDArray[Any] | None]:
        """The images one after another, while threads unpack the next ones outside of the interpreter's lock."""
        if not paths:
            return
        yield (first := self._one(paths[0]))
        # several small images at a time, as handing one over takes as long as unpacking it
        size = max(1, _BATCH_BYTES // first.nbytes) if first is not None else 1
        batches = [paths[at : at + size] for at in range(1, len(paths), size)]
        if len(batches) < 2:
            yield from self._several(paths[1:])
            return
        from concurrent.futures import ThreadPoolExecutor

        threads = min(os.cpu_count() or 1, _MOST_THREADS)
        with ThreadPoolExecutor(threads) as pool:
            waiting: deque[Future[list[NDArray[Any] | None]]] = deque()
            try:
                for batch in batches:
                    waiting.append(pool.submit(self._several, batch))
                    if len(waiting) > 2 * threads:
                        yield from waiting.popleft().result()
                while waiting:
                    yield from waiting.popleft().result()
            finally:
                # a loop that is left early does not wait for images that nobody reads
                for images in waiting:
                    images.cancel()

    def _several(self, paths: Sequence[str | None]) -> list[NDArray[Any] | None]:
        return [self._one(path) for path in paths]

    def _one(self, path: str | None) -> NDArray[Any] | None:
        return None if path is None else self._decode(self._files.read(path), path)


class _Files:
    """Files of a set by their path in a set without shards."""

    def __init__(self, root: Path, keep: object = None) -> None:
        self.root = root
        #: The temporary folder, if the files are in one.
        self._keep = keep
        self._sides: dict[str, _Shards] = {}

    def read(self, path: str) -> bytes:
        try:
            return (self.root / path).read_bytes()
        except FileNotFoundError:
            if (place := self._packed(path).places.get(path)) is None:
                self.refuse_damaged(path)
                raise InputError(f"{self.root / path} is missing; skiagraph verify checks a set") from None
        shard, offset, size = place
        try:
            with shard.open("rb") as file:
                file.seek(offset)
                data = file.read(size)
        except OSError as error:
            raise InputError(f"{shard} cannot be read: {error}; skiagraph verify checks a set") from None
        if len(data) < size:
            raise InputError(f"{shard} ends within {path}; skiagraph verify checks a set")
        return data

    def has(self, path: str) -> bool:
        return (self.root / path).exists() or path in self._packed(path).places

    def refuse_damaged(self, path: str) -> None:
        """Refuses shards that are damaged and may have had this file."""
        if damaged := self._packed(path).damaged:
            raise InputError(
                f"{self.root / path} may be lost with the end of a shard that is cut off or damaged: "
                f"{', '.join(map(str, damaged))}; skiagraph verify checks a set"
            ) from None

    def _packed(self, path: str) -> _Shards:
        """The shards that a file may be in: trackers may read those of the observations only."""
        side = path.partition("/")[0]
        if side not in self._sides:
            self._sides[side] = _Shards(self.root / side / "shards")
        return self._sides[side]


class _Shards:
    """Where the files in the shards of a folder are, as far as the shards can be read."""

    def __init__(self, folder: Path) -> None:
        import tarfile

        #: Shard, offset and size of a file, by its path in a set without shards.
        self.places: dict[str, tuple[Path, int, int]] = {}
        #: Shards that do not end as they should.
        self.damaged: list[Path] = []
        for shard in sorted(folder.glob("*.tar")):
            end = 0
            try:
                with shard.open("rb") as file:
                    with tarfile.open(fileobj=file, mode="r:") as tar:
                        for member in tar:
                            self.places[_whole(member.name)] = (shard, member.offset_data, member.size)
                            end = member.offset_data + -(-member.size // _BLOCK) * _BLOCK
                    file.seek(end)
                    # tarfile takes a damaged header for the end
                    is_whole = file.read(2 * _BLOCK) == bytes(2 * _BLOCK)
            except (tarfile.TarError, OSError, EOFError, ValueError):
                is_whole = False
            if not is_whole:
                self.damaged.append(shard)


@contextmanager
def _described(files: _Files, path: str) -> Iterator[Any]:
    """The content of a JSON file, whose parts are taken from it within the block."""
    data = files.read(path)
    try:
        yield json.loads(data)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        found = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise InputError(
            f"{files.root / path}: expected JSON as skiagraph writes it, but {found}; skiagraph verify checks a set"
        ) from None


def _whole(name: str) -> str:
    """The path in a set without shards of a truth image in a shard; other names are paths already."""
    if (found := re.fullmatch(r"(\d{6})_(cam\d+)\.(layers\.exr|colour\.exr|depth\.png)", name)) is None:
        return name
    frame, camera, kind = found.groups()
    return f"truth/layers/{camera}/{frame}" + {"layers.exr": ".exr"}.get(kind, f"-{kind}")


@dataclass(frozen=True, eq=False)
class Start:
    """What a tracker is given of frame 0: the pose of its own body."""

    #: x y z qw qx qy qz of the root in the world, metres (7,).
    root: NDArray[np.float64]
    #: Radians (n,), in the order of ``angle_names``.
    angles: NDArray[np.float64]
    angle_names: list[str]


@dataclass(frozen=True, eq=False)
class Keypoints:
    """2-D keypoints with confidences, as a detector gives them, for F frames, C cameras and K keypoints.

    They are those of the images: for cameras with times of their own, at :attr:`Set.times`; if the set hides errors of
    the times (``desynchronisation_ms`` and so on), at times that neither the tracker nor this package is told.
    """

    names: list[str]
    cameras: list[str]
    #: Pixels (F, C, K, 2), pixel centres at integers; NaN without detection.
    points: NDArray[np.float64] = field(repr=False)
    #: 0 to 1 (F, C, K).
    confidence: NDArray[np.float64] = field(repr=False)


class Set:
    """A benchmark set, as ``skiagraph render`` makes it. Nothing is read before it is needed.

    Units are metres, radians and seconds; the world has Z up. ``truth_at`` is the folder of the complete set if this
    one was rendered without its truth (``render(..., truth=...)``).

    Raises:
        InputError: the folder is no benchmark set.

    >>> walk = Set("sets/walk")
    >>> walk.frames, walk.fps, [camera.name for camera in walk.cameras]
    (19, 60.0, ['cam00', 'cam01', 'cam02', 'cam03'])
    >>> walk.masks("cam00")[0].shape, walk.masks("cam00")[0].dtype
    ((120, 160), dtype('bool'))
    """

    def __init__(self, path: PathName, *, truth_at: PathName | None = None, keep: object = None) -> None:
        #: The folder, absolute.
        self.path = absolute(path, "set")
        #: The temporary folder, if the set is in one.
        self._keep = keep
        self._truth_at = None if truth_at is None else absolute(truth_at, "truth_at")
        try:
            text = (self.path / "set.toml").read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{self.path}: expected the folder of a benchmark set, but {self._lack(error)}") from None
        found = dict(re.findall(r"^(\w+) = (.+)$", text, re.MULTILINE))
        try:
            self.name: str = json.loads(found["name"])
            #: Number of frames.
            self.frames: int = int(found["frames"])
            #: Frames per second.
            self.fps: float = float(found["frames_per_second"])
            self.schema: str = json.loads(found["schema"])
        except (KeyError, ValueError) as error:
            raise InputError(
                f"{self.path / 'set.toml'}: expected name, schema, frames and frames_per_second: {error}"
            ) from None

    def _lack(self, error: Exception) -> str:
        """Why the folder is no set."""
        if not self.path.exists():
            return "there is no such folder"
        if not self.path.is_dir():
            return "it is a file"
        if any((self.path / name).exists() for name in ("run.json", "program.json", "poses.npz")):
            return "it is the folder of a run, which skiagraph.Run opens"
        return f"its set.toml cannot be read: {error}"

    def __repr__(self) -> str:
        facts = f"{self.frames} frames at {self.fps:g} Hz, {len(self.cameras)} cameras"
        return f"Set({str(self.path)!r}: {self.name}, {facts})"

    def __fspath__(self) -> str:
        return str(self.path)

    @cached_property
    def _files(self) -> _Files:
        return _Files(self.path, self._keep)

    @cached_property
    def cameras(self) -> list[Camera]:
        """The cameras as trackers are given them; those that move as they are in frame 0 (:meth:`cameras_at`)."""
        cameras = [camera for camera, _ in self._stored_cameras]
        if self._moments is None:
            return cameras
        delays = self._moments.line_delay_s.tolist()
        return [replace(camera, line_delay=delay) for camera, delay in zip(cameras, delays, strict=True)]

    def cameras_at(self, frame: int) -> list[Camera]:
        """The cameras when each exposed the first row of its image of this frame.

        Raises:
            InputError: there is no such frame.
        """
        is_number = isinstance(frame, (int, np.integer)) and not isinstance(frame, bool)
        if not is_number or not -self.frames <= frame < self.frames:
            raise InputError(f"{self.path} has no frame {frame!r}; expected 0 to {self.frames - 1}")
        if self._moments is None:
            return self.cameras
        poses = self._moments.camera_from_world[frame]
        return [
            replace(camera, R=_rotation(pose[3:]), t=pose[:3]) for camera, pose in zip(self.cameras, poses, strict=True)
        ]

    @cached_property
    def times(self) -> NDArray[np.float64]:
        """When every camera exposed the first row of its images, seconds (frames, cameras); NaN where it took none."""
        if self._moments is not None:
            return self._moments.time_s
        return np.repeat(np.arange(self.frames)[:, None] / self.fps, len(self.cameras), axis=1)

    def camera(self, name: str | int) -> Camera:
        """A camera by name or index.

        Raises:
            InputError: there is no such camera.
        """
        return self.cameras[self._index(name)]

    def masks(self, camera: str | int | Camera) -> Images:
        """The silhouettes that a camera saw, bool (height, width), one for every frame."""
        index = self._index(camera)
        _, folder = self._stored_cameras[index]
        return Images(self._files, self._paths(index, folder + "/silhouette/{:06}.png"), silhouette)

    def colour(self, camera: str | int | Camera) -> Images:
        """What a camera saw, uint8 (height, width, 3), red first, or (height, width) if the images are grey.

        Raises:
            InputError: the set has no images for trackers (``observation.colour_images``).
        """
        index = self._index(camera)
        folder = f"observations/colour/cam{index:02}"
        return Images(self._files, self._paths(index, f"{folder}/{{:06}}{self._extension(folder)}"), picture)

    def background(self, camera: str | int | Camera) -> Images:
        """The scene without people, as a camera saw it before, during and after the frames, in this order.

        Raises:
            InputError: the set has no images for trackers.
        """
        folder = f"observations/background/cam{self._index(camera):02}"
        extension = self._extension(folder)
        count = len(list((self.path / folder).glob("*" + extension)))
        return Images(self._files, [f"{folder}/{number:06}{extension}" for number in range(count)], picture)

    def _extension(self, folder: str) -> str:
        """The extension of the images in a folder."""
        found = next((self.path / folder).glob("000000.*"), None) or next((self.path / folder).glob("*.*"), None)
        if found is None:
            raise InputError(
                f"{self.path} has no images for trackers; render it with observation.colour_images=png, or read masks"
            )
        return found.suffix

    @cached_property
    def keypoints(self) -> Keypoints | None:
        """2-D keypoints of the observations; None if the set has none."""
        path = self.path / "observations" / "keypoints.npz"
        if not path.exists():
            return None
        found = Arrays(path)
        names, cameras = found["keypoint_names"].tolist(), found["cameras"].tolist()
        points, confidence = (found[name].astype(np.float64) for name in ("keypoints", "confidence"))
        return Keypoints(names, cameras, points, confidence)

    @cached_property
    def start(self) -> Start:
        """The pose of the tracker's body in frame 0."""
        with _described(self._files, "start/start.json") as found:
            root = np.array(found["root"]["position"] + found["root"]["quaternion_wxyz"], np.float64)
            return Start(root, np.array(found["angles"], np.float64), found["angle_names"])

    @cached_property
    def body(self) -> dict[str, Any]:
        """The tracker's body, as in ``start/body.json`` (FORMATS.txt of the set describes it)."""
        with _described(self._files, "start/body.json") as found:
            return dict(found)

    @cached_property
    def joint_names(self) -> list[str]:
        """The joints of the tracker's body."""
        with _described(self._files, "start/body.json") as found:
            return [joint["name"] for joint in found["joints"]]

    @cached_property
    def training(self) -> Arrays | None:
        """Motions to learn from, which are never those of the set; None if it has none."""
        path = self.path / "start" / "training.npz"
        return Arrays(path) if path.exists() else None

    @cached_property
    def truth(self) -> Truth:
        """The ground truth, which trackers must not use.

        Raises:
            NoTruthError: the set has none, so ``hasattr(set, "truth")`` is False.
        """
        root = self._truth_at or self.path
        if not (root / "truth" / "truth.npz").exists():
            raise NoTruthError(
                f"{root} has no ground truth (truth/truth.npz); give the folder of the complete set: "
                f"Set({fspath(self)!r}, truth_at=...)"
            )
        return Truth(self, root)

    def evaluate(self, estimate: Any, names: Sequence[str] | None = None, **options: Any) -> Result:
        """Measures an estimate against the truth; see :func:`skiagraph.evaluate`."""
        from .measuring import evaluate

        return evaluate(self, estimate, names, **options)

    @cached_property
    def _stored_cameras(self) -> list[tuple[Camera, str]]:
        """The cameras of ``cameras.json`` with the folders of their observations."""
        with _described(self._files, "cameras.json") as found:
            return [(Camera.from_record(record), record["observations"]) for record in found["cameras"]]

    @cached_property
    def _moments(self) -> Arrays | None:
        path = self.path / "cameras.npz"
        return Arrays(path) if path.exists() else None

    def _index(self, camera: str | int | Camera) -> int:
        camera = camera.name if isinstance(camera, Camera) else camera
        names = [stored.name for stored, _ in self._stored_cameras]
        if isinstance(camera, str) and camera in names:
            return names.index(camera)
        is_index = isinstance(camera, (int, np.integer)) and not isinstance(camera, bool)
        if is_index and -len(names) <= int(camera) < len(names):
            return int(camera) % len(names)
        raise InputError(f"{self.path} has no camera {camera!r}; its cameras are {', '.join(names)}")

    def _paths(self, camera: int, pattern: str) -> list[str | None]:
        has_image = np.isfinite(self.times[:, camera])
        return [pattern.format(frame) if has_image[frame] else None for frame in range(self.frames)]


class Truth(Arrays):
    """The ground truth of a set: the arrays of ``truth.npz`` and ``views.npz``, and the truth images.

    For T frames, J joints and C cameras: ``joints`` (T, J, 3), ``markers`` (T, 15, 3), ``root`` (T, 7),
    ``angles`` (T, n), ``joints_2d`` (T, C, J, 2) and so on; ``list(truth)`` names all, README.txt of the set
    describes them.

    >>> truth = Set("sets/walk").truth
    >>> depth = truth.depth("cam00")[0]
    >>> depth.shape, bool(np.isfinite(depth[truth.parts("cam00")[0] > 0]).all())
    ((120, 160), True)
    """

    def __init__(self, of: Set, root: Path) -> None:
        found = [root / "truth" / name for name in ("truth.npz", "views.npz")]
        super().__init__(*(path for path in found if path.exists()))
        self._set, self._root, self._images = of, root, _Files(root)

    @cached_property
    def contact(self) -> Arrays | None:
        """Gaps, contacts, slips and support (``contact.npz``); None if the actor's feet have no geometry."""
        return self._more("contact.npz")

    @cached_property
    def keypoints(self) -> Arrays | None:
        """Exact keypoints and the errors of the detector (``keypoints.npz``); None if the set has no keypoints.

        ``keypoints_3d`` is at the time of the frame, as all other truth; ``keypoints_2d`` at the time of exposure.
        """
        return self._more("keypoints.npz")

    def _more(self, name: str) -> Arrays | None:
        path = self._root / "truth" / name
        return Arrays(path) if path.exists() else None

    @cached_property
    def cameras(self) -> list[Camera]:
        """The cameras that saw the actor, in frame 0; others than :attr:`Set.cameras` if trackers are given errors."""
        if not self._images.has("truth/cameras.json"):
            return self._set.cameras
        with _described(self._images, "truth/cameras.json") as found:
            return [Camera.from_record(record) for record in found["cameras"]]

    def depth(self, camera: str | int | Camera) -> Images:
        """Metres along the camera's z axis (height, width), infinite without body; needs the layer ``depth``."""
        return self.layer("depth.Z", camera)

    def parts(self, camera: str | int | Camera) -> Images:
        """Index of the visible link in ``link_names`` plus 1, 0 without body; needs the layer ``parts``."""
        return self.layer("id.part", camera)

    def layer(self, channel: str, camera: str | int | Camera, *, empty: float | None = None) -> Images:
        """A channel of the truth images by its name in the files.

        Pixels outside of their data windows are `empty`; by default infinite in ``depth.Z``, NaN in the flow, else 0.

        Raises:
            InputError: the set has no truth images, or no such channel; the message lists those it has.
        """
        index = self._set._index(camera)
        kinds = [self._set._paths(index, f"truth/layers/cam{index:02}/{{:06}}{end}") for end in (".exr", "-colour.exr")]
        found = [paths for paths in kinds if any(self._images.has(path) for path in paths if path is not None)]
        if not found:
            self._images.refuse_damaged(f"truth/layers/cam{index:02}")
            raise InputError(
                f"{self._root} has no truth images; render it with layers, as in layers=['depth', 'parts']"
            )
        # brightness has files of its own; in sets of earlier versions it is beside the geometry
        paths = found[-1] if channel in ("R", "G", "B", "Y") else found[0]

        outside = _OUTSIDE.get(channel, 0.0) if empty is None else empty
        return Images(self._images, paths, partial(_channel, name=channel, empty=outside))


#: Values of channels of truth images where there is no body, if not 0.
_OUTSIDE = {"depth.Z": np.inf, "forward.u": np.nan, "forward.v": np.nan}


def _channel(data: bytes, path: object, *, name: str, empty: float) -> NDArray[Any]:
    channels, place, size = exr(data, path)
    if name not in channels:
        raise InputError(f"{path} has no channel {name!r}; it has {', '.join(channels)}")
    image = np.full(size, empty, channels[name].dtype)
    image[place] = channels[name]
    return image


def _rotation(quaternion: ArrayLike) -> NDArray[np.float64]:
    """The rotation matrix of a unit quaternion w x y z."""
    w, x, y, z = np.asarray(quaternion, np.float64)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
