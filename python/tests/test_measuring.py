"""Measuring estimates, comparing runs, and the gate."""

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import SMALL

import skiagraph


@pytest.fixture(scope="module")
def draws(tmp_path_factory):
    """Runs of a tracker that does not move, on five draws of the noise, a bit worse and much worse."""
    root = tmp_path_factory.mktemp("draws")

    def runs(shift):
        return [skiagraph.track(each, lambda frame: moved(frame, shift)) for each in sets]

    def moved(frame, shift):
        return {name: place + [0, shift, 0] for name, place in frame.info.start.markers.items()}

    noise = {**SMALL, "observation.silhouette": "corrupted", "boundary_px": 1.0, "start_mm": 5.0}
    sets = [skiagraph.render("walk", root / str(n), noise, observation__seed=n, key="default") for n in range(5)]
    return {shift: runs(shift) for shift in (0.0, 0.0001, 0.3)}


def test_an_array_is_measured_as_computed_by_hand(small):
    truth = small.truth.markers
    estimate = truth + np.random.default_rng(5).normal(0, 0.03, truth.shape)
    result = small.evaluate(estimate)
    errors = 1000 * np.linalg.norm(estimate - truth, axis=-1)[1:]
    assert result.metrics["mpjpe_mm"] == pytest.approx(errors.mean())
    assert result.per_frame["humaneva_mm"].shape == (1, small.frames)
    assert np.isnan(result.per_frame["humaneva_mm"][0, 0])
    assert np.allclose(result.per_frame["humaneva_mm"][0, 1:], errors.mean(axis=1))
    assert result.hint is None
    assert "HumanEva 3-D error (mm)" in str(result)
    assert "protocol:" in str(result)
    assert result.report.exists()


def test_several_seeds_names_in_another_order_and_single_precision(small):
    truth, names = small.truth.markers, small.truth.marker_names.tolist()
    order = np.random.default_rng(6).permutation(15)[:12]
    estimate = np.stack([truth[:, order] + shift for shift in (0.01, 0.02, 0.04)]).astype(np.float32)
    result = small.evaluate(estimate, names=[names[index] for index in order])
    assert result.record["metrics"]["mpjpe_mm"]["per_run"] == pytest.approx(
        [10 * 3**0.5, 20 * 3**0.5, 40 * 3**0.5], rel=1e-4
    )
    assert set(result.intervals) <= set(result.metrics)
    assert result.metrics["coverage"] == pytest.approx(12 / 15)
    assert result.absent["energy_gap"].startswith("needs ")


def test_points_by_name_and_arrays_of_an_npz(small):
    truth, names = small.truth.markers, small.truth.marker_names.tolist()
    by_name = {name: truth[:, index] + 0.01 for index, name in enumerate(names)}
    poses = {"estimate_root": small.truth.refitted_root, "estimate_angles": small.truth.refitted_angles}
    assert small.evaluate(by_name).metrics["mpjpe_mm"] == pytest.approx(10 * 3**0.5)
    assert "silhouette_iou" in small.evaluate(poses).metrics
    joints = {name: small.truth.joints[:, index] for index, name in enumerate(small.truth.joint_names.tolist())}
    ours = {name: points for name, points in joints.items() if name in small.joint_names}
    assert len(ours) > 5
    assert small.evaluate(ours).metrics["mpjpe_mm"] < 100


@pytest.mark.parametrize(
    ("estimate", "names", "message"),
    [
        (lambda t: t.astype(object), None, r"expected numbers of shape .*, found object of shape \(19, 15, 3\)"),
        (lambda t: t.astype(np.float16), None, r"found float16 of shape \(19, 15, 3\)"),
        (
            lambda t: t[:, :14],
            None,
            r"15 points \(thorax, pelvis, .*\), found float64 of shape \(\d+, 14, 3\)",
        ),
        (lambda t: t[..., :2], None, r"found float64 of shape \(\d+, 15, 2\)"),
        (lambda t: t, ["nose"] * 2, r"of 2 points \(nose, nose\)"),
        (lambda t: t[:-2], None, "it has 17 frames, the set 19"),
        (lambda t: t[:, :2], ["left_nose", "tail"], "is not a marker"),
        (lambda t: {"pelvis": t[:, 0], "thorax": t[:3, 1]}, None, "found 'thorax' of shape"),
        (lambda t: {}, None, "empty dictionary"),
        (lambda t: None, None, "found NoneType None"),
        (lambda t: [[1, 2], [3]], None, "found a list of parts that differ in shape"),
        (lambda t: t, "pelvis", r"expected names=\[\.\.\.\] of text, one for each point, found str 'pelvis'"),
        (lambda t: t * 1000, None, r"^the array: .* seems to be in millimetres \(units='mm'\), expected metres"),
    ],
)
def test_a_wrong_estimate_says_what_came_and_what_is_expected(small, estimate, names, message):
    with pytest.raises(skiagraph.InputError, match=message):
        small.evaluate(estimate(small.truth.markers), names)


