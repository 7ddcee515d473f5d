"""Reading sets: every image and array by two roads."""

import functools
import io
import itertools
import json
import multiprocessing
import os
import pickle
import re
import shutil
import struct
import subprocess
import sys
import textwrap
import threading
import zipfile
import zlib

import numpy as np
import pytest
from conftest import SMALL

import skiagraph
from skiagraph.benchmark_set import _channel
from skiagraph.images import picture, silhouette


def test_masks_are_those_that_the_program_sends_to_trackers(small):
    seen = []

    class Watch:
        def track(self, frame):
            seen.append([view.mask for view in frame.views])
            return frame.info.start.markers

    skiagraph.track(small, Watch())
    # the program's run lengths instead of its files
    code = """
import sys, numpy, skiagraph
seen = []
def watch(frame):
    seen.append([view.mask for view in frame.views])
    if frame.index == frame.info.frames - 1:
        numpy.save("inline.npy", seen)
    return frame.info.start.markers
skiagraph.serve(watch)
"""
    (small.path.parent / "watch.py").write_text(code)
    place = small.path.parent / "inline.npy"
    command = f"cd {small.path.parent} && {sys.executable} watch.py"
    skiagraph.track(small, skiagraph.Program(command, inline=True))
    of_set = np.stack([small.masks(camera.name)[:] for camera in small.cameras], axis=1)
    assert of_set.shape == (small.frames, 4, 120, 160)
    assert of_set.any()
    assert np.array_equal(of_set, seen)
    assert np.array_equal(of_set, np.load(place))
    assert np.array_equal(np.asarray(small.masks(2)), of_set[:, 2])


def test_projection_agrees_with_the_truth_of_the_program(small):
    for index, camera in enumerate(small.cameras):
        pixels = camera.project(small.truth.markers)
        assert np.allclose(pixels, small.truth.markers_2d[:, index], atol=1e-9, equal_nan=True)
        assert np.allclose(camera.R @ camera.centre + camera.t, 0)
    with pytest.raises(skiagraph.InputError, match=r"shape \(\.\.\., 3\) in metres, found shape \(2,\)"):
        small.cameras[0].project([1.0, 2.0])


def test_a_lens_bends_as_opencv_has_it():
    cv2 = pytest.importorskip("cv2")
    K, R, t = np.array([[300.0, 0, 160], [0, 310, 120], [0, 0, 1]]), np.eye(3), np.array([0.1, -0.2, 3.0])
    distortion = np.array([-0.2, 0.05, 0.001, -0.002, 0.01])
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    expected = cv2.projectPoints(points, R, t, K, distortion)[0][:, 0]
    assert np.allclose(skiagraph.Camera("c", 320, 240, K, R, t, distortion).project(points), expected, atol=1e-9)


def test_depth_agrees_with_the_rounded_images_and_with_the_parts(small):
    cv2 = pytest.importorskip("cv2")
    for frame in (0, 7, small.frames - 1):
        depth, parts = small.truth.depth("cam01")[frame], small.truth.layer("id.part", "cam01")[frame]
        data = (small.path / f"truth/layers/cam01/{frame:06}-depth.png").read_bytes()
        millimetres = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        body = parts > 0
        assert np.array_equal(body, np.isfinite(depth))
        assert np.array_equal(body, millimetres > 0)
        assert np.abs(millimetres[body] - 1000 * depth[body].astype(float)).max() <= 0.5
        assert parts.max() <= len(small.truth.link_names)
        # the silhouette is exact
        assert np.mean(body != small.masks("cam01")[frame]) < 1e-3
    with pytest.raises(skiagraph.InputError, match=r"no channel 'normal.X'; it has depth.Z, id.part"):
        small.truth.layer("normal.X", 0)[0]


def test_the_truth_exists_only_where_the_set_has_it(tmp_path):
    public = skiagraph.render("walk", tmp_path / "public", SMALL, truth=tmp_path / "secret")
    assert not hasattr(skiagraph.Set(tmp_path / "public"), "truth")
    with pytest.raises(skiagraph.NoTruthError, match="truth_at="):
        skiagraph.Set(tmp_path / "public").truth  # noqa: B018
    assert public.truth.markers.shape == (public.frames, 15, 3)
    run = skiagraph.track(public, lambda frame: frame.info.start.markers)
    assert run.evaluate().metrics["humaneva_mm"] > 0


