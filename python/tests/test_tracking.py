"""Trackers in Python: what they see, what they may answer, and how they fail."""

import os
import shutil
import signal
import subprocess
import sys
import textwrap
import threading
import time
import traceback
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import skiagraph


def stay(frame):
    return frame.info.start.markers


class Walker:
    """Moves the start pose on along x, by an amount that depends on the seed."""

    def start(self, info):
        self.info, self.done = info, 0
        self.points = np.array(list(info.start.markers.values()))

    def track(self, frame):
        assert frame.index == self.done
        self.done += 1
        return self.points + [0.001 * frame.index * (1 + self.info.seed), 0, 0]


def program(folder, text):
    """A tracker in a file of its own, as users write it."""
    (folder / "mine.py").write_text(textwrap.dedent(text))
    return skiagraph.Program(f"{sys.executable} {folder / 'mine.py'}")


@pytest.mark.parametrize("tracker", [Walker, Walker()], ids=["class", "object"])
def test_every_seed_starts_anew(small, tracker):
    run = skiagraph.track(small, tracker, seeds=3, seed=4)
    markers = run.estimate["estimate_markers"]
    assert markers.shape == (3, small.frames, 15, 3)
    assert run.estimate["seeds"].tolist() == [4, 5, 6]
    moved = markers[:, -1, :, 0] - markers[:, 0, :, 0]
    assert np.allclose(moved, 0.001 * (small.frames - 1) * np.array([[5], [6], [7]]))
    assert len(run.evaluate().intervals) > 3


def test_a_program_gives_what_the_same_tracker_gives_in_this_process(small, tmp_path):
    here = skiagraph.track(small, Walker, seeds=2)
    there = program(
        tmp_path,
        f"""
        import sys
        sys.path.insert(0, {str(__file__.rpartition("/")[0])!r})
        import skiagraph
        from test_tracking import Walker
        print("this is no answer")
        skiagraph.serve(Walker)
        """.replace('print("this is no answer")', ""),
    )
    apart = skiagraph.track(small, there, seeds=2)
    assert (here.path / "poses.npz").read_bytes() == (apart.path / "poses.npz").read_bytes()
    assert apart.program["name"] == "Walker"
    assert not apart.incidents


def test_what_a_served_tracker_prints_does_not_disturb(small, tmp_path):
    run = skiagraph.track(
        small,
        program(
            tmp_path,
            """
            import skiagraph
            def stay(frame):
                print("frame", frame.index)
                return frame.info.start.markers
            skiagraph.serve(stay)
            """,
        ),
    )
    assert run.program["answers"] == {"poses": small.frames, "lost": 0, "failed": 0}


def answers(info):
    """The start pose in every form that a tracker may answer."""
    start = info.start
    joints = np.array([start.joints[name] for name in info.joints])
    return {
        "markers by name": start.markers,
        "array of markers": np.array([start.markers[name] for name in info.markers], np.float32),
        "joints by name": dict(zip(info.joints, joints.tolist(), strict=True)),
        "array of joints": joints,
        "pose": {"root": start.root, "angles": start.angles},
        "with confidence": {"markers": start.markers, "confidence": np.float64(0.5)},
    }


def test_every_form_of_answer_says_the_same(small):
    errors, forms = {}, []

    def first(frame):
        forms.extend(answers(frame.info))
        return frame.info.start.markers

    skiagraph.track(small, first)
    for form in dict.fromkeys(forms):
        run = skiagraph.track(small, lambda frame, form=form: answers(frame.info)[form])
        errors[form] = run.evaluate().metrics["mpjpe_mm"]
    assert len(errors) == 6
    of_markers = errors["markers by name"]
    assert of_markers > 1
    assert errors["array of markers"] == pytest.approx(of_markers, rel=1e-4)
    assert errors["pose"] == pytest.approx(of_markers)
    assert errors["with confidence"] == pytest.approx(of_markers)
    assert errors["joints by name"] == pytest.approx(errors["array of joints"])