def test_declared_units_axes_and_names_are_passed_on(small):
    truth, names = small.truth.markers, small.truth.marker_names.tolist()
    other = 1000 * truth[..., [1, 2, 0]]
    theirs = [f"my {name}" for name in names]
    result = small.evaluate(other, theirs, units="mm", axes="y,z,x", joint_map=dict(zip(theirs, names, strict=True)))
    assert result.metrics["mpjpe_mm"] < 1e-6
    shifted = small.evaluate(np.roll(truth, 2, axis=0)[2:], shift=0, offset=(0.0, 0.0, 0.5))
    assert shifted.metrics["mpjpe_mm"] > 400
    exchanged = small.evaluate(truth[..., [1, 0, 2]] * [1, 1, 1])
    assert exchanged.hint is not None


def test_results_in_a_folder_are_replaced_only_where_that_is_said(small, tmp_path):
    first = small.evaluate(small.truth.markers + 0.01, out=tmp_path / "mine")
    with pytest.raises(skiagraph.InputError, match=r"mine has results already; .* with force=True"):
        small.evaluate(small.truth.markers + 0.02, out=tmp_path / "mine")
    again = small.evaluate(small.truth.markers + 0.02, out=tmp_path / "mine", force=True)
    assert again.path == first.path == tmp_path / "mine"
    assert again.metrics["mpjpe_mm"] == pytest.approx(20 * 3**0.5)
    # an older object does not take over the newer numbers
    assert first.metrics["mpjpe_mm"] == pytest.approx(10 * 3**0.5)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "precious").write_text("")
    with pytest.raises(skiagraph.InputError, match="other"):
        small.evaluate(small.truth.markers, out=tmp_path / "other")


def test_a_file_is_measured_beside_itself_and_not_changed(small, tmp_path):
    file = tmp_path / "mine.npz"
    np.savez(file, fps=small.fps, estimate_markers=small.truth.markers, marker_names=small.truth.marker_names)
    before = file.read_bytes()
    result = small.evaluate(file)
    assert result.path == tmp_path / "mine.npz-evaluation"
    assert file.read_bytes() == before
    assert skiagraph.Result(result.path).metrics == result.metrics


def test_results_for_notebooks(small):
    result = small.evaluate(small.truth.markers + 0.01)
    html = result._repr_html_()
    assert html.startswith("<pre>")
    assert "data:image/" in html
    assert "protocol" not in repr(result)


def test_a_table_for_pandas(small):
    pytest.importorskip("pandas")
    table = small.evaluate(small.truth.markers + 0.01).to_frame()
    assert table.loc["mpjpe_mm", "mean"] == pytest.approx(10 * 3**0.5)
    assert table.loc["mpjpe_mm", "unit"] == "mm"


