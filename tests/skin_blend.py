"""Writes skin_blend.json: linear blend skinning of random vertices, evaluated with NumPy's 4 x 4 matrices.

Usage: python skin_blend.py > skin_blend.json

v = sum_i w_i T_i(pose) T_i(bind)^-1 v0. Frames are x y z qw qx qy qz.
"""
import json

import numpy as np

random = np.random.default_rng(16)
LINKS, VERTICES = 6, 80


def frames():
    rows = []
    for _ in range(LINKS):
        q = random.normal(size=4)
        q /= np.linalg.norm(q) * (1 if q[0] >= 0 else -1)
        rows.append([*random.uniform(-1, 1, 3), *q])
    return rows


def matrix(row):
    x, y, z, w, i, j, k = row
    m = np.eye(4)
    m[:3, :3] = [
        [1 - 2 * (j * j + k * k), 2 * (i * j - k * w), 2 * (i * k + j * w)],
        [2 * (i * j + k * w), 1 - 2 * (i * i + k * k), 2 * (j * k - i * w)],
        [2 * (i * k - j * w), 2 * (j * k + i * w), 1 - 2 * (i * i + j * j)],
    ]
    m[:3, 3] = [x, y, z]
    return m


bind, pose = frames(), frames()
moves = [matrix(now) @ np.linalg.inv(matrix(was)) for now, was in zip(pose, bind)]
vertices = random.uniform(-1, 1, (VERTICES, 3))
influences, expected = [], []
for vertex in vertices:
    count = random.integers(1, 5)
    links = sorted(random.choice(LINKS, count, replace=False).tolist())
    shares = random.uniform(0.1, 1, count)
    shares /= shares.sum()
    influences.append([[link, share] for link, share in zip(links, shares.tolist())])
    homogeneous = np.append(vertex, 1.0)
    expected.append(sum(share * (moves[link] @ homogeneous) for link, share in zip(links, shares))[:3].tolist())
print(json.dumps({"bind": bind, "pose": pose, "vertices": vertices.tolist(), "influences": influences,
                  "expected": expected}))
