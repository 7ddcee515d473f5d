"""Reads a benchmark set with numpy and the standard library alone: python3 read_set.py SET OUT

Checks that arrays load without pickles, have the documented shapes and fit together, and that OpenCV's camera model with
cameras.json sees the markers listed in `in_view`. Writes OUT/poses.npz, as another program's tracker would, for the Rust
test to read.
"""

import hashlib
import json
import pathlib
import sys

import numpy as np

root, out = map(pathlib.Path, sys.argv[1:])

for line in (root / "files.sha256").read_text().splitlines():
    digest, path = line.split("  ", 1)
    assert hashlib.sha256((root / path).read_bytes()).hexdigest() == digest, path

truth = np.load(root / "truth/truth.npz", allow_pickle=False)
T, n = truth["angles"].shape
L, J, C = len(truth["link_names"]), len(truth["joint_names"]), len(truth["camera_names"])
shapes = {
    "fps": (), "root": (T, 7), "angle_names": (n,), "link_frames": (T, L, 7), "joints": (T, J, 3),
    "markers": (T, 15, 3), "marker_names": (15,), "in_view": (T, C, 15), "visible": (T, C, 15),
    "refitted_root": (T, 7), "parents": (L,),
}
for name, shape in shapes.items():
    assert truth[name].shape == shape, (name, truth[name].shape, shape)
assert truth["root"].dtype == np.float64 and truth["in_view"].dtype == np.bool_
assert truth["marker_names"].dtype.kind == "U" and truth["marker_names"][0] == "thorax"
for rows in (truth["root"], truth["link_frames"]):
    assert np.allclose(np.linalg.norm(rows[..., 3:], axis=-1), 1) and (rows[..., 3] >= 0).all()
assert np.array_equal(truth["link_frames"][:, 0], truth["root"]), "link 0 is the root"
assert np.array_equal(truth["link_frames"][:, 1:, :3], truth["joints"]), "a joint is where the link that it moves begins"
assert not (truth["visible"] & ~truth["in_view"]).any()

cameras = json.loads((root / "cameras.json").read_text())["cameras"]
assert [c["name"] for c in cameras] == list(truth["camera_names"])
for index, c in enumerate(cameras):
    K, R, t = np.array(c["K"]), np.array(c["R"]), np.array(c["t"])
    k1, k2, p1, p2, k3 = c["distortion"]
    p = truth["markers"].reshape(-1, 3) @ R.T + t
    x, y = p[:, 0] / p[:, 2], p[:, 1] / p[:, 2]
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    u, v = K[0, 0] * xd + K[0, 2], K[1, 1] * yd + K[1, 2]
    # pixel centres at integers: the image reaches from -0.5 to size - 0.5
    inside = (u >= -0.5) & (u < c["width"] - 0.5) & (v >= -0.5) & (v < c["height"] - 0.5) & (p[:, 2] >= c["near"])
    assert np.array_equal(inside, truth["in_view"][:, index].ravel()), c["name"]

# the set's own reader
sys.path.insert(0, str(root))
from read_truth import read_truth

read = read_truth(root)
frames = read["world_from_link"]
assert frames.shape == (T, L, 4, 4) and np.allclose(frames[..., :3, :3] @ frames[..., :3, :3].swapaxes(-1, -2), np.eye(3))
assert np.allclose(np.linalg.det(frames[..., :3, :3]), 1) and np.array_equal(frames[:, 1:, :3, 3], truth["joints"])
assert read["time"][-1] == (T - 1) / truth["fps"]
assert truth["parents"][0] == -1 and (truth["parents"][1:] < np.arange(1, L)).all() and (truth["parents"][1:] >= 0).all()
# a link's place in its parent is the same in every frame, because joints only turn
parent = truth["parents"][1:]
offset = np.linalg.inv(frames[:, parent]) @ frames[:, 1:, :, 3:]
assert np.allclose(offset, offset[:1], atol=1e-9)

start = json.loads((root / "start/start.json").read_text())
assert len(start["angles"]) == len(start["angle_names"]) == n
assert start["angle_names"] == list(truth["refitted_angle_names"])

np.savez(
    out / "poses.npz",
    fps=truth["fps"],
    seeds=np.array([7], dtype=np.int64),
    estimate_root=truth["refitted_root"][None],
    estimate_angles=truth["refitted_angles"][None],
)
variety = {
    "<f4": np.float32, ">f8": ">f8", "<i4": np.int32, ">i2": ">i2", "|i1": np.int8, "|u1": np.uint8, "<u2": np.uint16, "<u8": np.uint64,
}
for save, name in ((np.savez, "stored.npz"), (np.savez_compressed, "compressed.npz")):
    numbers = {f"as_{kind}": np.arange(24).reshape(2, 3, 4).astype(dtype) for kind, dtype in variety.items()}
    fortran = np.asfortranarray(np.arange(24.0).reshape(2, 3, 4))
    save(out / name, joints=truth["joints"], fortran=fortran, names=np.array(["é", "knee"], dtype=">U4"), **numbers)
np.savez(out / "pickled.npz", fps=np.array([{"no": 1}], dtype=object))
print(f"numpy {np.__version__} read {T} frames, {L} links, {C} cameras")