def test_without_pandas_the_rest_works(small, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    result = small.evaluate(small.truth.markers)
    assert result.metrics
    with pytest.raises(ImportError, match=r"^to_frame needs the package pandas \(pip install") as raised:
        result.to_frame()
    assert isinstance(raised.value, skiagraph.MissingPackageError)


def test_tables_name_trackers_and_no_temporary_folders(small):
    class Noisy:
        def start(self, info):
            self.random = np.random.default_rng(info.seed)

        def track(self, frame):
            return {name: place + self.random.normal(0, 0.01) for name, place in frame.info.start.markers.items()}

    one, two = (skiagraph.track(small, Noisy, seeds=3) for _ in range(2))
    names = [run.path.name for run in (one, two)]
    assert names[0] != names[1]
    assert all(name.startswith("Noisy") for name in names)
    text = str(skiagraph.compare(one, two))
    assert f"\n{names[1]} (external) against {names[0]}" in text
    assert str(one.path.parent) not in text
    assert "read the array: metres (assumed)" in str(small.evaluate(small.truth.markers))


def test_what_a_hint_advises_is_keywords(small):
    with pytest.raises(skiagraph.InputError, match=r"use shift with the set's frame"):
        small.evaluate(small.truth.markers[2:])
    with pytest.raises(skiagraph.InputError, match="invalid value 'ell' for 'units'") as raised:
        small.evaluate(small.truth.markers, units="ell")
    assert (raised.value.fields["kind"], raised.value.fields["found"]) == ("usage", "ell")
    exchanged = small.truth.markers[..., [0, 2, 1]]
    result = small.evaluate(exchanged)
    assert "the array: its axes are x,z,y" in result.hint
    assert result.hint in str(result)
    assert result.corrections == {"axes": "x,z,y"}
    assert small.evaluate(exchanged, **result.corrections).metrics["mpjpe_mm"] < 1e-6
    reverse = small.evaluate(small.truth.markers[:, ::-1])
    assert reverse.corrections["joint_map"]["head_top"] == "thorax"
    assert small.evaluate(small.truth.markers[:, ::-1], **reverse.corrections).metrics["mpjpe_mm"] < 1e-6
    with pytest.raises(skiagraph.InputError, match="expected offset as three numbers in metres, found str 'north'"):
        small.evaluate(small.truth.markers, offset="north")


def test_estimates_of_a_known_pipeline_have_its_axes_and_names(small, tmp_path):
    with pytest.raises(skiagraph.InputError, match="invalid value 'mediapipe' for 'pipeline'"):
        small.evaluate(small.truth.markers, pipeline="mediapipe")


def test_measures_that_are_read_again_are_printed_with_their_verdict(small):
    result = small.evaluate(small.truth.markers + 0.01)
    again = str(skiagraph.Result(result.path))
    assert again == str(result)
    assert result.record["verdict"]["line"] in again


def test_comparing_runs(draws):
    found = skiagraph.compare(draws[0.0], draws[0.3])
    assert "HumanEva 3-D error, mm" in str(found)
    assert found.record
    assert "<pre>" in found._repr_html_()


def test_the_gate_passes_fails_and_is_inconclusive(draws, tmp_path):
    path = skiagraph.save_baseline("mine", draws[0.0], baselines=tmp_path)
    assert path == tmp_path / "mine.json"
    same = skiagraph.gate(draws[0.0], "mine", 2, baselines=tmp_path)
    assert same
    assert same.verdict is skiagraph.Verdict.PASS
    assert str(same).startswith("PASS")
    worse = skiagraph.gate(draws[0.3], path, margin_mm=2)
    assert worse.verdict is skiagraph.Verdict.FAIL
    assert not worse
    assert "humaneva_mm" in str(worse)
    with pytest.raises(skiagraph.InputError, match=r"absent\.json: no baseline has this name"):
        skiagraph.gate(draws[0.0], "absent", 2, baselines=tmp_path)
    with pytest.raises(skiagraph.InputError, match=r"absent\.json: no baseline is here; save_baseline"):
        skiagraph.gate(draws[0.0], tmp_path / "absent.json", 2)
    with pytest.raises(skiagraph.InputError, match=r"^margin: no margin is given: use margin='2mm'"):
        skiagraph.gate(draws[0.0], "mine", baselines=tmp_path)
    with pytest.raises(skiagraph.InputError, match="at least one run"):
        skiagraph.gate([], "mine", 2)


def test_an_inconclusive_gate(small, tmp_path):
    def noisy(scale):
        class Noisy:
            def start(self, info):
                self.shift = np.random.default_rng(info.seed + int(1000 * scale)).normal(0, scale)

            def track(self, frame):
                return {name: place + [self.shift, 0, 0] for name, place in frame.info.start.markers.items()}

        return skiagraph.track(small, Noisy, seeds=5)

    skiagraph.save_baseline("noisy", noisy(0.1), baselines=tmp_path)
    found = skiagraph.gate(noisy(0.101), "noisy", margin_mm=2, baselines=tmp_path)
    assert found.verdict is skiagraph.Verdict.INCONCLUSIVE
    assert "more" in str(found)


def test_a_sweep_yields_its_cells(shipped, tmp_path):
    scenario = shipped / "smoke" / "matched.toml"
    cells = list(skiagraph.sweep(scenario, {"particles": [5, 10]}, {"layers": 2}, seeds=3, out=tmp_path / "sweep"))
    assert [(cell.axes["particles"], cell.seed) for cell in cells] == [(n, seed) for n in (5, 10) for seed in range(3)]
    assert all(cell.status == "ok" and cell.metrics["humaneva_mm"] > 0 for cell in cells)
    again = skiagraph.sweep(scenario, {"particles": [5, 10]}, {"layers": 2}, seeds=3, out=tmp_path / "sweep")
    assert len(again) == 6
    assert "particles=5" in str(again)


def test_masked_points_of_an_estimate_are_missing_and_not_numbers(small):
    truth = small.truth.markers
    spoiled, mask = truth.copy(), np.zeros(truth.shape, bool)
    spoiled[:, 4] += 1000.0
    mask[:, 4] = True
    masked = np.ma.array(spoiled, mask=mask)
    wanted = small.evaluate(np.where(mask, np.nan, truth)).metrics
    names = small.truth.marker_names.tolist()
    by_name = {name: masked[:, index] for index, name in enumerate(names)}
    of_file = {"estimate_markers": masked[None], "marker_names": np.array(names), "seeds": np.arange(1)}
    for form in (masked, list(masked), by_name, of_file):
        assert small.evaluate(form).metrics == wanted
    mask[:, 4, 1:] = False
    with pytest.raises(skiagraph.InputError, match="expected three finite numbers or three NaN"):
        small.evaluate(np.ma.array(truth, mask=mask))


def test_names_that_would_be_ignored_are_refused(small, tmp_path):
    names = small.truth.marker_names.tolist()
    np.savez(tmp_path / "mine.npz", fps=small.fps, estimate_markers=small.truth.markers, marker_names=names)
    by_name = {name: small.truth.markers[:, index] for index, name in enumerate(names)}
    run = skiagraph.track(small, lambda frame: frame.info.start.markers)
    for estimate in (tmp_path / "mine.npz", by_name, run):
        with pytest.raises(skiagraph.InputError, match="names are those of an array's points"):
            small.evaluate(estimate, names[::-1])


def test_a_second_margin_that_would_be_ignored_is_refused(draws):
    with pytest.raises(skiagraph.InputError, match=r"one margin, found margin_mm=100 and margin='0\.001mm'"):
        skiagraph.gate(draws[0.0], "mine", margin_mm=100, margin="0.001mm")


def test_what_is_no_run_is_an_input_error(draws, tmp_path):
    with pytest.raises(skiagraph.InputError, match="expected the folder of a run, but it has no files of one"):
        skiagraph.Run(tmp_path)
    (tmp_path / "poses.npz").write_bytes(b"PK")
    with pytest.raises(skiagraph.InputError, match=r"poses\.npz: expected arrays that skiagraph wrote, but"):
        skiagraph.Run(tmp_path).estimate  # noqa: B018
    for wrong, kind in ((np.zeros(3), "float64"), (3, "int"), (None, "NoneType")):
        with pytest.raises(skiagraph.InputError, match=f"its folder or several of them, found {kind}"):
            skiagraph.compare(draws[0.0], wrong)


def test_an_axis_with_one_value_is_in_the_cells(shipped):
    scenario = shipped / "smoke" / "matched.toml"
    cells = list(
        skiagraph.sweep(scenario, {"layers": 2, "rig.ring.count": np.array([2]), "particles": [5, 6]}, seeds=1)
    )
    assert [cell.axes for cell in cells] == [{"layers": 2, "rig.ring.count": 2, "particles": n} for n in (5, 6)]
    (cell,) = skiagraph.sweep(scenario, {"particles": [5], "layers": [2]}, seeds=1, pair=True)
    assert cell.axes == {"particles": 5, "layers": 2}


def test_axes_without_values_or_partners_are_refused(shipped):
    scenario = shipped / "smoke" / "matched.toml"
    with pytest.raises(skiagraph.InputError, match="axis particles: expected at least one value"):
        skiagraph.sweep(scenario, {"particles": []})
    for layers in ([2], [1, 2, 3]):
        with pytest.raises(skiagraph.InputError, match=f"to pair them, found particles 2, layers {len(layers)}"):
            skiagraph.sweep(scenario, {"particles": [5, 10], "layers": layers}, pair=True)


def noisy(of, first=0, seeds=5):
    """A run whose seeds differ by a tenth of a metre."""

    class Noisy:
        def start(self, info):
            self.shift = np.random.default_rng(info.seed + first).normal(0, 0.1)

        def track(self, frame):
            return {name: place + [self.shift, 0, 0] for name, place in frame.info.start.markers.items()}

    return skiagraph.track(of, Noisy, seeds=seeds)


def test_an_inconclusive_gate_of_a_tracker_in_this_process_advises_no_command(small, tmp_path):
    skiagraph.save_baseline("noisy", noisy(small), baselines=tmp_path)
    found = skiagraph.gate(noisy(small, 100), "noisy", margin_mm=2, baselines=tmp_path)
    assert found.verdict is skiagraph.Verdict.INCONCLUSIVE
    assert "bridge" not in str(found)
    assert "skiagraph " not in str(found)
    # as many do decide it
    more = int(re.search(r"(\d+) more seeds of run and baseline", str(found))[1])
    skiagraph.save_baseline("noisy", noisy(small, seeds=5 + more), baselines=tmp_path)
    again = skiagraph.gate(noisy(small, 100, seeds=5 + more), "noisy", margin_mm=2, baselines=tmp_path)
    assert str(again) != str(found)


def test_the_command_of_a_run_does_not_depend_on_where_python_is(small):
    assert sys.prefix not in noisy(small, seeds=1).program["command"]
    assert str(Path(skiagraph.__file__).parent) not in noisy(small, seeds=1).program["command"]


def test_too_few_or_equal_seeds_say_what_to_do(small, tmp_path):
    with pytest.raises(skiagraph.InputError, match=r"expected 5 or more seeds .* seeds=10, "):
        skiagraph.save_baseline("noisy", noisy(small, seeds=2), baselines=tmp_path)
    with pytest.raises(skiagraph.InputError, match=r"the 5 runs of `walk` are identical, "):
        skiagraph.save_baseline("still", skiagraph.track(small, "frozen", seeds=5), baselines=tmp_path)
    skiagraph.save_baseline("noisy", noisy(small), baselines=tmp_path)
    with pytest.raises(skiagraph.InputError, match=r"the run has 3 seed\(s\) .* seeds=5, "):
        skiagraph.gate(noisy(small, seeds=3), "noisy", margin_mm=2, baselines=tmp_path)


@pytest.mark.parametrize("margin", ["2 mm", "nonsense", True, [2]])
def test_a_margin_that_is_no_number_says_what_is_expected(draws, margin):
    with pytest.raises(skiagraph.InputError, match=r"margin_mm: expected a number of millimetres, found .*; margin "):
        skiagraph.gate(draws[0.0], "mine", margin_mm=margin)


def test_a_margin_without_unit_says_what_is_expected(draws):
    with pytest.raises(skiagraph.InputError, match=r"margin: expected text with a unit, as in '2mm', found 2"):
        skiagraph.gate(draws[0.0], "mine", margin=2)


def test_relative_paths_stay_valid_when_the_working_folder_changes(small, tmp_path, monkeypatch):
    shutil.copytree(small.path, tmp_path / "a" / "walk")
    (tmp_path / "b").mkdir()
    monkeypatch.chdir(tmp_path / "a")
    walk = skiagraph.Set("walk", truth_at="walk")
    few = {"particles": 5, "layers": 1}
    run = skiagraph.track(walk, "annealed_particle_filter", settings=few, out="run", seeds=5)
    of_array = walk.evaluate(walk.truth.markers, out="measured")
    baseline = skiagraph.save_baseline("mine", run, baselines="baselines")
    opened = skiagraph.Run("run", of=walk)
    monkeypatch.chdir(tmp_path / "b")
    assert walk.masks(0)[0].any()
    assert walk.truth.joints.shape[0] == walk.frames
    assert run.estimate["estimate_markers"].shape[0] == 5
    assert opened.evaluate().metrics == run.evaluate().metrics
    assert of_array.per_frame["mpjpe_mm"].shape == (1, walk.frames)
    assert "data:image/" in of_array._repr_html_()
    assert skiagraph.gate(run, baseline, margin_mm=2)
    assert list((tmp_path / "b").iterdir()) == []


def test_tables_show_paths_below_the_working_folder_as_they_were_given(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runs = [skiagraph.track(small, "frozen", out=f"runs/{name}") for name in ("old", "new")]
    assert str(tmp_path) not in str(skiagraph.compare(*runs))


@pytest.mark.parametrize("wrong", [3, None, b"runs", "", ["runs"]])
def test_what_is_no_path_says_what_came(small, wrong):
    calls = [
        lambda: skiagraph.Set(wrong),
        lambda: skiagraph.Run(wrong),
        lambda: skiagraph.Result(wrong),
        lambda: skiagraph.evaluate(wrong, small.truth.markers),
        lambda: skiagraph.track(wrong, "frozen"),
        lambda: skiagraph.gate(small.path, wrong, 2),
    ]
    if wrong is not None:
        calls += [
            lambda: skiagraph.Set(small.path, truth_at=wrong),
            lambda: skiagraph.track(small, "frozen", out=wrong),
            lambda: skiagraph.render("walk", wrong),
            lambda: skiagraph.render(wrong),
            lambda: small.evaluate(small.truth.markers, out=wrong),
            lambda: small.evaluate(small.truth.markers, joint_map=wrong),
            lambda: skiagraph.save_baseline("x", small.path, baselines=wrong),
        ]
    expected = f"expected a path as text or pathlib.Path, found {type(wrong).__name__}"
    for call in calls:
        with pytest.raises(skiagraph.InputError, match=expected):
            call()


def test_a_switch_that_is_neither_true_nor_false_is_refused(small):
    for switch in ("swap_sides", "force"):
        for value in ("no", 1, 0.0):
            with pytest.raises(skiagraph.InputError, match=rf"^{switch}: expected True or False, found \w+ "):
                small.evaluate(small.truth.markers, **{switch: value})
    assert small.evaluate(small.truth.markers, swap_sides=np.False_).metrics["mpjpe_mm"] < 1e-6


def test_a_run_whose_folder_is_missing_says_so(tmp_path):
    for read in (lambda run: run.program, lambda run: run.evaluate(), lambda run: run.incidents):
        with pytest.raises(skiagraph.InputError, match="expected the folder of a run, but there is no such folder"):
            read(skiagraph.Run(tmp_path / "nowhere"))
    with pytest.raises(skiagraph.InputError, match="nowhere is no folder, or no longer; "):
        skiagraph.Result(tmp_path / "nowhere")


def _answers(small, off):
    return lambda frame: small.truth.markers[frame.index] + off


def test_changed_estimates_are_compared_by_their_new_measures(small, tmp_path):
    for name, off in (("a", 0.01), ("b", 0.02)):
        skiagraph.track(small, _answers(small, off), out=tmp_path / name).evaluate()
    arrays = dict(np.load(tmp_path / "b" / "poses.npz"))
    np.savez(tmp_path / "b" / "poses.npz", **{**arrays, "estimate_markers": arrays["estimate_markers"] + 0.05})
    changed = skiagraph.Run(tmp_path / "b", small)
    wanted = small.evaluate(arrays["estimate_markers"] + 0.05).metrics["mpjpe_mm"]
    assert changed.evaluate().metrics["mpjpe_mm"] == pytest.approx(wanted)
    found = skiagraph.compare(skiagraph.Run(tmp_path / "a", small), changed)
    assert f"{changed.evaluate().metrics['humaneva_mm']:.1f}" in str(found)
    with pytest.raises(skiagraph.InputError, match=r"use what skiagraph.Run\(.*\).evaluate\(\) returns"):
        skiagraph.compare(tmp_path / "a", tmp_path / "b")


def test_results_whose_folder_has_others_are_not_compared(small, tmp_path):
    first = small.evaluate(small.truth.markers + 0.01, out=tmp_path / "both")
    second = small.evaluate(small.truth.markers + 0.03, out=tmp_path / "both", force=True)
    for use in (lambda: skiagraph.compare(first, second), lambda: skiagraph.save_baseline("x", first)):
        with pytest.raises(skiagraph.InputError, match="it was changed, or replaced by other results"):
            use()


def test_a_run_whose_folder_was_tracked_again_is_refused(small, tmp_path):
    first = skiagraph.track(small, _answers(small, 0.01), out=tmp_path / "run")
    again = skiagraph.track(small, _answers(small, 0.03), out=tmp_path / "run", force=True)
    uses = (first.evaluate, lambda: first.estimate, lambda: small.evaluate(first))
    for use in (*uses, lambda: skiagraph.compare(first, again)):
        with pytest.raises(skiagraph.InputError, match="was tracked again since this run was opened"):
            use()
    assert again.evaluate().metrics["mpjpe_mm"] == pytest.approx(30 * np.sqrt(3))


def test_a_record_cannot_be_changed_in_place(small):
    result = small.evaluate(small.truth.markers)
    with pytest.raises(TypeError, match="cannot be changed in place"):
        result.record["metrics"]["mpjpe_mm"]["mean"] = 1.0


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.int64, np.longdouble, np.float32, ">f8", ">i4"])
def test_numbers_of_every_width_are_measured(small, dtype):
    truth = np.round(10 * small.truth.markers)
    floor = np.clip(truth, 0, 200)
    wanted = small.evaluate(floor, units="cm").metrics
    assert small.evaluate(floor.astype(dtype), units="cm").metrics == pytest.approx(wanted, rel=1e-5, nan_ok=True)
    names = small.truth.marker_names
    of_file = {"estimate_markers": floor.astype(dtype)[None], "marker_names": names, "seeds": np.arange(1)}
    assert small.evaluate(of_file, units="cm").metrics == pytest.approx(wanted, rel=1e-5, nan_ok=True)


