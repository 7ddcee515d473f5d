"""Loops of users over sets: frames, estimates by frame, and sessions."""

import functools
import pickle
import subprocess
import sys
import textwrap
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import skiagraph

ROOT = Path(__file__).parents[2]


def test_a_set_is_a_sequence_of_what_trackers_see(small):
    seen = []
    skiagraph.track(small, lambda frame: seen.append((frame, frame.masks)) or frame.info.start.markers)
    assert len(small) == len(seen) == len(list(small))
    for ours, (frame, masks) in zip(small, seen, strict=True):
        assert (ours.index, ours.time) == (frame.index, frame.time)
        assert np.array_equal(ours.mask_array, masks)
        for view, other in zip(ours.views, frame.views, strict=True):
            assert view.camera.name == other.camera.name
            assert np.array_equal(view.camera.P, other.camera.P)
            assert view.exposed == other.exposed
            assert np.array_equal(view.mask, other.mask)
    assert [frame.index for frame in small[2:5]] == [2, 3, 4]
    assert small[-1].index == small[np.int64(len(small) - 1)].index == len(small) - 1
    with pytest.raises(IndexError):
        small[len(small)]
    assert pickle.loads(pickle.dumps(small[3])).mask_array.any()


def test_a_set_without_truth_tells_names_and_start_as_trackers_are_told(small, tmp_path):
    walk = skiagraph.render("walk", tmp_path / "blind", loop_to_s=0.2, size_px=[96, 72], truth=tmp_path / "secret")
    blind = skiagraph.Set(tmp_path / "blind")
    told = []
    skiagraph.track(blind, lambda frame: told.append(frame.info) or frame.info.start.markers)
    for kind in ("markers", "joints", "angles"):
        assert getattr(blind.info, kind) == getattr(told[0], kind)
    assert list(blind.marker_names) == walk.truth.marker_names.tolist()
    assert np.allclose(blind.start.angles, told[0].start.angles, atol=1e-15)
    for kind in ("markers", "joints"):
        ours, theirs = getattr(blind.start, kind), getattr(told[0].start, kind)
        assert ours.keys() == theirs.keys()
        assert all(np.allclose(ours[name], theirs[name], atol=1e-12, equal_nan=True) for name in ours)
    with pytest.raises(ValueError, match="read-only"):
        blind.start.root[0] = 1


def test_frames_of_cameras_that_move_are_those_of_a_tracker(shipped, tmp_path):
    walk = skiagraph.render(shipped / "smoke" / "filming.toml", tmp_path / "set", {"motion.last_frame": 8})
    frames = []
    skiagraph.track(walk, lambda frame: frames.append((frame, frame.masks)) or frame.info.start.markers)
    for ours, (frame, masks) in zip(walk, frames, strict=True):
        for view, other, mask in zip(ours.views, frame.views, masks, strict=True):
            assert (view.mask is None) == (mask is None)
            assert view.exposed == pytest.approx(other.exposed) if other.exposed is not None else view.exposed is None
            assert np.allclose(view.camera.P, other.camera.P)


def as_tracker(frame):
    """The start pose, later and later."""
    points = np.array(list(frame.info.start.markers.values()))
    return points + [0.01 * frame.index, 0, 0]


def test_an_estimate_by_frame_is_measured_as_that_of_a_tracker(small):
    expected = skiagraph.track(small, as_tracker).evaluate().metrics
    by_frame = {}
    for frame in small:
        by_frame[frame.index] = as_tracker(frame)
    named = [dict(zip(frame.info.markers, as_tracker(frame), strict=True)) for frame in small]
    for estimate in (by_frame, named, np.array(list(by_frame.values()))):
        assert small.evaluate(estimate).metrics["humaneva_mm"] == pytest.approx(expected["humaneva_mm"])
    # as the protocol says it, which a tracker may answer too
    protocol = [{"markers": answer, "confidence": 0.5} for answer in by_frame.values()]
    assert small.evaluate(protocol).metrics["humaneva_mm"] == pytest.approx(expected["humaneva_mm"])
    start = {"root": small.start.root, "angles": small.start.angles, "confidence": 0.5}
    still = small.evaluate([start] * len(small))
    assert still.metrics["mpjae_deg"] == pytest.approx(skiagraph.track(small, "frozen").evaluate().metrics["mpjae_deg"])


