"""A benchmark set on disk: what trackers may see, and the truth where the set has it."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arrays import Fixed, index_of, shaped
from .camera import Camera
from .errors import InputError, MissingNameError, NoTruthError, reading
from .executable import call, called_json, options
from .images import exr, picture, silhouette
from .paths import PathName, absolute, given
from .tracking import Frame, SetInfo, Start, content

if TYPE_CHECKING:
    from zipfile import ZipFile

    from typing_extensions import Unpack

    from .measuring import Reading, Result
    from .session import Session

#: Threads that unpack images; more would only wait for the interpreter. Each unpacks so many batches ahead.
_MOST_THREADS, _AHEAD = 8, 8
#: Bytes of the images that a thread unpacks in one go.
_BATCH_BYTES = 1 << 21
_MOST_FRAMES = 1_000_000
#: Seconds for a frame of a session, a day: people look at frames in notebooks.
PATIENCE_S = 86_400.0
#: Bytes that a packed byte of an archive can become.
_MOST_PACKED = 1032
_ARRAYS = "arrays that skiagraph wrote"


class Arrays(Mapping[str, NDArray[Any]]):
    """The arrays of an ``.npz`` file of a set, by name and as attributes; each is read when it is first asked for.

    They cannot be changed in place; ``array.copy()`` can.
    """

    def __init__(self, *paths: Path) -> None:
        self._read: dict[str, NDArray[Any]] = {}
        self._places: dict[str, Path] = {}
        self._paths = paths
        for path in paths:
            with _opened(path) as file:
                self._places.update(dict.fromkeys(file.files, path))

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name not in self._places:
            files = ", ".join(map(str, self._paths))
            raise MissingNameError(f"{files}: {MissingNameError.of('array', name, self)}")
        if name not in self._read:
            with _opened(path := self._places[name]) as file:
                _check_size(file.zip, f"{name}.npy", path)
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

    def __getstate__(self) -> dict[str, Any]:
        # an array is read again, since it could be changed in place after its way through a pickle
        return {**vars(self), "_read": {}}

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._places]


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """An ``.npz`` file, closed afterwards so that its folder can be removed on every system."""
    # np.load leaves a damaged file open that it opened itself
    advice = "run the tracker again" if path.name == "poses.npz" else "make it again"
    with reading(path, _ARRAYS, advice), path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
        yield file


def _check_size(archive: ZipFile, name: str, path: Path) -> None:
    """Refuses an array that claims more numbers than its file holds, before it is made."""
    from zipfile import ZIP_DEFLATED, ZIP_STORED

    form: Any = np.lib.format
    entry = archive.getinfo(name)
    is_known = entry.compress_type in (ZIP_STORED, ZIP_DEFLATED)
    if not is_known or not entry.file_size <= _MOST_PACKED * entry.compress_size <= _MOST_PACKED * path.stat().st_size:
        raise ValueError(f"{name} claims {entry.file_size} bytes, packed {entry.compress_size}")
    with archive.open(entry) as file:
        header = form.read_array_header_1_0 if form.read_magic(file) == (1, 0) else form.read_array_header_2_0
        shape, _, dtype = header(file)
        held = entry.file_size - file.tell()
    if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != held:
        raise ValueError(f"{name} claims {dtype} of shape {shape}, and holds {held} bytes")


def _check_shapes(arrays: Arrays, path: Path, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Refuses a file whose arrays are no numbers of these shapes."""
    with reading(path, _ARRAYS):
        for name, shape in shapes.items():
            if arrays[name].shape != shape or arrays[name].dtype.kind not in "fiu":
                raise ValueError(f"{name} is {arrays[name].dtype} of shape {arrays[name].shape} instead of {shape}")


