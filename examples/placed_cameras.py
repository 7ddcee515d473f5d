"""Tracks with two cameras that `skiagraph place` chose, with two at a right angle and with two opposite ones; prints a
table of results/placement.md.

    python3 examples/placed_cameras.py --mocap-dir CMU [--skiagraph PROGRAM] [--draws 10] > placed.md
    python3 examples/placed_cameras.py --mocap-dir CMU --takes 02_03 --draws 3 --heights 1.6    # a small case

Every run has its own seed and its own draw of the outlines' noise; three or more have an interval.
"""

import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

TAKES = ["02_03", "02_04", "16_35", "35_08", "49_01"]
SCENARIO = """
schema = "skiagraph.scenario/1"
name = "two"
[motion]
clip = "{clip}"
last_frame = 159
frames_per_second = 30.0
[actor]
robot = "tracker25"
[tracker_body]
robot = "tracker25"
mismatch = "none"
[observation]
silhouette = "corrupted"
[observation.corruption]
boundary_px = 1.0
[rig.ring]
count = 2
radius_m = 4.0
size_px = [320, 240]
[tracker.annealed_particle_filter]
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--mocap-dir", required=True)
    parser.add_argument("--skiagraph", default="skiagraph")
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--takes", nargs="*", default=TAKES)
    parser.add_argument("--heights", default="0.6,1.6,2.6", help="heights of the candidates, metres")
    arguments = parser.parse_args()
    print("| recording | cameras | bound, frame alone, mm | bound, filter, mm | measured, mm | 95 % interval |")
    print("|---|---|---:|---:|---:|---|")
    with tempfile.TemporaryDirectory() as folder:
        for take in arguments.takes:
            place = pathlib.Path(folder) / take
            place.mkdir()
            scenario = place / "two.toml"
            scenario.write_text(SCENARIO.format(clip=f"{take}.amc"))
            placed = place / "placement"
            call(arguments, ["place", scenario, "--cameras", "2", "--heights", arguments.heights, "--out", placed])
            layouts = {
                "placed": [placed / "scenario.toml"],
                "right angle": [scenario, "rig.ring.arc_deg=90"],
                "opposite": [scenario],
            }
            for name, words in layouts.items():
                print(row(arguments, place, name, words), flush=True)


def row(arguments, place, name, scenario):
    """Measures the bounds of a layout and the errors of the tracker; returns a row of the table."""
    bound = json.loads(call(arguments, ["bound", *scenario, "--every", "5", "--json"]))["sources"][0]
    sweep = ["sweep", *scenario, "--draws", "--seeds", arguments.draws, "--out", place / name, "--json"]
    found = json.loads(call(arguments, sweep))["summary"]["settings"][0]
    low, high = found["ci95"] or (math.nan, math.nan)
    numbers = f"{bound['alone_mm']:.1f} | {bound['filtered_mm']:.1f} | {found['mean']:.1f} | {low:.1f} to {high:.1f}"
    return f"| {place.name} | {name} | {numbers} |"


def call(arguments, words):
    """Runs the program; returns what it prints."""
    command = [arguments.skiagraph, *map(str, words), "--mocap-dir", arguments.mocap_dir, "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    main()