def test_frames_that_are_left_out_are_lost(small):
    estimate = {frame.index: frame.info.start.markers for frame in small if frame.index != 5}
    estimate[7] = None
    result = small.evaluate(estimate)
    # frame 0 is not measured
    assert result.metrics["lost_frames"] == pytest.approx(2 / (len(small) - 1))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({99: None}, "indices of frames, .*, integers 0 to 18, found the key 99"),
        ({"pelvis": None}, "indices of frames, .*, integers 0 to 18, found the key 'pelvis'"),
        ({"3": None}, "indices of frames, .*, integers 0 to 18, found the key '3'"),
        ({3: np.zeros((14, 3))}, r"the answer to frame 3: .* found float64 of shape \(14, 3\)"),
        ({3: {"nose": [0, 0, 0]}}, "the answer to frame 3: expected names of markers"),
        ({3: np.full((15, 3), np.inf)}, "the answer to frame 3: markers thorax is"),
    ],
)
def test_answers_by_frame_are_refused_as_those_of_trackers(small, change, message):
    estimate = {frame.index: frame.info.start.markers for frame in small}
    with pytest.raises(skiagraph.InputError, match=message):
        small.evaluate({**estimate, **change})
    with pytest.raises(skiagraph.InputError, match="expected answers to 19 frames, found 2"):
        small.evaluate([None, small.start.markers])


def test_a_session_records_the_run_of_a_tracker(small, tmp_path):
    session = small.tracking(seed=3, out=tmp_path / "run", name="mine")
    while session.frame is not None:
        session.step(as_tracker(session.frame))
    expected = skiagraph.track(small, as_tracker, seed=3)
    assert (session.run.path / "poses.npz").read_bytes() == (expected.path / "poses.npz").read_bytes()
    assert session.run.program["name"] == "mine"
    assert session.run.path == tmp_path / "run"
    with pytest.raises(skiagraph.InputError, match="all 19 frames are answered or lost"):
        session.step(None)


def test_a_session_that_is_left_leaves_nothing(small, tmp_path):
    with small.tracking(out=tmp_path / "run") as session:
        session.step(None)
        with pytest.raises(skiagraph.InputError, match="another skiagraph process is writing here"):
            small.tracking(out=tmp_path / "run")
    with pytest.raises(skiagraph.InputError, match=r"the session is over: expected session\.step"):
        session.run  # noqa: B018
    with pytest.raises(skiagraph.InputError, match="the session is over"):
        session.step(None)
    assert not (tmp_path / "run").exists()
    session = small.tracking(out=tmp_path / "run")
    del session
    until = time.monotonic() + 10
    while (left := [path.name for path in tmp_path.iterdir()]) and time.monotonic() < until:
        time.sleep(0.05)
    assert left == []


def test_a_wrong_answer_leaves_the_session_at_its_frame(small):
    session = small.tracking()
    first = session.frame
    session.step(small.start.markers, first)
    with pytest.raises(skiagraph.TrackerError, match=r"the answer to frame 1 of seed 0: .* shape \(3, 3\)"):
        session.step(np.zeros((3, 3)))
    with pytest.raises(skiagraph.TrackerError, match=r"frame 1 of seed 0: expected markers, .* found joints"):
        session.step(small.start.joints)
    # two threads that answered out of step were recorded at each other's frames
    with pytest.raises(skiagraph.InputError, match="expected the answer to frame 1, found that to frame 0"):
        session.step(small.start.markers, first)
    while session.frame is not None:
        session.step(small.start.markers, session.frame)
    assert session.run.program["answers"]["poses"] == len(small)


def test_a_loop_that_answers_a_frame_twice_or_not_at_all_is_told(small):
    for times in (0, 2):
        session = small.tracking()

        def loop(session=session, times=times):
            for _ in session:
                for _ in range(times):
                    session.step(None)

        with pytest.raises(skiagraph.InputError, match=rf"one session.step\(...\) for frame 0, found {times}"):
            loop()


def test_a_tracker_in_millimetres_is_refused_at_its_first_frame(small):
    asked = []

    def millimetres(frame):
        asked.append(frame.index)
        return 1000 * np.array(list(frame.info.start.markers.values()))

    expected = "the answer to frame 0 of seed 0: its body has 1000 times .* in millimetres; divide it by 1000"
    with pytest.raises(skiagraph.TrackerError, match=expected):
        skiagraph.track(small, millimetres)
    assert asked == [0]
    joints = {name: 100 * place for name, place in small.start.joints.items()}
    with pytest.raises(skiagraph.TrackerError, match="in centimetres"):
        skiagraph.track(small, lambda frame: joints)
    # the commonest tracker answers frame 0 with the start pose as it was given
    with pytest.raises(skiagraph.TrackerError, match=r"the answer to frame 1 of seed 0: .* in millimetres"):
        skiagraph.track(small, lambda frame: millimetres(frame) if frame.index else frame.info.start.markers)


