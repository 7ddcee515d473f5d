"""What surprised a newcomer: wrong numbers without a message, and messages that could not be followed."""

import multiprocessing
import os
import pickle
import random
import shutil
import subprocess
import sys
import textwrap
import time
from collections.abc import Sequence

import numpy as np
import pytest
from conftest import SMALL

import skiagraph
from skiagraph.torch import SilhouetteDataset


@pytest.fixture(scope="module")
def late(tmp_path_factory):
    """A set with a camera that exposes row after row, without its truth, which is apart."""
    root = tmp_path_factory.mktemp("late")
    settings = {**SMALL, "rig.timing": [{"camera": "cam01", "line_delay_us": 50.0}]}
    return skiagraph.render("walk", root / "public", settings, truth=root / "secret")


def still(frame):
    return frame.info.start.markers


def test_names_of_a_list_with_a_lost_frame_are_not_ignored(small):
    frames = list(small.truth.markers[:, ::-1])
    names = small.truth.marker_names.tolist()[::-1]
    assert small.evaluate(frames, names=names).metrics["mpjpe_mm"] < 1e-6
    with pytest.raises(skiagraph.InputError, match=r"answers by frame have their own .* a lost frame is NaN"):
        small.evaluate([None, *frames[1:]], names=names)
    frames[0] = np.full((15, 3), np.nan)
    assert small.evaluate(frames, names=names).metrics["mpjpe_mm"] < 1e-6


def test_a_run_whose_poses_changed_is_not_given_its_old_number(small, tmp_path):
    run = skiagraph.track(small, still, out=tmp_path / "run")
    before = run.evaluate().metrics["humaneva_mm"]
    poses = dict(run.estimate)
    assert skiagraph.Run(run.path).evaluate().metrics["humaneva_mm"] == before
    np.savez(run.path / "poses.npz", **{**poses, "estimate_markers": poses["estimate_markers"] + 1})
    for measure in (lambda: skiagraph.Run(run.path).evaluate(), lambda: skiagraph.compare(run.path, run.path)):
        with pytest.raises(
            skiagraph.InputError, match=r"poses\.npz: .* but it was changed, or replaced .* set\)\.eval"
        ):
            measure()
    with pytest.warns(skiagraph.MisreadWarning, match="its origin is at"):
        assert skiagraph.Run(run.path, small).evaluate().metrics["humaneva_mm"] > before + 1000
    with pytest.warns(skiagraph.MisreadWarning, match="its origin is at"):
        assert "equal" in str(skiagraph.compare(skiagraph.Run(run.path, small), skiagraph.Run(run.path, small)))
    (run.path / "poses.npz").unlink()
    for opened in (run, skiagraph.Run(run.path)):
        with pytest.raises(skiagraph.InputError, match=r"poses\.npz.* No such file"):
            opened.evaluate()


def test_a_run_whose_poses_are_listed_twice_is_not_called_changed(shipped, tmp_path):
    scenario = [shipped / "smoke" / "matched.toml", "particles=5", "layers=1", "calibrate=false"]
    subprocess.run([skiagraph.program(), "run", *scenario, "--quiet", f"--out={tmp_path / 'run'}"], check=True)
    assert skiagraph.Run(tmp_path / "run").evaluate().per_frame["mpjpe_mm"].any()


def test_a_measured_run_is_refused_by_another_set(small, late):
    run = skiagraph.track(small, still)
    run.evaluate()
    with pytest.raises(skiagraph.InputError, match=r"does not fit .* this set has"):
        skiagraph.Run(run.path, late).evaluate()


def test_a_result_does_not_mix_two_measurements(small, tmp_path):
    first = small.evaluate(small.truth.markers, out=tmp_path / "out")
    text = str(first)
    opened = skiagraph.Result(tmp_path / "out")
    small.evaluate(small.truth.markers + 0.1, out=tmp_path / "out", force=True)
    assert first.metrics["mpjpe_mm"] < 1e-6
    assert str(first) == text
    for read in (lambda: first.per_frame, lambda: first._repr_html_(), lambda: str(opened)):
        with pytest.raises(skiagraph.InputError, match="but it was changed, or replaced by other results"):
            read()