@pytest.mark.parametrize(
    ("dtype", "found"),
    [
        (np.float16, r"float16 of shape .*; keep estimates in float32"),
        (complex, "complex128 of shape"),
        (object, "object of shape"),
        (bool, "bool of shape"),
        (str, r"<U\d+ of shape"),
        ("S9", r"\|S9 of shape"),
        ("timedelta64[s]", "timedelta64"),
    ],
)
def test_what_is_no_number_is_refused_with_its_type(small, dtype, found):
    wrong = np.ones(small.truth.markers.shape).astype(dtype)
    names = small.truth.marker_names
    of_file = {"estimate_markers": wrong[None], "marker_names": names, "seeds": np.arange(1)}
    by_name = {name: wrong[:, index] for index, name in enumerate(names.tolist())}
    for form in (wrong, by_name, *([] if dtype in (str, bool, "S9") else [of_file])):
        with pytest.raises(skiagraph.InputError, match=found):
            small.evaluate(form)


def test_names_that_are_no_list_of_text_are_refused(small):
    for names, found in ((5, "found int 5"), ([1] * 15, r"found list \[1, 1, "), ("pelvis", "found str 'pelvis'")):
        with pytest.raises(skiagraph.InputError, match=found):
            small.evaluate(small.truth.markers, names)


