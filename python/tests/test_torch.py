"""Windows of frames for PyTorch, tested by their arrays; with torch, whose wheel is large, where it is installed."""

import pickle

import numpy as np
import pytest

import skiagraph
from skiagraph.torch import SilhouetteDataset


@pytest.fixture(scope="module")
def index(small, tmp_path_factory):
    """A text file that names two sets."""
    folder = tmp_path_factory.mktemp("index")
    skiagraph.render("walk", folder / "blind", loop_to_s=0.3, size_px=[160, 120], truth=folder / "secret")
    (folder / "train.txt").write_text(f"{small.path}\nsecret\n")
    return folder / "train.txt"


def test_windows_are_the_frames_of_all_sets(index, small):
    windows = SilhouetteDataset(index, window=4, step=3, joints="smpl24", tensors=False)
    assert len(windows) == 12
    assert [(item["set"], item["frame"]) for item in windows][5:8] == [(0, 15), (1, 0), (1, 3)]
    item = windows[7]
    of = windows.sets[1]
    for offset, frame in enumerate(of[3:7]):
        assert np.array_equal(item["masks"][offset], frame.mask_array)
        assert np.allclose(item["R"][offset, 1], frame.views[1].camera.R)
        assert item["time"][offset] == pytest.approx(frame.time)
    pelvis = list(of.truth.joints_as("smpl24")).index("pelvis")
    markers = of.truth.markers[3:7, of.truth.marker_names.tolist().index("pelvis")]
    assert np.allclose(item["joints"][:, pelvis], markers, atol=1e-6)
    assert windows[-1]["frame"] == 15
    with pytest.raises(IndexError):
        windows[12]
    assert SilhouetteDataset(small, window=2, joints="markers", tensors=False)[0]["joints"].shape == (2, 15, 3)
    copied = pickle.loads(pickle.dumps(windows))
    assert np.array_equal(copied[7]["masks"], item["masks"])


def test_what_a_set_lacks_is_said_before_the_first_epoch(index, small, tmp_path):
    with pytest.raises(skiagraph.InputError, match=r"has no keypoints; render it with observation__keypoints"):
        SilhouetteDataset(small, keypoints=True, tensors=False)
    with pytest.raises(skiagraph.NoTruthError):
        SilhouetteDataset(index.parent / "blind", joints="markers", tensors=False)
    with pytest.raises(skiagraph.InputError, match="found 'coco'"):
        SilhouetteDataset(small, joints="coco", tensors=False)
    with pytest.raises(skiagraph.InputError, match="from 1, found 0"):
        SilhouetteDataset(small, window=0, tensors=False)
    with pytest.raises(skiagraph.InputError, match="a text file with a folder on every line"):
        SilhouetteDataset(tmp_path / "none.txt", tensors=False)


def test_without_torch_the_message_says_what_is_missing(small, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    with pytest.raises(skiagraph.MissingPackageError, match=r"SilhouetteDataset needs the package torch"):
        SilhouetteDataset(small)


def test_workers_load_tensors_and_pass_exceptions_on(index, small, tmp_path):
    torch = pytest.importorskip("torch", reason="the wheel of torch takes gigabytes; the arrays are tested above")
    loader = torch.utils.data.DataLoader(SilhouetteDataset(index, window=4, joints="markers"), 2, num_workers=2)
    batches = list(loader)
    assert batches[0]["masks"].shape == (2, 4, 4, 120, 160)
    assert batches[0]["masks"].dtype == torch.bool
    assert torch.cat([batch["frame"] for batch in batches]).tolist() == [0, 4, 8, 12, 0, 4, 8, 12]
    assert batches[0]["joints"].dtype == torch.float32

    import shutil

    spoiled = tmp_path / "spoiled"
    shutil.copytree(small.path, spoiled)
    (spoiled / "observations/cam01/silhouette/000003.png").write_bytes(b"no image")
    with pytest.raises(skiagraph.InputError, match=r"000003.png: expected a grey PNG"):
        list(torch.utils.data.DataLoader(SilhouetteDataset(spoiled), num_workers=1))