def test_keypoints_are_arrays_with_nan_for_what_was_missed(small):
    hello = []
    skiagraph.track(small, lambda frame: hello.append(frame.info) or frame.info.start.markers)
    message = {**hello[0].message, "keypoints": {"layout": "coco17", "names": ["nose", "left_eye"]}}
    assert hello[0].keypoints == ()
    assert skiagraph.SetInfo(message).keypoints == ("nose", "left_eye")
    view = skiagraph.View({"camera": "cam00", "keypoints": [[320.1, 97.4, 0.93], None]}, small.cameras[0])
    assert view.keypoints.shape == (2, 3)
    assert view.keypoints[0].tolist() == [320.1, 97.4, 0.93]
    assert np.isnan(view.keypoints[1]).all()
    assert skiagraph.View({"camera": "cam00"}, small.cameras[0]).keypoints is None


def test_lost_frames_and_missing_points(small):
    def partly(frame):
        if frame.index % 2:
            return None
        return {**frame.info.start.markers, "head_top": np.full(3, np.nan)}

    run = skiagraph.track(small, partly)
    assert run.program["answers"]["lost"] == small.frames // 2
    estimate = run.estimate["estimate_markers"].reshape(small.frames, 15, 3)
    head = run.estimate["marker_names"].tolist().index("head_top")
    assert np.isnan(estimate[1]).all()
    assert np.isnan(estimate[0, head]).all()
    assert np.isfinite(np.delete(estimate[0], head, axis=0)).all()


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (
            np.zeros((14, 3)),
            r"shape \(15, 3\) of markers or \(\d+, 3\) of joints, in metres, found float64 of shape \(14, 3\)",
        ),
        (np.zeros((15, 3), complex), r"found complex128 of shape \(15, 3\)"),
        ("somewhere", r"found str 'somewhere'"),
        ({"left_nose": [0, 0, 0]}, r"names of markers \(thorax, .*\) or of info.joints, found left_nose"),
        ({"pelvis": [0, 0, 0], "left_knee_flexion": [0, 0, 0]}, "found names of both"),
        (
            {"pelvis": ["left", 0, 0]},
            "the answer to frame 0 of seed 0: expected markers pelvis as 3 numbers, found list",
        ),
        (
            {"markers": np.zeros((14, 3))},
            r"expected markers of shape \(15, 3\), or by name, found float64 of shape \(14, 3\)",
        ),
        ({"markers": {"pelvis": [0, 0, 0]}, "confidence": np.nan}, "confidence is nan; expected a number from 0 to 1"),
    ],
)
def test_an_answer_of_the_wrong_kind_says_what_is_expected(small, answer, message):
    with pytest.raises(skiagraph.TrackerError, match=message):
        skiagraph.track(small, lambda frame: answer)


def test_what_is_no_tracker_is_refused(small):
    with pytest.raises(
        skiagraph.TrackerError, match=r"a function of a frame, or an object or class with a method track"
    ):
        skiagraph.track(small, 3)
    with pytest.raises(skiagraph.InputError, match="annealed_particle_filter"):
        skiagraph.track(small, "aneled_particle_filter")


def test_an_exception_keeps_its_traceback_and_leaves_no_run(small, tmp_path):
    def fails(frame):
        if frame.index == 3:
            raise LookupError("no such limb")
        return frame.info.start.markers

    with pytest.raises(skiagraph.TrackerError, match="raised LookupError in frame 3 of seed 0: no such limb") as raised:
        skiagraph.track(small, fails, out=tmp_path / "run")
    cause = raised.value.__cause__
    assert isinstance(cause, LookupError)
    assert "fails" in [entry.name for entry in traceback.extract_tb(cause.__traceback__)]
    assert not (tmp_path / "run").exists()

    class NeverReady:
        def start(self, info):
            raise OSError("no model")

        def track(self, frame):
            return None

    with pytest.raises(skiagraph.TrackerError, match="raised OSError before the first frame of seed 0: no model"):
        skiagraph.track(small, NeverReady)


def test_an_exception_in_a_program_is_in_the_run_with_its_traceback(small, tmp_path):
    tracker = program(
        tmp_path,
        """
        import skiagraph
        def fails(frame):
            if frame.index == 3:
                raise LookupError("no such limb")
            return frame.info.start.markers
        skiagraph.serve(fails)
        """,
    )
    run = skiagraph.track(small, tracker)
    assert run.program["answers"]["failed"] == 1
    said = str(run.incidents)
    assert "no such limb" in said
    assert "Traceback" in said or "LookupError" in said