def test_a_hint_is_a_warning_once_with_its_remedy(small):
    points = small.truth.markers[..., [0, 2, 1]]
    with pytest.warns(skiagraph.MisreadWarning, match=r"Use axes='x,z,y'; .*\*\*result.corrections") as found:
        result = small.evaluate(points)
    assert len(found) == 1
    assert found[0].filename == __file__
    assert "--axes" not in str(result)
    moved = small.truth.markers - [1, 0, 0]
    with pytest.warns(skiagraph.MisreadWarning, match=r"offset=\(1,0,0\)"):
        result = small.evaluate(moved)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert small.evaluate(moved, **result.corrections).metrics["humaneva_mm"] < 1e-6


DIES = """
    import os, sys, skiagraph
    def dies(frame):
        if frame.index == int(sys.argv[2]) and frame.info.seed == 1:
            {end}
        return frame.info.start.markers
    skiagraph.track({set!r}, dies, out=sys.argv[1], seeds=2)
"""


@pytest.mark.parametrize("end", ["os._exit(0)", "os.kill(os.getpid(), 9)"])
@pytest.mark.parametrize("frame", [3, 18])
def test_a_process_that_dies_while_tracking_leaves_no_run(small, tmp_path, end, frame):
    code = textwrap.dedent(DIES.format(end=end, set=str(small.path)))
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "run"), str(frame)], timeout=60)
    until = time.monotonic() + 20
    while (left := [path.name for path in tmp_path.iterdir()]) and time.monotonic() < until:
        time.sleep(0.05)
    assert left == []
    assert skiagraph.track(small, as_tracker, out=tmp_path / "run").program["answers"]["poses"] == small.frames


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells a process that its parent has ended")
def test_a_program_ends_with_the_process_that_called_it(small, tmp_path):
    code = f"""
        import skiagraph
        settings = {{"particles": 400, "layers": 10}}
        skiagraph.track({str(small.path)!r}, "annealed_particle_filter", settings=settings, seeds=99, out="run")
    """
    caller = subprocess.Popen([sys.executable, "-c", textwrap.dedent(code)], cwd=tmp_path)
    until = time.monotonic() + 60
    while not list(tmp_path.iterdir()) and time.monotonic() < until:
        time.sleep(0.05)
    assert list(tmp_path.iterdir())
    caller.kill()
    caller.wait()

    def writers():
        found = (path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if path.exists())
        return [words for words in found if str(tmp_path).encode() in words]

    while writers() and time.monotonic() < until:
        time.sleep(0.1)
    assert writers() == []


def still(frame):
    return frame.info.start.markers


def test_sessions_refuse_unknown_options(small):
    with pytest.raises(TypeError, match="unexpected keyword argument 'seeds'"):
        small.tracking(seeds=2)


# a scene's own keys met the user's, by their full names, which the user had not given
def test_keys_and_axes_replace_those_of_a_scene(tmp_path):
    short = {"loop_to_s": 0.7, "size_px": [64, 48], "layers": 1, "particles": 5}
    assert skiagraph.render("run", clip="embedded:jump", settings=short).frames > 1
    sweep = skiagraph.sweep("segmented", {"observation.silhouette": ["exact", "segmented"]}, settings=short, seeds=1)
    assert len(sweep) == 2


def test_lambdas_and_partial_functions_have_names(small):
    run = skiagraph.track(small, lambda frame: frame.info.start.markers)
    assert run.program["name"].startswith("lambda_")
    assert run.path.name.startswith("lambda_")
    cached = functools.cache(lambda frame: frame.info.start.markers)
    for tracker, name in [(functools.partial(still), "still"), (cached, "lambda_")]:
        assert skiagraph.track(small, tracker).program["name"].startswith(name)
    assert skiagraph.track(small, lambda frame: frame.info.start.markers, name="still").program["name"] == "still"


@pytest.mark.parametrize("layout", ["coco17", "halpe26", "body25", "h36m17", "smpl24"])
def test_joints_of_data_sets_are_at_the_markers(small, layout):
    joints = small.truth.joints_as(layout)
    assert len(joints) == int(layout[-2:])
    names = small.truth.marker_names.tolist()
    for side in ("left", "right"):
        for part in ("hip", "knee", "shoulder", "elbow", "wrist"):
            marker = small.truth.markers[:, names.index(f"{side}_{part}")]
            assert np.allclose(joints[f"{side}_{part}"], marker, atol=1e-9)
    points = np.stack(list(joints.values()), axis=1)
    # as evaluate reads the same names
    assert small.evaluate(points, names=list(joints)).metrics["humaneva_mm"] < 1e-6
    with pytest.raises(skiagraph.InputError, match="body25, coco17, h36m17, halpe26, smpl24, found 'coco'"):
        small.truth.joints_as("coco")