def test_cameras_that_move_and_lack_images(shipped, tmp_path):
    filmed = skiagraph.render(shipped / "smoke" / "filming.toml", tmp_path / "filmed", key="default")
    missing = [frame for frame in range(filmed.frames) if filmed.masks("cam02")[frame] is None]
    assert missing == np.flatnonzero(np.isnan(filmed.times[:, 2])).tolist() != []
    with pytest.raises(skiagraph.InputError, match=f"no image of frame {missing[0]}"):
        filmed.masks("cam02")[:]
    assert not np.array_equal(filmed.cameras_at(30)[0].t, filmed.cameras[0].t)
    for frame in (filmed.frames, 1.5, True):
        with pytest.raises(IndexError, match=f"frame {frame}: expected an integer from 0 to"):
            filmed.cameras_at(frame)
    with pytest.raises(skiagraph.InputError, match="no camera True"):
        filmed.masks(True)
    told = []

    def watch(frame):
        told.append([(view.camera.R, view.camera.t, view.exposed, view.mask is None) for view in frame.views])
        return frame.info.start.markers

    skiagraph.track(filmed, watch)
    for frame, views in enumerate(told):
        for index, (camera, (R, t, exposed, lacks)) in enumerate(zip(filmed.cameras_at(frame), views, strict=True)):
            assert np.allclose(camera.R, R, atol=1e-12)
            assert np.allclose(camera.t, t, atol=1e-12)
            assert lacks == np.isnan(filmed.times[frame, index])
            assert exposed is None or abs(exposed - filmed.times[frame, index]) < 1e-12


def test_keypoints_are_read_where_the_set_has_them(small, tmp_path):
    assert small.keypoints is None
    assert small.truth.keypoints is None
    assert small.truth.contact.gap.shape[0] == small.frames
    shutil.copytree(small.path, tmp_path / "set")
    points = np.zeros((small.frames, 4, 2, 2))
    np.savez(
        tmp_path / "set/observations/keypoints.npz",
        keypoint_names=np.array(["nose", "left_knee"]),
        keypoints=points,
        confidence=np.ones(points.shape[:3]),
        cameras=np.array([camera.name for camera in small.cameras]),
    )
    keypoints = skiagraph.Set(tmp_path / "set").keypoints
    assert keypoints.names == ("nose", "left_knee")
    assert keypoints.points.shape == points.shape
    assert keypoints.confidence.shape == points.shape[:3]
    assert keypoints.cameras == ("cam00", "cam01", "cam02", "cam03")


def test_keypoints_are_those_of_the_images_whose_times_may_be_hidden(tmp_path):
    settings = {**SMALL, "observation.silhouette": "corrupted", "keypoints.layout": "coco17"}
    late = skiagraph.render("walk", tmp_path / "late", settings, desynchronisation_ms=20.0, key="default")
    exact, camera = late.truth.keypoints, late.cameras[0]
    assert late.keypoints.points.dtype == late.keypoints.confidence.dtype == np.float64
    assert np.allclose(late.truth.joints_2d[:, 0], camera.project(late.truth.joints), equal_nan=True)
    off = np.abs(exact.keypoints_2d[:, 0] - camera.project(exact.keypoints_3d)).max()
    assert 0.05 < off < 20
    assert np.array_equal(late.times[:, 0], np.arange(late.frames) / late.fps)


def test_the_start_is_that_of_the_files(small):
    record = json.loads((small.path / "start/start.json").read_text())
    assert list(small.start.angle_names) == record["angle_names"]
    assert small.start.angles.tolist() == record["angles"]
    assert small.start.root.shape == (7,)
    assert len(small.joint_names) == len(small.body["joints"])


def test_wrong_sets_cameras_and_files_are_named(small, tmp_path):
    with pytest.raises(skiagraph.InputError, match=r"nowhere: expected the folder of a benchmark set"):
        skiagraph.Set("nowhere")
    with pytest.raises(skiagraph.InputError, match="no camera 'cam9'; its cameras are cam00, cam01"):
        small.masks("cam9")
    with pytest.raises(IndexError, match=r"index 19 is out of bounds .* size 19"):
        small.masks(0)[19]
    with pytest.raises(IndexError, match="only integers, slices"):
        small.masks(0)["first"]
    with pytest.raises(AttributeError, match="no array 'marker'; there are"):
        small.truth.marker  # noqa: B018
    (tmp_path / "set.toml").write_text("name = 3")
    with pytest.raises(skiagraph.InputError, match=r"set.toml: expected name, schema, frames"):
        skiagraph.Set(tmp_path)