class Slow:
    """Too slow in frames 2 and 4."""

    def __init__(self):
        self.starts = 0

    def start(self, info):
        self.starts += 1

    def track(self, frame):
        # far beyond what a busy machine adds to other frames
        time.sleep(2.5 if frame.index in (2, 4) else 0)
        return frame.info.start.markers


def test_a_tracker_that_is_too_slow_loses_its_frame_and_goes_on_with_its_state(small):
    tracker = Slow()
    with pytest.warns(RuntimeWarning, match=r"frame 2 of seed 0 took 2\.\d+ s, and frame_limit is 2: .* is lost"):
        run = skiagraph.track(small, tracker, frame_limit=2)
    assert run.program["answers"] == {"poses": small.frames - 2, "lost": 0, "failed": 2}
    assert [incident["frame"] for incident in run.incidents] == [2, 4]
    assert tracker.starts == 1


def test_a_run_or_session_whose_further_frames_are_lost_says_so(small):
    with pytest.warns(RuntimeWarning, match=r"\d+ frames are lost after too many failures; restarts=\.\.\. allows"):
        skiagraph.track(small, Slow(), frame_limit=2, restarts=0)
    session, tracker = small.tracking(frame_limit=2, restarts=0), Slow()
    while session.frame.index < 2:
        session.step(tracker.track(session.frame))
    with pytest.warns(RuntimeWarning, match=r"\d+ frames are lost after too many failures"):
        assert session.step(tracker.track(session.frame)) is None
    with pytest.raises(skiagraph.InputError, match="all 19 frames are answered or lost"):
        session.step(None)


def test_a_tracker_that_never_answers_is_an_error_that_says_so(small):
    with pytest.raises(skiagraph.InputError, match="no frame was answered with a pose"):
        skiagraph.track(small, lambda frame: None)


def test_a_run_in_a_folder_is_replaced_only_where_that_is_said(small, tmp_path):
    skiagraph.track(small, stay, out=tmp_path / "run")
    for tracker in (stay, Walker, "frozen"):
        with pytest.raises(skiagraph.InputError, match=r"run has results already; .* with force=True"):
            skiagraph.track(small, tracker, out=tmp_path / "run")
    skiagraph.track(small, stay, out=tmp_path / "run", force=True)
    assert not (tmp_path / "run~").exists()
    skiagraph.track(small, Walker, out=tmp_path / "run", force=True)
    assert (tmp_path / "run~").exists()
    with pytest.raises(skiagraph.InputError, match="the output would replace or change"):
        skiagraph.track(small, stay, out=small.path)


def test_a_tracker_of_skiagraph_with_settings(small):
    run = skiagraph.track(small, "annealed_particle_filter", settings={"particles": 10, "layers": 2}, seeds=3)
    result = run.evaluate()
    assert result.metrics["humaneva_mm"] < 200
    low, high = result.intervals["humaneva_mm"]
    assert low <= result.metrics["humaneva_mm"] <= high
    with pytest.raises(skiagraph.InputError, match="settings are those of programs and skiagraph's own trackers"):
        skiagraph.track(small, stay, settings={"particles": 3})


SHIFTED = """
    import sys, skiagraph
    def stay(frame):
        return {name: place + float(sys.argv[1]) for name, place in frame.info.start.markers.items()}
    skiagraph.serve(stay)
"""


def test_a_program_has_settings_which_a_sweep_varies(small, shipped, tmp_path):
    command = program(tmp_path, SHIFTED).command + " {by}"
    start = skiagraph.track(small, stay).estimate["estimate_markers"]
    run = skiagraph.track(small, skiagraph.Program(command), settings={"by": 0.25})
    assert np.allclose(run.estimate["estimate_markers"], start + 0.25)
    scenario = shipped / "smoke" / "matched.toml"
    cells = list(skiagraph.sweep(scenario, {"by": [0.0, 9.0]}, tracker=skiagraph.Program(command), seeds=1))
    assert [cell.axes["by"] for cell in cells] == [0.0, 9.0]
    assert cells[1].metrics["humaneva_mm"] > cells[0].metrics["humaneva_mm"] + 9000
    (cell,) = skiagraph.sweep(scenario, {"observation.seed": [1]}, tracker="frozen", seeds=1)
    assert cell.metrics["humaneva_mm"] == pytest.approx(cells[0].metrics["humaneva_mm"])
    with pytest.raises(skiagraph.InputError, match=r"a sweep starts programs: end a file with skiagraph\.serve"):
        skiagraph.sweep(scenario, {"by": [1]}, tracker=stay)