def test_keypoints_of_the_truth_are_the_same_by_name(tmp_path):
    walk = skiagraph.render("walk", tmp_path / "set", {"keypoints.layout": "halpe26"}, loop_to_s=0.2, size_px=[96, 72])
    joints = walk.truth.joints_as("halpe26")
    assert list(joints) == walk.truth.keypoints["keypoint_names"].tolist()
    exact = walk.truth.keypoints["keypoints_3d"]
    assert np.allclose(np.stack(list(joints.values()), axis=1), exact, atol=1e-6)
    assert np.array_equal(walk[3].views[1].keypoints[:, :2], walk.keypoints.points[3, 1], equal_nan=True)


def test_scenes_are_rendered_by_name(tmp_path):
    run = skiagraph.render("run", loop_to_s=0.2, size_px=[96, 72])
    assert run.name == "run"
    assert "embedded:run" in (run.path / "truth/facts.toml").read_text()
    assert skiagraph.render("jump", name="mine", loop_to_s=0.7, size_px=[96, 72]).name == "mine"
    with pytest.raises(skiagraph.InputError, match="no file 'rum', and no scene: those are walk, run, jump, segmented"):
        skiagraph.render("rum")


def test_a_set_is_exported(small, tmp_path):
    assert (small.export("tum", tmp_path / "tum") / "root.txt").is_file()
    with pytest.raises(skiagraph.InputError, match="coco"):
        small.export("cocoa", tmp_path / "cocoa")


def test_results_are_tables_of_pandas(small):
    pandas = pytest.importorskip("pandas")
    shift = np.linspace(0, 0.01, 3)[:, None, None, None]
    result = small.evaluate(small.truth.markers[None] + shift)
    frames = result.to_frame("per_frame")
    assert frames.index.names == ["seed", "frame"]
    assert len(frames) == 3 * len(small)
    assert frames["mpjpe_mm"].loc[2, 5] == pytest.approx(1000 * 0.01 * 3**0.5)
    joints = result.to_frame("per_joint")
    assert isinstance(joints, pandas.DataFrame)
    assert joints.loc["pelvis", "mean_mm"] == pytest.approx(result.per_joint["pelvis"].mean())
    assert result.per_joint["left_knee"].shape == (3,)
    with pytest.raises(skiagraph.InputError, match="metrics, per_joint or per_frame"):
        result.to_frame("joints")


def test_an_unknown_metric_is_answered_with_similar_ones(small):
    metrics = small.evaluate(small.truth.markers).metrics
    with pytest.raises(KeyError, match="no metric 'mpjpe'; did you mean mpjpe_mm or mpjpe_root_mm"):
        metrics["mpjpe"]
    with pytest.raises(KeyError, match="energy_gap could not be computed: it needs a tracker"):
        metrics["energy_gap"]
    assert metrics.get("mpjpe") is None


def test_a_run_that_is_opened_again_is_measured_and_printed_as_before(small, tmp_path):
    skiagraph.track(small, as_tracker, out=tmp_path / "run")
    again = skiagraph.Run(tmp_path / "run")
    with pytest.raises(skiagraph.InputError, match=r"skiagraph.Run\('.*run', set\) opens it with a set"):
        again.evaluate()
    with pytest.raises(skiagraph.InputError, match=r"run is not measured; skiagraph.Run\("):
        skiagraph.compare(tmp_path / "run", tmp_path / "run")
    first = skiagraph.Run(tmp_path / "run", small.path).evaluate()
    assert str(skiagraph.Run(tmp_path / "run").evaluate()) == str(first)


def test_a_better_run_is_better_by_a_positive_number(small):
    noise = np.random.default_rng(1).normal(0, 0.001, (5, 1, 1, 3))
    near, far = (small.evaluate(small.truth.markers[None] + [0, 0, by] + noise) for by in (0.01, 0.09))
    assert "better by 80" in str(skiagraph.compare(far, near))
    assert "worse by 80" in str(skiagraph.compare(near, far))
    assert "by -" not in str(skiagraph.compare(far, near))


def test_a_notebook_shows_a_player_below_200_kB(small):
    page = small._repr_html_()
    assert "playback-data" in page
    assert len(page) < 200_000


def test_the_version_is_that_of_the_program():
    said = subprocess.check_output([skiagraph.program(), "--version"], text=True).split()[-1]
    assert skiagraph.__version__ in (said, "0+checkout")


def test_sessions_of_several_threads_are_apart(small):
    runs = []

    def loop(by):
        session = small.tracking(seed=by)
        for frame in session:
            session.step(as_tracker(frame) + by)
        runs.append((by, session.run.estimate["estimate_markers"][0, 0, 0, 0]))

    threads = [threading.Thread(target=loop, args=(by,)) for by in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    start = next(iter(small.start.markers.values()))[0]
    assert dict(runs) == pytest.approx({by: start + by for by in range(3)})