def test_names_of_unknown_points_list_what_is_known(small):
    points = small.truth.markers[:, 0]
    with pytest.raises(skiagraph.InputError, match=r'"zonk" is not a marker of HumanEva; expected thorax, '):
        small.evaluate({"zonk": points})
    with pytest.raises(skiagraph.InputError, match=r"\(thorax, .*\) or of joints .*, found names of both"):
        small.evaluate({"pelvis": points, "left_knee_flexion": points})


def test_a_misspelt_name_among_own_ones_is_named(small):
    joints = {**dict.fromkeys(small.joint_names, (0.0, 0.0, 1.0)), "kneee": (0.0, 0.0, 1.0)}
    with pytest.raises(skiagraph.InputError, match=r"the answer to frame 0: expected names of .*, found kneee;"):
        small.evaluate(dict.fromkeys(range(small.frames), joints))


def test_joints_of_which_none_is_at_a_marker_are_not_called_missing(small):
    with pytest.raises(
        skiagraph.InputError, match=r"at a marker: head_flexion, .*; without: spine_flexion, "
    ) as raised:
        small.evaluate({"spine_flexion": small.truth.markers[:, 0]})
    assert "NaN" not in str(raised.value)


def test_keys_of_axes_are_found_in_both_spellings(shipped):
    few = {"particles": 5, "layers": 1}
    cells = skiagraph.sweep(shipped / "smoke" / "matched.toml", {"rig__ring__count": [1, 2]}, few, seeds=1)
    for cell, count in zip(cells, (1, 2), strict=True):
        assert cell.axes == {"rig.ring.count": count}
        assert cell.axes["rig__ring__count"] == cell.axes["rig.ring.count"] == count
        with pytest.raises(KeyError):
            cell.axes["rig__ring__radius_m"]