def test_a_tracker_sees_no_truth(small):
    found = []

    def look(frame):
        found.extend(path.name for path in frame.info.folder.rglob("*"))
        return frame.info.start.markers

    skiagraph.track(small, look)
    assert "start.json" in found
    assert "truth.npz" not in found


def test_values_of_the_start_pose_are_an_array_in_the_order_of_the_names(small):
    named = skiagraph.track(small, stay)
    listed = skiagraph.track(small, lambda frame: np.array(list(frame.info.start.markers.values())))
    assert np.array_equal(listed.estimate["estimate_markers"], named.estimate["estimate_markers"])


def test_an_answer_without_any_point_is_a_lost_frame(small):
    run = skiagraph.track(small, lambda frame: frame.info.start.markers if frame.index else np.full((15, 3), np.nan))
    assert (run.program["answers"]["lost"], run.program["answers"]["failed"]) == (1, 0)


def test_an_array_under_the_key_of_markers_is_taken_in_their_order(small):
    plain = skiagraph.track(small, lambda frame: np.array(list(frame.info.start.markers.values())))
    keyed = skiagraph.track(small, lambda frame: {"markers": np.array(list(frame.info.start.markers.values()))})
    assert np.array_equal(plain.estimate["estimate_markers"], keyed.estimate["estimate_markers"])


def test_an_infinite_or_partly_missing_point_is_not_taken_for_a_missing_one(small):
    def spoiled(frame, number, form):
        points = np.array(list(frame.info.start.markers.values()))
        points[2, 1] = number
        return points if form == "array" else dict(zip(frame.info.markers, points, strict=True))

    for number in (np.inf, -np.inf, np.nan):
        for form in ("array", "names"):
            with pytest.raises(skiagraph.TrackerError, match=r"seed 0: markers \w+ is \[.*\]; expected finite"):
                skiagraph.track(small, lambda frame, number=number, form=form: spoiled(frame, number, form))


def test_masked_points_of_an_answer_are_missing_and_not_numbers(small):
    def masked(frame):
        points = np.ma.array(list(frame.info.start.markers.values()))
        points[3] = np.ma.masked
        return points if frame.index % 2 else dict(zip(frame.info.markers, points, strict=True))

    estimate = skiagraph.track(small, masked).estimate["estimate_markers"].reshape(small.frames, 15, 3)
    assert np.isnan(estimate[:, 3]).all()
    assert np.isfinite(np.delete(estimate, 3, axis=1)).all()


def shifted(by, fail_at=None, error=ValueError):
    """A tracker whose code has changed, under the same name."""

    def mine(frame):
        if frame.info.seed == fail_at:
            raise error("stopped")
        return np.array(list(frame.info.start.markers.values())) + by

    return mine


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_seeds_of_older_code_are_not_in_the_run_after_an_exception(small, tmp_path, error):
    with pytest.raises((skiagraph.TrackerError, KeyboardInterrupt), match="stopped"):
        skiagraph.track(small, shifted(0.0, fail_at=2, error=error), out=tmp_path / "run", seeds=3)
    assert list(tmp_path.iterdir()) == []
    markers = skiagraph.track(small, shifted(0.5), out=tmp_path / "run", seeds=3).estimate["estimate_markers"]
    assert np.array_equal(markers[0], markers[1])
    assert np.array_equal(markers[0], markers[2])


def test_unfinished_work_of_others_is_not_touched(small, tmp_path):
    (tmp_path / "run.partial").mkdir()
    (tmp_path / "run.partial" / "thesis.tex").write_text("years of work")
    skiagraph.track(small, stay, out=tmp_path / "run", seeds=2)
    assert (tmp_path / "run.partial" / "thesis.tex").exists()


def test_two_trackers_do_not_write_one_run_at_a_time(small, tmp_path):
    def nested(frame):
        if frame.info.seed == 1 and frame.index == 0:
            with pytest.raises(skiagraph.InputError, match="another skiagraph process is writing here"):
                skiagraph.track(small, stay, out=tmp_path / "run")
        return frame.info.start.markers

    run = skiagraph.track(small, nested, out=tmp_path / "run", seeds=2)
    assert len(run.estimate["seeds"]) == 2


