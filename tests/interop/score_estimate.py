"""Scores an estimate independently and compares with the program: python3 score_estimate.py SET OUT PROGRAM

Needs only NumPy. Writes OUT/estimate.npz as another program's tracker might: markers only, their columns in another order and one of
them missing, single precision, Fortran order, compressed, an integer frame rate, NaN for frames and markers without an estimate.
Runs PROGRAM to evaluate it against SET, and computes the same errors from SET/truth/truth.npz.
"""

import json
import pathlib
import subprocess
import sys

import numpy as np

root, out, program = map(pathlib.Path, sys.argv[1:])
truth = np.load(root / "truth/truth.npz", allow_pickle=False)
markers, names, fps = truth["markers"], list(truth["marker_names"]), float(truth["fps"])
T, M = markers.shape[:2]
assert T > 45 and fps == int(fps)

random = np.random.default_rng(12)
estimate = markers[None] + random.normal([0.02, -0.01, 0.0], 0.03, (3, T, M, 3))
estimate[0, 7] = np.nan  # a frame without an estimate
estimate[0, 20:23] = np.nan
estimate[0, 30, names.index("left_wrist")] = np.nan  # one marker of a frame
estimate[1, 12:40] = np.nan  # a long run of lost frames
estimate[1, 42:, names.index("pelvis")] += [0.4, 0.0, 0.0]
estimate[2] = np.nan  # a seed that found nothing

order = [m for m in random.permutation(M) if names[m] != "head_top"]
estimate[:, :, names.index("head_top")] = np.nan
estimate = estimate.astype(np.float32)
np.savez_compressed(
    out / "estimate.npz",
    fps=np.int32(fps),
    seeds=np.array([3, 1, 8], dtype=np.int32),
    estimate_markers=np.asfortranarray(estimate[:, :, order]),
    marker_names=np.array([names[m] for m in order]),
    something_else=np.arange(3),
)
written = (out / "estimate.npz").read_bytes()
answer = subprocess.run([program, "evaluate", root, out / "estimate.npz", "--json", "--quiet"], capture_output=True, text=True)
assert answer.returncode == 0, answer.stderr
run = json.loads(answer.stdout)
assert (out / "estimate.npz").read_bytes() == written, "the estimate was changed"
assert json.loads((out / "estimate.npz-evaluation/run.json").read_text()) == run

# the same metrics in mm over frames 1 to T - 1, without the start pose
x, y = 1000.0 * markers[1:], 1000.0 * estimate[:, 1:].astype(np.float64)


def mean(values, axis=None):
    """The mean of all values but NaN; NaN if there are none."""
    count = np.sum(~np.isnan(values), axis=axis)
    return np.where(count > 0, np.nansum(values, axis=axis) / np.maximum(count, 1), np.nan)


def of_runs(per_frame):
    return [None if np.isnan(value) else float(value) for value in mean(per_frame, axis=1)]


def longest_runs(bad):
    """The share of frames within a run of at least 15 bad frames."""
    inside, start = np.zeros(len(bad)), 0
    for end in range(len(bad) + 1):
        if end == len(bad) or not bad[end]:
            if end - start >= 15:
                inside[start:end] = 1
            start = end + 1
    return inside.mean()


def after_similarity(p, q):
    """Distances after the similarity that brings p nearest to q (Umeyama 1991)."""
    both = ~np.isnan(p[:, 0])
    p, q = p[both], q[both]
    if len(p) < 3:
        return np.array([])
    p, q = p - p.mean(0), q - q.mean(0)
    U, s, Vt = np.linalg.svd(q.T @ p)
    D = np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))])
    return np.linalg.norm(p @ (U @ D @ Vt).T * np.trace(np.diag(s) @ D) / (p**2).sum() - q, axis=1)


distance = np.linalg.norm(y - x, axis=-1)
error = mean(distance, axis=2)
pelvis = names.index("pelvis")
relative = np.linalg.norm((y - y[:, :, [pelvis]]) - (x - x[:, [pelvis]]), axis=-1)
velocity = np.linalg.norm(np.diff(y - x, 1, axis=1), axis=-1) * fps
acceleration = np.linalg.norm(np.diff(y - x, 2, axis=1), axis=-1) * fps**2 / 1000.0
aligned = [np.concatenate([after_similarity(y[s, t], x[t]) for t in range(T - 1)]) for s in range(3)]
expected = {
    "humaneva_mm": of_runs(error),
    "mpjpe_mm": of_runs(distance.reshape(3, -1)),
    "mpjpe_root_mm": of_runs(relative.reshape(3, -1)),
    "pa_mpjpe_mm": [float(a.mean()) if len(a) else None for a in aligned],
    "velocity_error_mm_per_s": of_runs(mean(velocity, axis=2)),
    "acceleration_error_m_per_s2": of_runs(mean(acceleration, axis=2)),
    "pck150": (distance <= 150).mean(axis=(1, 2)).tolist(),
    "coverage": (~np.isnan(distance)).mean(axis=(1, 2)).tolist(),
    "lost_frames": np.isnan(error).mean(axis=1).tolist(),
    "track_loss": [longest_runs(~(error[s] <= 150)) for s in range(3)],
}
for name, values in expected.items():
    found = run["metrics"][name]["per_run"]
    for seed, (a, b) in enumerate(zip(values, found, strict=True)):
        assert (a is None) == (b is None) and (a is None or abs(a - b) <= 1e-9 * max(1.0, abs(a))), (name, seed, a, b)
    assert abs(run["metrics"][name]["coverage"] - np.mean(expected["coverage"])) < 1e-12, name
    known = [value for value in values if value is not None]
    assert abs(run["metrics"][name]["mean"] - np.mean(known)) <= 1e-9 * max(1.0, np.mean(known)), name

for name in ("silhouette_iou", "body_orientation_deg", "foot_skate_mm_per_s", "energy_gap"):
    assert name not in run["metrics"] and run["absent"][name].startswith("needs "), name
joint = {j["joint"]: j for j in run["per_joint"]}
wrist = ~np.isnan(distance[:, :, names.index("left_wrist")])
assert "head_top" not in joint and abs(joint["left_wrist"]["coverage"] - wrist.mean()) < 1e-12
print(f"numpy {np.__version__}: {len(expected)} metrics of {T} frames agree; coverage {np.mean(expected['coverage']):.3f}")