def test_a_damaged_archive_is_refused_with_its_name(small, tmp_path):
    data = (small.path / "truth/truth.npz").read_bytes()
    for spoiled in (b"", data[:100], data[:-100], data[: len(data) // 2] + bytes(64) + data[len(data) // 2 + 64 :]):
        (tmp_path / "truth.npz").write_bytes(spoiled)
        with pytest.raises(skiagraph.InputError, match=r"truth\.npz: expected arrays that skiagraph wrote"):
            dict(skiagraph.Arrays(tmp_path / "truth.npz"))


def test_damaged_images_are_refused_with_their_name(small):
    good = (small.path / "observations/cam00/silhouette/000000.png").read_bytes()
    layers = (small.path / "truth/layers/cam00/000003.exr").read_bytes()
    random = np.random.default_rng(3)
    channel = functools.partial(_channel, name="depth.Z", empty=0.0, size=(120, 160))
    for read, data in ((silhouette, good), (channel, layers)):
        for _ in range(300):
            spoiled = bytearray(data)
            for at in random.integers(0, len(data), 3):
                spoiled[at] = random.integers(256)
            try:
                read(bytes(spoiled[: random.integers(len(data) // 2, len(data) + 1)]), "my.png")
            except skiagraph.InputError as error:
                assert str(error).startswith("my.png: expected")  # noqa: PT017


def png(width, height, rows, more=b""):
    """A grey PNG of 8 bits whose rows begin with their filters."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(rows) + more)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def test_rows_with_and_without_differences():
    assert picture(png(2, 2, [0, 1, 2, 2, 3, 4]), "x").tolist() == [[1, 2], [4, 6]]
    assert picture(png(2, 2, [2, 1, 2, 2, 255, 4]), "x").tolist() == [[1, 2], [0, 6]]
    assert picture(png(2, 2, [0, 1, 2, 0, 3, 4]), "x").tolist() == [[1, 2], [3, 4]]
    assert silhouette(png(2, 2, [0, 255, 0, 2, 1, 0]), "x").tolist() == [[True, False], [False, False]]
    assert silhouette(png(2, 2, bytes(6)), "x").tolist() == [[False, False], [False, False]]
    with pytest.raises(skiagraph.InputError, match=r"x: expected an image of a set, but its rows are filtered"):
        picture(png(2, 2, [0, 1, 2, 1, 3, 4]), "x")


def test_a_png_cannot_unpack_to_more_than_it_says():
    assert picture(png(2, 2, [0, 1, 2, 2, 3, 4], bytes(10_000_000)), "x").tolist() == [[1, 2], [4, 6]]


def test_every_changed_byte_of_the_packed_pixels_is_noticed(small):
    data = (small.path / "observations/cam00/silhouette/000000.png").read_bytes()
    first = data.index(b"IDAT") + 4
    for at in range(first, first + struct.unpack_from(">I", data, first - 8)[0]):
        with pytest.raises(skiagraph.InputError, match="its bytes are not those that were written"):
            silhouette(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :], "x")


@pytest.mark.parametrize("images_at_a_time", [1, 5, 100])
def test_a_loop_over_images_may_be_left_and_nested(small, monkeypatch, images_at_a_time):
    masks = small.masks("cam00")
    monkeypatch.setattr("skiagraph.benchmark_set._BATCH_BYTES", images_at_a_time * masks[0].nbytes)
    assert np.array_equal(masks[:], np.stack([masks[frame] for frame in range(len(masks))]))
    pairs = [(np.count_nonzero(a), np.count_nonzero(b)) for a in masks for b in itertools.islice(masks, 2)]
    assert len(pairs) == 2 * small.frames
    assert [first for first, _ in pairs[::2]] == [np.count_nonzero(masks[frame]) for frame in range(len(masks))]
    assert threading.active_count() == 1


def test_the_program_agrees_on_the_names(small):
    said = subprocess.run(
        [skiagraph.program(), "inspect", small.path, "--json"], capture_output=True, text=True, check=True
    ).stdout
    found = json.loads(said)
    assert (small.name, small.frames, small.fps) == (found["name"], found["frames"], found["frames_per_second"])
    assert [camera.name for camera in small.cameras] == [camera["name"] for camera in found["cameras"]]


def test_an_empty_range_of_images_is_an_empty_stack(small):
    for images in (small.masks("cam00"), small.truth.depth("cam00")):
        assert images[5:5].shape == (0, 120, 160)
        assert images[5:5].dtype == images[:1].dtype


@pytest.mark.parametrize("kind", ["png", "jpeg"])
def test_images_of_the_scene_are_those_of_opencv_and_show_the_body(tmp_path, kind):
    cv2 = pytest.importorskip("cv2")
    settings = {"observation.colour_images": kind, "observation.images.background_frames": 2}
    two = skiagraph.render("walk", tmp_path / "set", {**SMALL, **settings})
    images, backgrounds = two.colour("cam01"), two.background(1)
    assert (len(images), len(backgrounds)) == (two.frames, 6)
    path = next(two.path.glob("observations/colour/cam01/000003.*"))
    assert np.array_equal(images[3], cv2.imread(str(path))[..., ::-1])
    difference = np.abs(images[3].astype(int) - np.median(backgrounds[:], axis=0)).max(axis=2)
    mask = two.masks("cam01")[3]
    assert np.median(difference[mask]) > 3 * np.median(difference[~mask])
    seen = []

    def watch(frame):
        seen.append((frame.views[1].image, len(frame.info.backgrounds["cam01"])))
        return frame.info.start.markers

    skiagraph.track(two, watch)
    assert np.array_equal(seen[3][0], images[3])
    assert seen[3][1] == 6


def test_a_set_without_images_says_how_to_get_them(small):
    with pytest.raises(skiagraph.InputError, match=r"observation__colour_images='png'"):
        small.colour("cam01")


def test_arrays_that_everybody_reads_cannot_be_changed_in_place(small):
    with pytest.raises(ValueError, match="read-only"):
        small.truth.markers[:] = 0
    changed = small.truth.markers.copy()
    changed[:] = 0
    assert small.truth.markers.any()


def test_a_camera_of_the_set_names_its_images(small):
    for index, camera in enumerate(small.cameras):
        assert np.array_equal(small.masks(camera)[3], small.masks(index)[3])
        assert np.array_equal(small.truth.depth(camera)[3], small.truth.depth(index)[3])


def area(of, frame):
    return int(of.masks(0)[frame].sum())


def test_sets_and_their_images_are_pickled_for_other_processes(small):
    of_layers = pickle.loads(pickle.dumps(small.truth.depth("cam00")))
    assert np.array_equal(of_layers[2], small.truth.depth("cam00")[2])
    temporary = skiagraph.render("walk", loop_to_s=0.1, size_px=[32, 24])
    for of in (small, temporary):
        here = [area(of, frame) for frame in range(3)]
        # a new process knows nothing of this one's objects
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            assert pool.starmap(area, [(of, frame) for frame in range(3)]) == here
    assert area(temporary, 0) > 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_does_not_remove_the_temporary_sets_of_its_parent(tmp_path):
    code = """
    import os, sys, skiagraph
    walk = skiagraph.render("walk", loop_to_s=0.1, size_px=[32, 24])
    if (child := os.fork()) == 0:
        sys.exit(0)
    os.waitpid(child, 0)
    print(walk.masks(0)[0].any())
    """
    said = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=True)
    assert said.stdout == "True\n"


@pytest.mark.parametrize(
    ("name", "data", "read"),
    [
        ("cameras.json", b"{}", lambda of: of.cameras),
        ("cameras.json", b"[]", lambda of: of.masks(0)),
        ("cameras.json", b"no JSON", repr),
        ("cameras.json", b"\xff\xfe", lambda of: of.times),
        ("cameras.json", b'{"cameras": [{}]}', lambda of: of.camera("cam00")),
        ("cameras.json", b'{"cameras": 3}', lambda of: of.cameras_at(0)),
        ("start/start.json", b"{}", lambda of: of.start),
        ("start/body.json", b"null", lambda of: of.body),
        ("truth/cameras.json", b"{}", lambda of: of.truth.cameras),
    ],
)
def test_a_damaged_description_is_an_input_error_with_its_name(small, tmp_path, name, data, read):
    shutil.copytree(small.path, tmp_path / "set")
    (tmp_path / "set" / name).write_bytes(data)
    with pytest.raises(skiagraph.InputError, match=rf"{name}: expected JSON as skiagraph writes it, but "):
        read(skiagraph.Set(tmp_path / "set"))


#: What a damaged file may hold in place of any value.
WRONG = [None, "x", 10**400, 1e308, -1, [], {}, [[1.0, 2.0]], "../../x", "{0}"]


def spoiled(value):
    """A JSON tree with one part removed or replaced, for every part and every wrong value."""
    if isinstance(value, (dict, list)):
        for key in list(value if isinstance(value, dict) else range(len(value)))[:14]:
            kept = value[key]
            for part in itertools.chain(WRONG, spoiled(kept)):
                value[key] = part
                yield value
            value[key] = kept
            if isinstance(value, dict):
                del value[key]
                yield value
                value[key] = kept


def refusal(read, path):
    """What reading a damaged file is refused with, if it is."""
    try:
        read(path)
    except skiagraph.InputError as error:
        return str(error)
    return None


def read_set(path):
    """Reads what the description of a set decides."""
    of = skiagraph.Set(path)
    assert of.cameras[0].t.shape == (3,)
    of.cameras_at(0), of.times, of.masks(0)[0], of.masks(0)[:], of.start, of.joint_names, of.truth.depth(0)[0]


@pytest.mark.parametrize("name", ["cameras.json", "start/start.json"])
def test_spoiled_descriptions_never_raise_raw_errors(small, tmp_path, name):
    """KeyError, TypeError, ValueError and OverflowError of damaged files reached the user."""
    shutil.copytree(small.path, tmp_path / "set")
    tree = json.loads((small.path / name).read_text())
    if "cameras" in tree:
        tree["cameras"] = tree["cameras"][:1]
    said = []
    for spoilt in spoiled(tree):
        (tmp_path / "set" / name).write_text(json.dumps(spoilt))
        said.append(refusal(read_set, tmp_path / "set"))
    said = [text for text in said if text]
    # a file can be refused for what it says of others
    known = (name, "silhouette", "no camera")
    assert [text for text in said if not any(part in text for part in known)] == []
    assert len(said) > 100


def test_spoiled_results_never_raise_raw_errors(small, tmp_path):
    run = small.evaluate(small.truth.markers, out=tmp_path / "run").path
    tree = json.loads((run / "run.json").read_text())
    tree = {key: tree[key] for key in ("seeds", "frames", "report", "per_frame", "verdict", "absent", "metrics")}
    tree["metrics"] = dict(list(tree["metrics"].items())[:1])
    said = []
    for spoilt in spoiled(tree):
        (run / "run.json").write_text(json.dumps(spoilt))
        said.append(refusal(lambda path: skiagraph.Result(path).per_frame, run))
    said = [text for text in said if text]
    assert [text for text in said if str(run) not in text] == []
    assert len(said) > 20


@pytest.mark.parametrize(
    "text", ["frames = 1e9", "frames = 1000000000000", "frames = -1", "frames_per_second = nan", "name = 3"]
)
def test_counts_of_a_set_are_checked_before_arrays_are_made(small, tmp_path, text):
    key = text.partition(" = ")[0]
    made = re.sub(rf"(?m)^{key} = .*$", text, (small.path / "set.toml").read_text())
    (tmp_path / "set.toml").write_text(made)
    with pytest.raises(skiagraph.InputError, match=r"set\.toml: expected name, schema, frames"):
        skiagraph.Set(tmp_path)


@pytest.mark.parametrize("shape", [(10**11, 15, 3), (10**30,), (-1, -3), (2, 2)])
def test_an_array_that_claims_more_than_it_holds_is_not_made(small, tmp_path, shape):
    shutil.copytree(small.path, tmp_path / "set")
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(tmp_path / "set/truth/truth.npz", "w") as file:
        file.writestr("markers.npy", header.getvalue() + bytes(80))
    truth = skiagraph.Set(tmp_path / "set").truth
    with pytest.raises(skiagraph.InputError, match=r"truth\.npz: expected arrays .*, but markers\.npy claims"):
        truth.markers.sum()
    with pytest.raises(skiagraph.InputError, match=r"truth\.npz.*: no array 'joints'; did you mean joints_2d"):
        truth["joints"]


@pytest.mark.parametrize(
    "window", [(0, 0, 2**31 - 2, 2**31 - 2), (-(2**31), -(2**31), 2**31 - 1, 2**31 - 1), (0, 0, 499, 499), (9, 9, 5, 5)]
)
def test_a_display_window_does_not_decide_an_allocation(small, tmp_path, window):
    """One of 2^31 pixels asked for 480 GiB."""
    shutil.copytree(small.path, tmp_path / "set")
    image = tmp_path / "set/truth/layers/cam00/000000.exr"
    data, key = image.read_bytes(), b"displayWindow\0box2i\0\x10\0\0\0"
    at = data.index(key) + len(key)
    image.write_bytes(data[:at] + struct.pack("<4i", *window) + data[at + 16 :])
    with pytest.raises(skiagraph.InputError, match=r"000000\.exr: .*display window"):
        skiagraph.Set(tmp_path / "set").truth.depth("cam00")[0]


def test_images_of_several_sizes_are_no_stack(small, tmp_path):
    shutil.copytree(small.path, tmp_path / "set")
    other = skiagraph.render("walk", tmp_path / "other", {"loop_to_s": 0.1, "rig.ring.size_px": [80, 60]})
    name = "observations/cam00/silhouette/000001.png"
    shutil.copy(other.path / name, tmp_path / "set" / name)
    with pytest.raises(skiagraph.InputError, match=r"000001\.png: its pixels are not \(120, 160\)"):
        skiagraph.Set(tmp_path / "set").masks("cam00")[:]


def test_a_file_a_run_and_nothing_are_no_sets(small, tmp_path):
    with pytest.raises(skiagraph.InputError, match=r"set\.toml: expected the folder of a .* set, but it is a file"):
        skiagraph.Set(small.path / "set.toml")
    run = skiagraph.track(small, "frozen", out=tmp_path / "run")
    with pytest.raises(skiagraph.InputError, match=r"it is the folder of a run, which skiagraph\.Run opens"):
        skiagraph.Set(run)
    with pytest.raises(skiagraph.InputError, match="there is no such folder"):
        skiagraph.Set(tmp_path / "nowhere")
    (tmp_path / "set.toml").write_bytes(b"\xff")
    with pytest.raises(skiagraph.InputError, match=r"its set\.toml cannot be read"):
        skiagraph.Set(tmp_path)


def test_points_that_are_no_numbers_are_not_projected(small):
    for points, found in (("abc", "str 'abc'"), ([["a", 1, 2]], "list"), (None, "NoneType")):
        with pytest.raises(skiagraph.InputError, match=rf"points of shape \(\.\.\., 3\) in metres, found {found}"):
            small.cameras[0].project(points)


SETTINGS = {"loop_to_s": 0.1, "rig.ring.size_px": [32, 24], "rig.ring.count": 1}


@pytest.mark.parametrize(
    "changed",
    [
        {"rig.ring.count": np.int64(2), "loop_to_s": np.float32(0.125), "calibrate": np.False_},
        {"rig": {"ring": {"count": np.uint8(2)}}},
        {"rig.ring.size_px": np.array([40, 30]), "truth_images": np.array(["depth"])},
        {"rig.ring.size_px": (np.int16(40), np.int16(30)), "loop_to_s": np.array(0.1)},
        {"rig.ring.size_px": range(32, 34)},
    ],
)
def test_settings_may_be_numbers_and_arrays_of_numpy(changed):
    plain = json.loads(json.dumps(changed, default=lambda value: np.asarray(value).tolist()))
    ours, theirs = (skiagraph.render("walk", None, {**SETTINGS, **each}, key="default") for each in (changed, plain))
    assert (ours.path / "set.toml").read_bytes() == (theirs.path / "set.toml").read_bytes()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"loop_to_s": None}, "loop_to_s: expected a number, .*found NoneType None; leave it out"),
        ({"truth_images": {"depth"}}, r"truth_images: expected a number, .*found set \{'depth'\}"),
        ({"loop_to_s": 1j}, "loop_to_s: expected a number, .*found complex 1j"),
        ({"loop_to_s": np.nan}, "expected a finite number"),
        ({"name": "\ud800"}, "characters that cannot be given to a program"),
        ({1: 2}, "key of a setting as text, found int 1"),
        (3, "settings as a dictionary, .* found int 3"),
        ("count=2", "settings as a dictionary, .* found str 'count=2'"),
        ([("count", 2)], "settings as a dictionary, .* found list"),
    ],
)
def test_settings_of_unusable_types_say_what_came(settings, message):
    with pytest.raises(skiagraph.InputError, match=message):
        skiagraph.render("walk", None, settings)


def test_a_key_in_both_spellings_is_one_setting():
    of = skiagraph.render("walk", None, {**SETTINGS, "rig.ring.count": 3}, rig__ring__count=2)
    assert len(of.cameras) == 2


def test_a_set_that_was_rendered_again_is_opened_anew(tmp_path):
    walk = skiagraph.render("walk", tmp_path / "set", SMALL)
    points = walk.truth.markers
    skiagraph.render("run", tmp_path / "set", SMALL, force=True)
    for use in (lambda: walk.masks(0), lambda: walk.evaluate(points), lambda: walk[0].mask_array):
        with pytest.raises(skiagraph.InputError, match="was rendered again since this set was opened"):
            use()