def of_start(frame):
    """The start pose as an array."""
    return np.array(list(frame.info.start.markers.values()))


@pytest.mark.parametrize(
    ("form", "message"),
    [
        (lambda f: of_start(f).astype(np.float16), "found float16 .*; keep estimates in float32 or float64"),
        (lambda f: of_start(f).astype(object), r"found object of shape \(15, 3\)"),
        (lambda f: of_start(f) > 0, r"found bool of shape \(15, 3\)"),
        (lambda f: of_start(f).astype(str), r"found <U\d+ of shape \(15, 3\)"),
        (lambda f: {"pelvis": np.ones(3) + 1j}, r"pelvis as 3 numbers, found complex128 of shape \(3,\)"),
        (lambda f: {"pelvis": ["1", "2", "3"]}, r"pelvis as 3 numbers, found list \['1', '2', '3'\]"),
        (lambda f: {"pelvis": [True] * 3}, "pelvis as 3 numbers, found bool"),
        (lambda f: {"pelvis": [0.0, 0.0]}, r"pelvis as 3 numbers, found float64 of shape \(2,\)"),
        (lambda f: {"markers": {"pelvis": "here"}}, "pelvis as 3 numbers, found str 'here'"),
        (lambda f: {"markers": {"zonk": [0, 0, 0]}}, "names of thorax, .*, found zonk"),
        (lambda f: {"markers": of_start(f), "joints": f.info.start.joints}, "markers, or joints, or both root"),
        (lambda f: {"root": f.info.start.root}, "both root and angles, found root"),
        (lambda f: {"root": f.info.start.root[:6], "angles": f.info.start.angles}, "expected root as 7 numbers"),
        (lambda f: {"root": f.info.start.root, "angles": f.info.start.angles[1:]}, r"expected angles as \d+ numbers"),
        (lambda f: {"root": 2 * f.info.start.root, "angles": f.info.start.angles}, "w, x, y, z of length 1, found"),
        (lambda f: 1e300 * of_start(f), r"expected finite numbers up to 1e\+06"),
        (lambda f: {"root": f.info.start.root, "angles": {"knee": 0}}, "missing: .*, unknown: .*knee"),
        (lambda f: {"root": f.info.start.root, "angles": np.nan * f.info.start.angles}, "only one of root and angles"),
        (
            lambda f: {"markers": of_start(f), "confidence": "high"},
            "confidence as a number from 0 to 1, found str 'high'",
        ),
        (lambda f: {"markers": of_start(f), "confidence": 2}, "confidence is 2; expected a number from 0 to 1"),
        (lambda f: {}, "return None for a lost frame"),
        (lambda f: (of_start(f), 0.5), "found a tuple of parts that differ in shape"),
    ],
)
def test_an_answer_that_would_fail_in_silence_is_an_exception(small, form, message):
    with pytest.raises(skiagraph.TrackerError, match=r"^the answer to frame 4 of seed 0: .*" + message):
        skiagraph.track(small, lambda frame: form(frame) if frame.index == 4 else of_start(frame))


@pytest.mark.parametrize("dtype", [np.uint8, np.int64, np.longdouble, np.float32, ">f8"])
def test_answers_of_every_width_are_taken(small, dtype):
    run = skiagraph.track(small, lambda frame: of_start(frame).astype(dtype))
    expected = of_start_of(small).astype(dtype).astype(float)
    # whole numbers of metres put points at 0, 0, 0, which counts as not estimated
    expected[(expected == 0).all(axis=1)] = np.nan
    assert np.allclose(run.estimate["estimate_markers"][0, 0], expected, atol=1e-6, equal_nan=True)


def of_start_of(of):
    found = []
    skiagraph.track(of, lambda frame: found.append(of_start(frame)) or found[0])
    return found[0]


def test_a_pose_of_nothing_but_nan_is_a_lost_frame(small):
    def pose(frame):
        scale = np.nan if frame.index == 3 else 1.0
        return {"root": scale * frame.info.start.root, "angles": scale * frame.info.start.angles}

    run = skiagraph.track(small, pose)
    assert run.program["answers"] == {"poses": small.frames - 1, "lost": 1, "failed": 0}
    assert repr(run).endswith(f": {small.frames - 1} poses, 1 lost, 0 failed)")