def test_a_loop_sees_the_same_cameras_as_track(late):
    told = []
    skiagraph.track(late, lambda frame: told.append(frame) or frame.info.start.markers)
    for ours, theirs in zip(late, told, strict=True):
        for of_loop, of_tracker in (
            *zip(ours.info.cameras, theirs.info.cameras, strict=True),
            *((a.camera, b.camera) for a, b in zip(ours.views, theirs.views, strict=True)),
        ):
            assert of_loop.near == of_tracker.near > 0
            assert of_loop.line_delay == of_tracker.line_delay == pytest.approx(50e-6 * (of_loop.name == "cam01"))


def test_what_is_given_out_cannot_be_changed(small):
    start = small.start
    with pytest.raises(TypeError, match="change a copy"):
        start.markers["pelvis"] = np.zeros(3)
    with pytest.raises(TypeError, match="change a copy"):
        small.evaluate(small.truth.markers).metrics.clear()
    for sequence in (small.marker_names, small.joint_names, small.cameras, small.info.joints, small.truth.cameras):
        assert isinstance(sequence, tuple)
    copied = pickle.loads(pickle.dumps(small))
    assert copied.times.shape == small.times.shape
    arrays = [small.times, copied.times]
    for of in (small, copied, pickle.loads(pickle.dumps(copied))):
        truth = pickle.loads(pickle.dumps(of.truth))
        cameras = pickle.loads(pickle.dumps(of.cameras))
        pose = pickle.loads(pickle.dumps(of.start))
        assert list(pose.markers) == list(start.markers)
        arrays += [truth.markers, of.truth.markers, cameras[1].K, of.cameras[0].t, pose.root, of.start.angles]
        arrays += [pose.markers["pelvis"], of.info.cameras[0].K]
    for array in arrays:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    assert {**start.markers, "pelvis": np.zeros(3)}["pelvis"].any() == np.False_


def mixed(frame):
    """Markers, and joints from the fourth frame on."""
    return frame.info.start.joints if frame.index >= 3 else frame.info.start.markers


def test_mixed_kinds_of_answers_are_refused_with_their_frame(small):
    expected = "the answer to frame 3.*: expected markers, as in earlier frames, found joints; answer all .* one form"
    with pytest.raises(skiagraph.TrackerError, match=expected):
        skiagraph.track(small, mixed)
    session = small.tracking()
    for frame in list(small)[:3]:
        session.step(mixed(frame))
    with pytest.raises(skiagraph.TrackerError, match=expected):
        session.step(mixed(session.frame))
    for answers in ({frame.index: mixed(frame) for frame in small}, [mixed(frame) for frame in small]):
        with pytest.raises(skiagraph.InputError, match=expected):
            small.evaluate(answers)
    pose = {"root": small.start.root, "angles": small.start.angles}
    with pytest.raises(skiagraph.TrackerError, match=r"frame 1 .*: expected root and angles, .*, found markers"):
        skiagraph.track(small, lambda frame: still(frame) if frame.index else pose)
    # a lost frame is of any kind
    lost = {"joints": {name: [np.nan] * 3 for name in small.joint_names}}
    run = skiagraph.track(small, lambda frame: lost if frame.index in (0, 4) else still(frame))
    assert run.program["answers"] == {"poses": small.frames - 2, "lost": 2, "failed": 0}


def test_the_truth_of_another_set_is_refused(small, late):
    assert late.truth.markers.shape == small.truth.markers.shape
    with pytest.raises(skiagraph.InputError, match=r"is not the truth of .*public; give the folder of render\("):
        skiagraph.Set(late.path, truth_at=small.path).truth  # noqa: B018
    assert skiagraph.Set(small.path, truth_at=small.path).truth.markers.any()


def test_a_session_knows_its_seed(small):
    with small.tracking(seed=7) as session:
        assert session.info.seed == 7
        assert session.info.markers == small.marker_names
        assert repr(session) == "Session(Frame(0, 0.000 s))"
        assert repr(session.info) == "SetInfo(19 frames at 60 Hz, 4 cameras, seed 7)"
        assert repr(session.frame.views) == "[View(cam00), View(cam01), View(cam02), View(cam03)]"
    assert repr(session) == "Session(over)"


@pytest.mark.parametrize("kind", ["markers", "joints"])
def test_the_remedy_for_answers_by_frame_can_be_followed(small, kind):
    if kind == "joints":
        truth = dict(zip(small.truth.joint_names.tolist(), small.truth.joints.swapaxes(0, 1), strict=True))
        points = {name: truth[name] for name in small.joint_names if name in truth}
    else:
        points = dict(zip(small.marker_names, small.truth.markers.swapaxes(0, 1), strict=True))
    by_frame = [{name: at[frame][[0, 2, 1]] for name, at in points.items()} for frame in range(small.frames)]
    with pytest.warns(skiagraph.MisreadWarning, match=r"Use axes='x,z,y'; .*\*\*result.corrections"):
        result = small.evaluate(by_frame)
    corrected = small.evaluate(by_frame, **result.corrections).metrics["mpjpe_mm"]
    assert corrected < result.metrics["mpjpe_mm"] / 5