def test_a_gate_of_another_tracker_in_this_process_says_its_name(small, tmp_path):
    skiagraph.save_baseline("noisy", noisy(small), baselines=tmp_path)
    run = skiagraph.track(small, lambda frame: frame.info.start.markers, seeds=5)
    found = str(skiagraph.gate(run, "noisy", margin_mm=2, baselines=tmp_path))
    assert 'the tracker\'s settings differ from the baseline\'s: name "Noisy" → "lambda_' in found
    assert "_SKIAGRAPH" not in found


def test_points_of_other_names_may_be_given_by_frame(small):
    points = small.truth.joints_as("coco17")
    by_frame = {frame: {name: at[frame] for name, at in points.items()} for frame in range(1, small.frames)}
    stacked = {name: at.copy() for name, at in points.items()}
    for at in stacked.values():
        at[0] = np.nan
    assert small.evaluate(by_frame).metrics == small.evaluate(stacked).metrics
    hip = {frame: {"hip_l": small.truth.markers[frame, 8]} for frame in range(small.frames)}
    assert small.evaluate(hip, joint_map={"hip_l": small.marker_names[8]}).metrics["mpjpe_mm"] == 0


def test_a_first_frame_without_an_answer_is_told(small):
    noise = np.random.default_rng(1).normal(0, 0.02, small.truth.markers.shape)
    late = {frame + 1: points for frame, points in enumerate(small.truth.markers[:-1] + noise[:-1])}
    with pytest.warns(skiagraph.MisreadWarning, match="no answer to frame 0: frames count from 0"):
        small.evaluate(late)