def test_a_tracker_in_this_process_ends_at_once_and_without_incidents(small):
    begun = time.monotonic()
    runs = [skiagraph.track(small, stay, seeds=5) for _ in range(12)]
    assert [incident for run in runs for incident in run.incidents] == []
    assert time.monotonic() - begun < 30


def test_a_tracker_may_change_its_masks_and_print_and_start_threads(small):
    seen = []

    def busy(frame):
        print("frame", frame.index)
        threading.Thread(target=sum, args=[[1, 2]]).start()
        seen.append([mask.copy() for mask in frame.masks])
        for mask in frame.masks:
            mask[:] = True
        return frame.info.start.markers

    run = skiagraph.track(small, busy, seeds=2)
    assert run.program["answers"]["failed"] == 0
    of_set = np.stack([small.masks(camera)[:] for camera in range(4)], axis=1)
    assert np.array_equal(seen, np.concatenate([of_set, of_set]))


def test_several_tracks_at_the_same_time_do_not_mix(small):
    shifts = [0.0, 0.1, 0.2, 0.3]
    with ThreadPoolExecutor(4) as pool:
        runs = list(pool.map(lambda by: skiagraph.track(small, shifted(by), seeds=2), shifts))
    start = of_start_of(small)
    for by, run in zip(shifts, runs, strict=True):
        assert np.allclose(run.estimate["estimate_markers"], start + by)
        assert run.incidents == []


def test_paths_with_spaces_quotes_and_other_letters_work(small, tmp_path, monkeypatch):
    place = tmp_path / 'Ö l\'été $HOME "x" 日本'
    shutil.copytree(small.path, place / "walk")
    monkeypatch.chdir(place)
    walk = skiagraph.Set("walk")
    run = skiagraph.track(walk, stay, out="my run; ls", seeds=2)
    assert run.evaluate().metrics["humaneva_mm"] > 0
    assert walk.masks(0)[0].any()
    assert walk.evaluate(walk.truth.markers, out="a b").path == place / "a b"


def test_a_package_and_a_python_at_a_path_with_spaces_run_trackers(small, tmp_path):
    shutil.copytree(Path(skiagraph.__file__).parent, tmp_path / "my $site" / "skiagraph")
    code = f"""
    import skiagraph
    run = skiagraph.track({str(small.path)!r}, lambda frame: frame.info.start.markers)
    print(skiagraph.__file__, run.program["answers"]["poses"])
    """
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "my $site")}
    said = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, env=environment, check=True
    ).stdout
    assert said == f"{tmp_path / 'my $site' / 'skiagraph' / '__init__.py'} {small.frames}\n"


@pytest.mark.skipif(sys.platform != "linux", reason="looks for the process below /proc")
def test_a_program_that_is_killed_during_tracking_is_reported_and_leaves_nothing(small, tmp_path):
    def kill(frame):
        if frame.index == 3:
            pid = next(programs_that_write(tmp_path))
            os.kill(pid, signal.SIGKILL)
            time.sleep(0.2)
        return frame.info.start.markers

    with pytest.raises(skiagraph.ProgramError, match="killed by signal 9"):
        skiagraph.track(small, kill, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()
    assert skiagraph.track(small, stay, out=tmp_path / "run").program["answers"]["poses"] == small.frames


def programs_that_write(out):
    """Processes of the program that write there."""
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        words = entry.read_bytes().split(b"\0")
        if b"track" in words and f"--out={out}/run".encode() in words:
            yield int(entry.parent.name)


def test_a_tracker_that_starts_too_slowly_is_named_and_not_the_program_that_stands_for_it(small):
    class Heavy:
        def start(self, info):
            time.sleep(1.5)

        def track(self, frame):
            return frame.info.start.markers

    with pytest.raises(skiagraph.InputError, match=r"^the tracker Heavy: it was not ready within 300ms$"):
        skiagraph.track(small, Heavy, start_limit=0.3)
    with pytest.raises(
        skiagraph.InputError, match=r"no frame was answered with a pose, so there is nothing to measure$"
    ):
        skiagraph.track(small, lambda frame: None)
