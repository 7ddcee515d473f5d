"""A file for Rerun, read again with Rerun's own reader."""

import subprocess
import sys

import numpy as np
import pytest

import skiagraph

chunk = pytest.importorskip("rerun.chunk")


def columns(path, entity, name):
    """A column of an entity in the order of its times: seconds, and values as lists."""
    found = []
    for part in chunk.RrdReader(path).stream().to_chunks():
        if part.entity_path == entity and not part.is_static:
            table = part.to_record_batch()
            times = table.column("time").to_numpy(zero_copy_only=False).astype("timedelta64[ns]").astype(np.int64) / 1e9
            values = next(table.column(i) for i, field in enumerate(table.schema) if field.name.endswith(name))
            found += zip(times, values.to_pylist(), strict=True)
    return sorted(found)


def test_truth_estimates_and_silhouettes_are_in_the_file(small, tmp_path):
    run = skiagraph.track(small, lambda frame: frame.info.start.markers, seeds=2)
    skiagraph.to_rerun(small, run, tmp_path / "walk.rrd")
    for entity, points in [
        ("/world/truth", small.truth.markers),
        ("/world/estimate/0", run.estimate["estimate_markers"][0]),
        ("/world/estimate/1", run.estimate["estimate_markers"][1]),
    ]:
        found = columns(tmp_path / "walk.rrd", entity, "Points3D:positions")
        assert np.allclose([time for time, _ in found], np.arange(small.frames) / small.fps, atol=1e-6)
        assert np.allclose(np.array([places for _, places in found]), points, atol=1e-5)
    silhouettes = columns(tmp_path / "walk.rrd", "/world/cameras/cam00/silhouette", "EncodedImage:blob")
    file = small.path / "observations" / "cam00" / "silhouette" / "000003.png"
    assert bytes(np.ravel(silhouettes[3][1]).astype(np.uint8)) == file.read_bytes()

    bones = columns(tmp_path / "walk.rrd", "/world/truth/bones", "LineStrips3D:strips")[5][1]
    names, places = small.truth.marker_names.tolist(), small.truth.markers[5]
    drawn = {tuple(names[np.argmin(np.abs(places - end).sum(axis=1))] for end in bone) for bone in bones}
    assert len(bones) == len(drawn) == len(names) - 1
    assert {("pelvis", "left_hip"), ("left_hip", "left_knee"), ("left_knee", "left_ankle")} < drawn


def test_the_program_rerun_verifies_the_file(small, tmp_path):
    skiagraph.to_rerun(small, out=tmp_path / "walk.rrd")
    command = [sys.executable, "-m", "rerun", "rrd", "verify", str(tmp_path / "walk.rrd")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "1 file verified without error" in done.stdout + done.stderr


def test_an_existing_file_is_not_replaced(small, tmp_path):
    (tmp_path / "mine.rrd").write_bytes(b"mine")
    with pytest.raises(skiagraph.InputError, match="exists"):
        skiagraph.to_rerun(small, out=tmp_path / "mine.rrd")
    assert (tmp_path / "mine.rrd").read_bytes() == b"mine"
    assert len(list(tmp_path.iterdir())) == 1