@Sequence.register  # pyright: ignore[reportAttributeAccessIssue]
class Images:
    """The images of one camera, one for every frame of the set; each is read when it is asked for.

    ``images[frame]`` is (height, width) or (height, width, 3), or None if the camera took no image of that frame;
    ``images[a:b]`` and ``images[[3, 5]]`` are stacks (frames, height, width...), which need every image. Negative
    frames count from the end.
    """

    def __init__(
        self, root: Path, paths: list[str | None], decode: Callable[[bytes, object], NDArray[Any]], keep: object
    ) -> None:
        self._root, self._paths, self._decode, self._keep = root, paths, decode, keep

    def __len__(self) -> int:
        return len(self._paths)

    def __repr__(self) -> str:
        return f"Images({len(self)} frames)"

    @overload
    def __getitem__(self, frame: int | np.integer[Any]) -> NDArray[Any] | Any: ...
    @overload
    def __getitem__(self, frame: slice | Sequence[int] | NDArray[Any]) -> NDArray[Any]: ...
    def __getitem__(self, frame: int | np.integer[Any] | slice | Sequence[int] | NDArray[Any]) -> NDArray[Any] | None:
        chosen = np.arange(len(self))[frame]
        if chosen.ndim == 0:
            return self._one(self._paths[chosen])
        paths = [self._paths[index] for index in chosen]
        if None in paths:
            index = chosen[paths.index(None)]
            raise InputError(f"the camera has no image of frame {index}; read the frames one by one")
        some = self._one(next((path for path in self._paths if path is not None), None))
        if some is None:
            return np.empty((0, 0, 0), np.bool_)
        stack = np.empty((len(paths), *some.shape), some.dtype)
        for path, place, image in zip(paths, stack, self._in_order(paths), strict=True):
            if image is None or image.shape != place.shape:
                raise InputError(f"{path}: its pixels are not {place.shape} as those of the camera's other images")
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
            yield from map(self._one, paths[1:])
            return
        from concurrent.futures import ThreadPoolExecutor

        threads = min(os.cpu_count() or 1, _MOST_THREADS)
        with ThreadPoolExecutor(threads) as pool:
            # not all at once, as nobody may want the last ones
            for at in range(0, len(batches), _AHEAD * threads):
                some = batches[at : at + _AHEAD * threads]
                yield from chain.from_iterable(pool.map(lambda batch: list(map(self._one, batch)), some))

    def _one(self, path: str | None) -> NDArray[Any] | None:
        return None if path is None else self._decode(content(self._root / path), path)


@contextmanager
def _described(path: Path) -> Iterator[Any]:
    """The content of a JSON file, whose parts are taken from it within the block."""
    with reading(path, "JSON as skiagraph writes it"):
        yield json.loads(path.read_bytes())


@dataclass(frozen=True, eq=False)
class Keypoints(Fixed):
    """2-D keypoints with confidences, as a detector gives them, for F frames, C cameras and K keypoints.

    ``points`` are pixels (F, C, K, 2), pixel centres at integers, NaN without detection; ``confidence`` is 0 to 1
    (F, C, K); ``names`` are those of the keypoints and ``cameras`` those of the cameras. They are at the times of the
    images, :attr:`Set.times`, but for errors of the times that the set hides (``desynchronisation_ms`` and so on).
    """

    _arrays = ("points", "confidence")

    names: tuple[str, ...]
    cameras: tuple[str, ...]
    points: NDArray[np.float64] = field(repr=False)
    confidence: NDArray[np.float64] = field(repr=False)