def test_advice_about_the_truth_is_that_of_python(late):
    blind = skiagraph.Set(late.path)
    run = skiagraph.track(blind, still)
    with pytest.raises(
        skiagraph.InputError, match=r"give the complete set with Set\(\.\.\., truth_at=\.\.\.\)"
    ) as raised:
        run.evaluate()
    assert "--truth DIR" not in str(raised.value)
    with pytest.raises(skiagraph.InputError, match=r"Set\('.*public', truth_at=\.\.\.\)"):
        blind.evaluate(run, truth="secret")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_session_in_a_forked_process_does_not_hang(small):
    code = f"""
    import os, skiagraph
    with skiagraph.Session({str(small.path)!r}) as session:
        session.step(None)
        if (child := os.fork()) == 0:
            try:
                session.step(None)
            except skiagraph.InputError as error:
                session.close()
                os._exit(7 * ("that of another process" in str(error)))
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), session.step(None))
    """
    command = [sys.executable, "-W", "ignore", "-c", textwrap.dedent(code)]
    assert subprocess.run(command, capture_output=True, text=True, timeout=30).stdout == "7 Frame(2, 0.033 s)\n"


def test_a_session_is_not_pickled_and_says_so(small):
    with (
        small.tracking() as session,
        pytest.raises(skiagraph.InputError, match=r"a session cannot be sent to another process; begin one there"),
    ):
        pickle.dumps(session)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_pool_does_not_delay_the_end_of_a_session(small):
    with small.tracking() as session, multiprocessing.get_context("fork").Pool(1) as pool:
        for frame in session:
            begun = time.monotonic()
            session.step(pool.apply(still, [frame]))
        assert time.monotonic() - begun < 1.8
    assert session.run.incidents == []


def test_a_session_that_is_begun_twice_says_how_to_end_the_first(small, tmp_path):
    session = small.tracking(out=tmp_path / "run")
    with pytest.raises(skiagraph.InputError, match=r"writing here; .*earlier session of yours, close\(\) or a with"):
        small.tracking(out=tmp_path / "run")
    session.close()
    small.tracking(out=tmp_path / "run").close()


def test_a_session_that_is_open_at_the_end_leaves_no_temporary_folder(small, tmp_path):
    code = f"import skiagraph; session = skiagraph.Session({str(small.path)!r}); session.step(None)"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True, timeout=30)
    assert list(tmp_path.iterdir()) == []


def test_zeros_are_not_called_nan(small):
    zeros = np.zeros((small.frames, 15, 3))
    for estimate in (zeros, [None, *zeros[1:]], {3: dict.fromkeys(small.joint_names, zeros[0, 0])}):
        with pytest.raises(
            skiagraph.InputError, match=r"every point is NaN or \(0, 0, 0\), which counts as missing too"
        ):
            small.evaluate(estimate)


@pytest.mark.parametrize("key", [lambda frame: frame, lambda frame: str(frame.index), lambda frame: frame.time])
def test_answers_by_other_keys_are_told_what_keys_are(small, key):
    with pytest.raises(skiagraph.InputError, match=r"frames, \{frame\.index: answer\}, integers 0 to 18,"):
        small.evaluate({key(frame): frame.info.start.markers for frame in small})


def test_wrong_names_are_answered_with_similar_ones(small, shipped):
    truth = small.truth.markers[None] + np.linspace(0, 0.01, 3)[:, None, None, None]
    result = small.evaluate(truth)
    for named, name, advice in (
        (result.per_joint, "knee", "no marker 'knee'; did you mean left_knee or right_knee"),
        (result.per_frame, "mpjpe", "no metric by frame 'mpjpe'; did you mean mpjpe_mm"),
        (result.intervals, "mpjpe", "no interval 'mpjpe'; did you mean mpjpe_mm"),
        (small.evaluate(truth[0]).intervals, "mpjpe_mm", "mpjpe_mm could not be computed: it needs three seeds"),
        (small.start.markers, "left_kne", "no marker 'left_kne'; did you mean left_knee"),
        (small.truth, "marker", "truth.npz.*: no array 'marker'; did you mean markers"),
    ):
        with pytest.raises(skiagraph.MissingNameError, match=advice):
            named[name]
    (cell,) = skiagraph.sweep(shipped / "smoke" / "matched.toml", {"layers": [1]}, {"particles": 5}, seeds=1)
    with pytest.raises(skiagraph.MissingNameError, match=r"no axis 'layer'; did you mean .*layers\?"):
        cell.axes["layer"]