def test_a_set_is_no_estimate(small):
    with pytest.raises(skiagraph.InputError, match="expected an estimate, found a set"):
        small.evaluate(small)


def test_a_stuck_tracker_that_lost_its_first_frames_is_not_misread(tmp_path):
    walk = skiagraph.render("walk", tmp_path / "walk", loop_to_s=1.0, size_px=[96, 72])
    stuck = {"root": walk.start.root, "angles": walk.start.angles}
    assert walk.evaluate(dict.fromkeys(range(20, len(walk)), stuck)).hint is None


def test_keys_that_count_from_1_are_told(small):
    answers = {frame + 1: small.truth.markers[frame] for frame in range(small.frames - 1)}
    with pytest.warns(skiagraph.MisreadWarning, match="as if it counted from 1"):
        result = small.evaluate(answers)
    assert result.corrections == {"shift": -1}


def test_a_run_reads_its_estimate_as_the_message_says(small):
    angles = small.start.angles
    degrees = skiagraph.track(small, lambda frame: {"root": frame.info.start.root, "angles": np.full_like(angles, 30)})
    with pytest.raises(skiagraph.InputError, match="angles='rad'"):
        degrees.evaluate()
    assert degrees.evaluate(angles="rad").metrics["mpjpe_mm"] > 0