class Set(Sequence[Frame]):
    """A benchmark set, as ``skiagraph render`` makes it. Nothing is read before it is needed.

    ``frames`` is the number of frames and ``fps`` how many a second has; ``path`` is the absolute folder. Units are
    metres, radians and seconds; the world has Z up. A set is a sequence of what trackers see: ``len(set)``,
    ``set[3]``, ``set[10:20]`` (a list) and ``for frame in set`` have a :class:`Frame` for every frame. ``truth_at`` is
    the folder of the complete set if this one was rendered without its truth (``render(..., truth=...)``).

    Raises:
        InputError: the folder is no benchmark set.

    >>> walk = Set("sets/walk")
    >>> len(walk), walk.fps, [camera.name for camera in walk.cameras]
    (19, 60.0, ['cam00', 'cam01', 'cam02', 'cam03'])
    >>> estimate = {frame.index: frame.info.start.markers for frame in walk if frame.mask_array.any()}
    >>> walk.evaluate(estimate).grade
    'poor'
    """

    def __init__(self, path: PathName, *, truth_at: PathName | None = None, keep: object = None) -> None:
        self.path = absolute(path, "set")
        self._keep = keep
        self._truth_at = None if truth_at is None else absolute(truth_at, "truth_at")
        try:
            self._opened = (self.path / "set.toml").stat().st_mtime_ns
            text = (self.path / "set.toml").read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{self.path}: expected the folder of a benchmark set, but {self._lack(error)}") from None
        found = dict(re.findall(r"^(\w+) = (.+)$", text, re.MULTILINE))
        with reading(self.path / "set.toml", "name, schema, frames and frames_per_second"):
            self.name: str = json.loads(found["name"])
            self.frames: int = int(found["frames"])
            self.fps: float = float(found["frames_per_second"])
            self.schema: str = json.loads(found["schema"])
            if not (isinstance(self.name, str) and isinstance(self.schema, str)):
                raise TypeError("name or schema is no text")
            if not (1 <= self.frames <= _MOST_FRAMES and 0 < self.fps < math.inf):
                raise ValueError(f"there are {self.frames} frames at {self.fps} Hz")

    def _check_same(self) -> None:
        """Refuses to mix what was read of a set with another one that was rendered into its folder since."""
        with suppress(OSError):
            if (self.path / "set.toml").stat().st_mtime_ns != self._opened:
                raise InputError(f"{self.path} was rendered again since this set was opened; open it anew: Set(path)")

    def _lack(self, error: Exception) -> str:
        if not self.path.exists():
            return "there is no such folder"
        if not self.path.is_dir():
            return "it is a file"
        if any((self.path / name).exists() for name in ("run.json", "program.json", "poses.npz")):
            return "it is the folder of a run, which skiagraph.Run opens"
        return f"its set.toml cannot be read: {error}"

    def __repr__(self) -> str:
        cameras = f"{len(self.cameras)} cameras"
        return f"Set({str(self.path)!r}: {self.name}, {self.frames} frames at {self.fps:g} Hz, {cameras})"

    def __fspath__(self) -> str:
        return str(self.path)

    def _repr_html_(self) -> str:
        """A player of the set for notebooks, some 200 kB."""
        from html import escape
        from tempfile import TemporaryDirectory

        with TemporaryDirectory(prefix="skiagraph-") as room:
            page = Path(room, "set.html")
            call(["inspect", self._truth_at or self.path, "--small", f"--out={page}"], may=(1,))
            text = escape(page.read_text(encoding="utf-8"))
        return f'<iframe style="width:100%;height:640px;border:0" srcdoc="{text}"></iframe>'

    def __len__(self) -> int:
        return self.frames

    @overload
    def __getitem__(self, frame: int | np.integer[Any]) -> Frame: ...
    @overload
    def __getitem__(self, frame: slice) -> list[Frame]: ...
    def __getitem__(self, frame: int | np.integer[Any] | slice) -> Frame | list[Frame]:
        if isinstance(frame, slice):
            return [self._frame(index) for index in range(self.frames)[frame]]
        return self._frame(index_of(frame, self.frames))

    def __iter__(self) -> Iterator[Frame]:
        return map(self._frame, range(self.frames))

    def _frame(self, index: int) -> Frame:
        """What trackers see of a frame, whose files are read when they are asked for."""
        self._check_same()
        cameras, views = self.cameras_at(index), []
        for number, (_, folder) in enumerate(self._stored_cameras):
            time = float(self.times[index, number])
            view: dict[str, Any] = {"camera": cameras[number].name, "keep": self._keep}
            if self._moments is not None:
                view["exposed_s"] = time if math.isfinite(time) else None
            if math.isfinite(time):
                view["mask"] = str(self.path / folder / "silhouette" / f"{index:06}.png")
                if colours := self._colours[number]:
                    view["colour"] = str(self.path / str(colours._paths[index]))
                if self.keypoints is not None:
                    parts = (self.keypoints.points, self.keypoints.confidence[..., None])
                    view["keypoints"] = np.concatenate([part[index, number] for part in parts], axis=-1)
            views.append(view)
        return Frame(
            {"frame": index, "time_s": index / self.fps, "views": views}, partial(getattr, self, "info"), cameras
        )

    @cached_property
    def _colours(self) -> list[Images | None]:
        """The images that each camera has for trackers; None without any."""
        folders = [self.path / f"observations/colour/cam{index:02}" for index in range(len(self.cameras))]
        return [self.colour(index) if folder.is_dir() else None for index, folder in enumerate(folders)]

    @cached_property
    def _facts(self) -> dict[str, Any]:
        return _facts_of(self.path)

    @cached_property
    def info(self) -> SetInfo:
        """What a tracker is told before the first frame, of seed 0: names, start pose, cameras and so on."""
        with _described(self.path / "start/start.json") as found:
            root = shaped(found["root"]["position"] + found["root"]["quaternion_wxyz"], (7,), "root")
            names = [str(name) for name in found["angle_names"]]
            angles = shaped(found["angles"], (len(names),), "angles")
        markers, joints = (dict(self._facts["points"][name]) for name in ("start_markers", "start_joints"))
        start = {"root": root, "angles": angles, "markers": markers, "joints": joints}
        with _described(self.path / "cameras.json") as found:
            cameras = [dict(record) for record in found["cameras"]]
        for record, camera in zip(cameras, self.cameras, strict=True):
            record["line_delay_s"] = camera.line_delay
        for record in cameras if any(self._colours) else []:
            paths = self.background(record["name"])._paths
            record["background"] = [str(self.path / path) for path in paths if path is not None]
        hello = {"seed": 0, "frames": self.frames, "fps": self.fps, "cameras": cameras, "folder": str(self.path)}
        hello |= {"markers": list(markers), "joints": list(joints), "angles": names, "start": start}
        keypoints = {} if self.keypoints is None else {"keypoints": {"names": self.keypoints.names}}
        return SetInfo({**hello, **keypoints})

    def tracking(
        self,
        seed: int = 0,
        *,
        name: str = "session",
        out: PathName | None = None,
        frame_limit: float = PATIENCE_S,
        restarts: int | None = None,
        force: bool = False,
    ) -> Session:
        """Begins a run of a tracker in a loop of your own; see :class:`skiagraph.Session`."""
        from .session import Session

        return Session(self, seed=seed, name=name, out=out, frame_limit=frame_limit, restarts=restarts, force=force)

    def export(self, to: str, out: PathName | None = None, *, force: bool = False) -> Path:
        """Writes the set in the format of another tool, as ``skiagraph export`` does; returns the folder.

        Args:
            to: ``"coco"``, ``"opencv"``, ``"bvh"``, ``"trc"``, ``"c3d"``, ``"webdataset"``, ``"pose2sim"``, ``"video"``
                (MP4 of every camera, by your ffmpeg) and so on; several with commas, each in a subfolder.
            out: the folder; by default SET-FORMAT beside the set, which vanishes with a temporary set.
            force: replace an earlier export.

        Raises:
            InputError: there is no such format (the message lists all), or the set lacks what it needs.
        """
        place = Path(f"{self.path}-{given(to, 'to').replace(',', '-')}") if out is None else absolute(out, "out")
        words = options(to=to, out=place, truth=None if to == "video" else self._truth_at, force=force)
        call(["export", self.path, *words])
        return place

    @cached_property
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras as trackers are given them; those that move as they are in frame 0 (:meth:`cameras_at`)."""
        cameras = tuple(camera for camera, _ in self._stored_cameras)
        if self._moments is None:
            return cameras
        delays = self._moments.line_delay_s.tolist()
        return tuple(replace(camera, line_delay=delay) for camera, delay in zip(cameras, delays, strict=True))

    def cameras_at(self, frame: int) -> tuple[Camera, ...]:
        """The cameras when each exposed the first row of its image of this frame."""
        frame = index_of(frame, self.frames)
        if self._moments is None:
            return self.cameras
        poses = self._moments.camera_from_world[frame]
        pairs = zip(self.cameras, poses, strict=True)
        return tuple(replace(camera, R=_rotation(pose[3:]), t=pose[:3]) for camera, pose in pairs)

    @property
    def times(self) -> NDArray[np.float64]:
        """When every camera exposed the first row of its images, seconds (frames, cameras); NaN where it took none."""
        if self._moments is not None:
            return self._moments.time_s
        return np.broadcast_to(np.arange(self.frames)[:, None] / self.fps, (self.frames, len(self.cameras)))

    def camera(self, name: str | int) -> Camera:
        """A camera by name or index."""
        return self.cameras[self._index(name)]

    def masks(self, camera: str | int | Camera) -> Images:
        """The silhouettes that a camera saw, bool (height, width), one for every frame."""
        index = self._index(camera)
        _, folder = self._stored_cameras[index]
        return Images(self.path, self._paths(index, folder + "/silhouette/{:06}.png"), silhouette, self._keep)

    def colour(self, camera: str | int | Camera) -> Images:
        """What a camera saw, uint8 (height, width, 3), red first, or (height, width) if the images are grey."""
        index = self._index(camera)
        folder = f"observations/colour/cam{index:02}"
        return Images(self.path, self._paths(index, f"{folder}/{{:06}}{self._extension(folder)}"), picture, self._keep)

    def background(self, camera: str | int | Camera) -> Images:
        """The scene without people, as a camera saw it before, during and after the frames, in this order."""
        folder = f"observations/background/cam{self._index(camera):02}"
        extension = self._extension(folder)
        count = len(list((self.path / folder).glob("*" + extension)))
        return Images(self.path, [f"{folder}/{number:06}{extension}" for number in range(count)], picture, self._keep)

    def _extension(self, folder: str) -> str:
        found = next((self.path / folder).glob("000000.*"), None) or next((self.path / folder).glob("*.*"), None)
        if found is None:
            remedy = "render it with observation__colour_images='png', or read masks"
            raise InputError(f"{self.path} has no images for trackers; {remedy}")
        return found.suffix

    @cached_property
    def keypoints(self) -> Keypoints | None:
        """2-D keypoints of the observations; None if the set has none."""
        path = self.path / "observations" / "keypoints.npz"
        if not path.exists():
            return None
        found = Arrays(path)
        names, cameras = (tuple(found[name].tolist()) for name in ("keypoint_names", "cameras"))
        shape = (self.frames, len(self.cameras), found["keypoint_names"].size)
        _check_shapes(found, path, {"keypoints": (*shape, 2), "confidence": shape})
        return Keypoints(names, cameras, found["keypoints"], found["confidence"])

    @cached_property
    def start(self) -> Start:
        """The pose of the tracker's body in frame 0."""
        return self.info.start

    @property
    def marker_names(self) -> tuple[str, ...]:
        """The markers by which estimates are measured, in the order of arrays."""
        return self.info.markers

    @property
    def body(self) -> dict[str, Any]:
        """The tracker's body, as in ``start/body.json`` (FORMATS.txt of the set describes it)."""
        with _described(self.path / "start/body.json") as found:
            return dict(found)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The joints of the tracker's body."""
        return self.info.joints

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
            lack = "has no ground truth (truth/truth.npz)" if root.is_dir() else "is no folder, or no longer"
            raise NoTruthError(f"{root} {lack}; give the complete set: Set({str(self.path)!r}, truth_at=...)")
        if self._truth_at is not None and _facts_of(root)["set_hash"] != self._facts["set_hash"]:
            raise InputError(f"{root} is not the truth of {self.path}; give the folder of render(..., truth=...)")
        return Truth(self, root)

    def evaluate(self, estimate: Any, names: Sequence[str] | None = None, **options: Unpack[Reading]) -> Result:
        """Measures an estimate, such as ``{frame.index: answer, ...}``, against the truth; see :func:`evaluate`."""
        from .measuring import evaluate

        if "truth" in options:
            raise InputError(f"the complete set is that of the set: Set({str(self.path)!r}, truth_at=...)")
        return evaluate(self, estimate, names, **options)

    @cached_property
    def _stored_cameras(self) -> list[tuple[Camera, str]]:
        """The cameras of ``cameras.json`` with the folders of their observations."""
        with _described(self.path / "cameras.json") as found:
            stored = [(Camera.from_record(record), record["observations"]) for record in found["cameras"]]
            if not stored:
                raise ValueError("there are no cameras")
            for camera, folder in stored:
                if not re.fullmatch(r"observations/[\w-]+", folder):
                    raise ValueError(f"the observations of camera {camera.name!r} are in {folder!r:.80}")
            return stored

    @cached_property
    def _moments(self) -> Arrays | None:
        path = self.path / "cameras.npz"
        if not path.exists():
            return None
        found, shape = Arrays(path), (self.frames, len(self._stored_cameras))
        shapes = {"time_s": shape, "camera_from_world": (*shape, 7), "line_delay_s": shape[1:]}
        _check_shapes(found, path, shapes)
        return found

    def _index(self, camera: str | int | Camera) -> int:
        self._check_same()
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
    """

    def __init__(self, of: Set, root: Path) -> None:
        found = [root / "truth" / name for name in ("truth.npz", "views.npz")]
        super().__init__(*(path for path in found if path.exists()))
        self._set, self._root = of, root

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
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras that saw the actor, in frame 0; others than :attr:`Set.cameras` if trackers are given errors."""
        if not (path := self._root / "truth" / "cameras.json").exists():
            return self._set.cameras
        with _described(path) as found:
            return tuple(map(Camera.from_record, found["cameras"]))

    def joints_as(self, layout: str) -> dict[str, NDArray[np.float64]]:
        """Joints of a data set on the actor by name, in its order: metres (T, 3), NaN where the body has none.

        ``"coco17"``, ``"halpe26"``, ``"body25"``, ``"h36m17"`` and ``"smpl24"``. Keypoints are where
        ``observation.keypoints`` has them; joints of Human3.6M and SMPL where this body has the same one.

        Raises:
            InputError: there is no such layout.
        """
        if layout not in (known := self._layouts):
            raise InputError(f"expected one of {', '.join(known)}, found {layout!r:.80}")
        named = {}
        for name, place in known[layout]:
            frames = self["link_frames"][:, place[0]] if place else np.full((self._set.frames, 7), np.nan)
            w, axis, local = frames[:, 3:4], frames[:, 4:], np.array(place[1] if place else [0.0] * 3)
            # a unit quaternion turns a point
            named[name] = frames[:, :3] + local + 2 * np.cross(axis, np.cross(axis, local) + w * local)
        return named

    @cached_property
    def _layouts(self) -> dict[str, Any]:
        return dict(_facts_of(self._root)["points"]["layouts"])

    def depth(self, camera: str | int | Camera) -> Images:
        """Metres along the camera's z axis (height, width), infinite without body; needs the layer ``depth``."""
        return self.layer("depth.Z", camera)

    def layer(self, channel: str, camera: str | int | Camera, *, empty: float | None = None) -> Images:
        """A channel of the truth images by its name in the files, such as ``"id.part"``: index of the visible link in
        ``link_names`` plus 1, 0 without body (``truth_images=["parts"]``).

        Pixels outside of their data windows are `empty`; by default infinite in ``depth.Z``, NaN in the flow, else 0.

        Raises:
            InputError: the set has no truth images, or no such channel; the message lists those it has.
        """
        index = self._set._index(camera)
        end = "-colour.exr" if channel in ("R", "G", "B", "Y") else ".exr"
        paths = self._set._paths(index, f"truth/layers/cam{index:02}/{{:06}}{end}")
        if not any((self._root / path).exists() for path in paths if path is not None):
            raise InputError(f"{self._root} has no such truth images; render it with truth_images=['depth', 'parts']")
        outside = _OUTSIDE.get(channel, 0.0) if empty is None else empty
        camera = self._set.cameras[index]
        size = (camera.height, camera.width)
        return Images(self._root, paths, partial(_channel, name=channel, empty=outside, size=size), self._set._keep)


def _facts_of(root: Path) -> dict[str, Any]:
    """What the program says of a set: its hash, and points of the bodies."""
    # exit code 1: a file is not that which was written, which skiagraph verify says
    return called_json(["inspect", root], may=(1,))


#: Values of channels of truth images where there is no body, if not 0.
_OUTSIDE = {"depth.Z": np.inf, "forward.u": np.nan, "forward.v": np.nan}


def _channel(data: bytes, path: object, *, name: str, empty: float, size: tuple[int, int]) -> NDArray[Any]:
    with reading(path, "an OpenEXR image of a set"):
        channels, place, found = exr(data)
    if found != size:
        raise InputError(f"{path}: its display window is {found} instead of its camera's {size}, rows and columns")
    if name not in channels:
        raise InputError(f"{path} has no channel {name!r}; it has {', '.join(channels)}")
    image = np.full(size, empty, channels[name].dtype)
    image[place] = channels[name]
    return image


def _rotation(quaternion: ArrayLike) -> NDArray[np.float64]:
    w, *axis = np.asarray(quaternion, np.float64)
    turn = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + 2 * (w * turn + turn @ turn), np.float64)
