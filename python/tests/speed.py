"""Prints how quick the package is here: `python python/tests/speed.py`, with the package and its program installed.

Every time is the best of several, since other programs disturb it.
"""

import subprocess
import sys
import time

import numpy as np

import skiagraph


def best(work, repeat=7):
    """Seconds."""
    times = []
    for _ in range(repeat):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def import_time(module):
    code = f"import time; begun = time.perf_counter(); import {module}; print(time.perf_counter() - begun)"
    return min(float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(7))


def call_time(walk):
    """Seconds a frame of a tracker, without those in the tracker itself."""
    own = []

    def stay(frame):
        begun = time.perf_counter()
        markers = frame.info.start.markers
        own.append(time.perf_counter() - begun)
        return markers

    run = skiagraph.track(walk, stay, seeds=5)
    return 1 / run.program["timing"]["frames_per_second"] - np.mean(own)


def main():
    print(
        f"import skiagraph: {1000 * import_time('skiagraph'):.0f} ms, numpy alone {1000 * import_time('numpy'):.0f} ms"
    )
    for width, height in ((160, 120), (640, 480)):
        walk = skiagraph.render("walk", loop_to_s=2.0, size_px=[width, height], key="default")
        masks = walk.masks("cam00")
        ways = {
            "one by one": lambda masks=masks: [masks[frame].shape for frame in range(len(masks))],
            "in a loop": lambda masks=masks: [mask.shape for mask in masks],
            "masks[:]": lambda masks=masks: masks[:],
        }
        speeds = ", ".join(f"{name} {len(masks) / best(work):,.0f}" for name, work in ways.items())
        print(f"silhouettes of {width} x {height} a second: {speeds}")
    print(f"calling a tracker: {1000 * min(call_time(walk) for _ in range(3)):.2f} ms a frame beyond its own time")


if __name__ == "__main__":
    main()