def test_corrections_keep_what_was_given(small):
    exchanged = 100 * small.truth.markers[:, ::-1][..., [0, 2, 1]]
    given = {"names": small.marker_names[::-1], "units": "cm"}
    corrections = small.evaluate(exchanged, **given).corrections
    assert corrections == {**given, "names": list(given["names"]), "axes": "x,z,y"}
    assert small.evaluate(exchanged, **corrections).metrics["mpjpe_mm"] < 1e-6
    # an offset that was given is not added to that of the hint
    moved = small.evaluate(small.truth.markers + [1, 2, 0], offset=[0, 0, 1])
    assert "offset=(-1,-2,0). The offset was derived" in moved.hint
    assert small.evaluate(small.truth.markers + [1, 2, 0], **moved.corrections).metrics["mpjpe_mm"] < 1e-6
    needless = small.evaluate(small.truth.markers, axes="x,z,y", units="m")
    assert needless.corrections == {"units": "m"}


def test_a_sweep_file_is_refused_before_it_is_rendered_and_can_be_swept(tmp_path):
    text = 'schema = "skiagraph.sweep/1"\nname = "s"\nset = ["motion.loop_to_s=0.1", "rig.ring.size_px=[96, 72]"]\n'
    (tmp_path / "s.toml").write_text(f"{text}seeds = 1\n[axes]\nparticles = [3]\n")
    with pytest.raises(skiagraph.InputError, match=r"this is a sweep file; skiagraph\.sweep\('.*s\.toml'\) runs it"):
        skiagraph.render(tmp_path / "s.toml", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    (cell,) = skiagraph.sweep(tmp_path / "s.toml")
    assert cell.axes["particles"] == 3