def test_wrong_arguments_are_input_errors(small):
    with pytest.raises(skiagraph.InputError, match="name: expected text, found int 3"):
        skiagraph.track(small, still, name=3)
    with pytest.raises(skiagraph.InputError, match="expected the folder of a benchmark set"):
        skiagraph.Session("nowhere")


def test_a_set_that_was_removed_is_not_called_blind(small, tmp_path):
    gone = skiagraph.Set(shutil.copytree(small.path, tmp_path / "gone"))
    shutil.rmtree(gone.path)
    for read in (lambda: gone.evaluate(small.truth.markers), lambda: gone.truth):
        with pytest.raises(skiagraph.SkiagraphError, match=r"gone(/start)? is no folder, or no longer"):
            read()


def test_the_advice_for_a_damaged_run_can_be_followed(small, tmp_path):
    run = skiagraph.track(small, still, out=tmp_path / "run")
    wanted = run.evaluate().metrics
    whole = (run.path / "run.json").read_bytes()
    (run.path / "run.json").write_bytes(whole[:300])
    with pytest.raises(skiagraph.InputError, match=r"run\.json: .*; remove it if it is there, and measure again: "):
        skiagraph.Run(run.path).evaluate()
    with pytest.raises(skiagraph.InputError, match=r"run\.json: .* move it away"):
        skiagraph.Run(run.path, small).evaluate()
    (run.path / "run.json").unlink()
    assert skiagraph.Run(run.path, small).evaluate().metrics == wanted
    (run.path / "poses.npz").write_bytes(b"PK")
    with pytest.raises(skiagraph.InputError, match=r"poses\.npz: .*; run the tracker again"):
        skiagraph.Run(run.path).estimate  # noqa: B018


def test_a_window_longer_than_every_set_is_refused(small):
    with pytest.raises(skiagraph.InputError, match="no set has a window of 80 frames; frames of the sets: 19"):
        SilhouetteDataset(small, window=80, tensors=False)


def test_a_result_in_a_notebook_is_below_200_kB(small):
    pytest.importorskip("PIL")
    assert len(small.evaluate(small.truth.markers)._repr_html_()) < 200_000


def test_a_second_step_for_a_frame_leaves_no_run(small, tmp_path):
    session = small.tracking(out=tmp_path / "run")

    def loop():
        for frame in session:
            session.step(frame.info.start.markers)
            if frame.index == 17:
                session.step(frame.info.start.markers)

    with pytest.raises(skiagraph.InputError, match=r"expected one session.step\(...\) for frame 17, found 2"):
        loop()
    assert not (tmp_path / "run").exists()


def test_a_loop_that_is_left_goes_on_by_hand(small):
    with small.tracking() as session:
        for frame in session:
            session.step(frame.info.start.markers)
            if frame.index == 3:
                break
        while session.frame is not None:
            session.step(session.frame.info.start.markers)
        assert session.run.program["answers"]["poses"] == small.frames


def test_points_that_count_as_missing_are_said(small):
    points = small.truth.markers.copy()
    points[3:5, 4] = 0
    with pytest.warns(skiagraph.MisreadWarning, match="0, 0, 0 count as missing"):
        small.evaluate(points)


def test_names_without_an_order_are_refused(small):
    with pytest.raises(skiagraph.InputError, match=r"expected names=\[...\] of text.*found set"):
        small.evaluate(small.truth.markers, names=set(small.marker_names))


def test_errors_name_keywords(small):
    points = small.truth.markers
    for options, said in [
        ({"units": "km"}, "'units'"),
        ({"up": "y", "axes": "x,y,z"}, "'axes'|'up'"),
        ({"pipeline": "pose2sim"}, "pipeline"),
        ({"seed": -1}, "seed"),
    ]:
        with pytest.raises(skiagraph.InputError, match=said) as found:
            small.tracking(**options) if "seed" in options else small.evaluate(points, **options)
        assert "--" not in str(found.value)
    with pytest.raises(skiagraph.InputError) as found:
        small.evaluate(1000 * points)
    assert "units='mm'" in str(found.value)
    assert small.evaluate(points @ small.cameras[0].R.T + small.cameras[0].t, camera=0).metrics["mpjpe_mm"] < 1e-6


