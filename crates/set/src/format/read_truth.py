"""Reads the truth of a benchmark set with NumPy alone: python3 read_truth.py [SET]"""

import pathlib
import sys

import numpy as np


def read_truth(folder):
    """All arrays by name; world_from_link (T, L, 4, 4) and time (T) are added. README.txt has axes, units and order."""
    found = [path for path in (pathlib.Path(folder) / "truth/truth.npz", pathlib.Path(folder) / "truth.npz") if path.exists()]
    truth = dict(np.load(found[0], allow_pickle=False))
    if (views := found[0].with_name("views.npz")).exists():
        truth |= np.load(views, allow_pickle=False)
    w, x, y, z = np.moveaxis(truth["link_frames"][..., 3:], -1, 0)
    links = np.zeros(w.shape + (4, 4))
    links[..., 0, :3] = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1)
    links[..., 1, :3] = np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1)
    links[..., 2, :3] = np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)
    links[..., :3, 3], links[..., 3, 3] = truth["link_frames"][..., :3], 1
    return truth | {"world_from_link": links, "time": np.arange(len(links)) / truth["fps"]}


if __name__ == "__main__":
    truth = read_truth(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    print(f"{len(truth['time'])} frames at {truth['fps']} a second;", ", ".join(f"{k} {v.shape}" for k, v in truth.items()))