def test_messages_are_in_the_words_of_python(small):
    run = skiagraph.track(small, "frozen", seeds=5)
    points, program = small.truth.markers, skiagraph.Program
    for call, said in [
        (lambda: skiagraph.compare(small, run), r"run: .* make one with skiagraph\.track\(set, tracker\)$"),
        (lambda: skiagraph.track(small, program("false")), "^the program false: it ended before"),
        (lambda: skiagraph.track(small, program("x {alpha}")), r"has no value: give settings=\{'alpha': \.\.\.\}, or"),
        (lambda: skiagraph.track(small, program("")), r"'command': .* as in Program\(.*\), found"),
        (lambda: skiagraph.track(small, program("x", readable=["/"])), "what is missing is sandbox=True"),
        (lambda: skiagraph.save_baseline("a/b", run), "^name: `a/b`: expected at most 64 letters"),
        (lambda: skiagraph.save_baseline("a", skiagraph.track(small, "frozen")), "^run: expected 5 or more seeds"),
        (lambda: skiagraph.track(small, "frozen", settings={"particle": 3}), "^setting particle=3: frozen"),
        (lambda: small.evaluate(points, names=["knee"] * 15), '^names: "knee" is not a marker'),
        (lambda: small.evaluate(points[2:]), "use shift with the set's frame of its first frame$"),
        (lambda: small.evaluate(points, reference_offset=0.1), "what is missing is reference$"),
    ]:
        with pytest.raises(skiagraph.InputError, match=said) as raised:
            call()
        assert "--" not in str(raised.value)
    assert run.program is None
    assert run.incidents == []


def test_points_of_other_names_say_where_they_are_measured(small):
    coco = small.truth.joints_as("coco17")
    answers = {frame.index: {name: at[frame.index] for name, at in coco.items()} for frame in small}
    assert small.evaluate(answers).metrics["coverage"] > 0.5
    with pytest.raises(skiagraph.TrackerError, match=r"found left_ear, left_eye, nose and 2 more; set\.evaluate\("):
        skiagraph.track(small, lambda frame: answers[frame.index])


def test_a_session_takes_indices_and_refuses_frames_of_others(small):
    with small.tracking() as session, small.tracking() as other:
        for frame in (small[0], other.frame):
            with pytest.raises(skiagraph.InputError, match="expected a frame of this session, found one of"):
                session.step(None, frame)
        with pytest.raises(skiagraph.InputError, match="the answer to frame 0, found that to frame 3"):
            session.step(None, 3)
        assert session.step(None, 0).index == 1


def test_sets_and_images_are_sequences_whose_indices_are_named(small):
    assert isinstance(small, Sequence)
    assert isinstance(small.masks(0), Sequence)
    assert random.Random(1).choice(small).info is small.info
    windows = SilhouetteDataset(small, window=4, tensors=False)
    for items, index, said in [(small, 19, "frame 19"), (small, 1.0, r"frame 1\.0"), (windows, 4, "window 4")]:
        with pytest.raises(IndexError, match=f"^{said}: expected an integer from 0 to {len(items) - 1}$"):
            items[index]


def test_what_is_no_estimate_or_name_says_what_is_expected(small, tmp_path):
    points, run = small.truth.markers, skiagraph.track(small, still)
    for call, said in [
        (lambda: small.evaluate({}), r"points by name, or \{frame\.index: answer, \.\.\.\}, found an empty"),
        (lambda: small.evaluate(small.truth), "found the truth of a set; its markers are set.truth.markers"),
        (lambda: small.evaluate({True: points[1]}), "integers 0 to 18, found the key True"),
        (lambda: skiagraph.track(small, "--help"), "tracker --help: no such tracker"),
        (lambda: skiagraph.save_baseline("--help", run), "name of a baseline as text, found str '--help'"),
        (lambda: skiagraph.render("walk", settings={"--help": 1}), "key of a setting as text, found str '--help'"),
    ]:
        with pytest.raises(skiagraph.InputError, match=said):
            call()
    with pytest.warns(skiagraph.MisreadWarning, match="only frame 0 is answered, .* not measured"):
        small.evaluate({0: points[0], 1: None})
