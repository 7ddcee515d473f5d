"""Plants single causes of error, and lets `skiagraph explain` find them; prints the table of results/explain.md.

    python3 examples/planted_causes.py --mocap-dir CMU [--skiagraph PROGRAM] [--seeds 2] > planted.md

The recordings are 02_03, 02_04, 16_35, 35_08 and 49_01 of the CMU database. The tracker's body is the actor's own, so
that nothing is wrong but the planted cause.
"""

import argparse
import hashlib
import json
import pathlib
import subprocess
import sys
import tempfile

TAKES = ["02_03", "02_04", "16_35", "35_08", "49_01"]
LATE = "rig.timing=[{}]".format(", ".join(f'{{camera = "cam{n:02}", offset_ms = 20.0}}' for n in range(4)))
# the planted cause, its name in the explanation, and the settings that plant it
PLANTED = [
    ("body 5 % too long", "body", []),
    ("cameras told 1 degree wrong", "cameras", ["calibration_deg=1"]),
    ("images 20 ms late", "time", [LATE]),
    ("outlines off by 8 px", "observations", ["observation.silhouette=corrupted", "boundary_px=8"]),
    ("start pose off by 0.3 rad a joint", "start", ["start_deg=17.19"]),
    ("the same, filter without refinement", "start", ["start_deg=17.19", "paper=true"]),
]
BASE = """
schema = "skiagraph.scenario/1"
name = "planted"
[motion]
clip = "{take}.amc"
frames_per_second = 30.0
frames = {frames}
[actor]
robot = "actor"
[tracker_body]
robot = "actor"
mismatch = "none"
[rig.ring]
count = 4
radius_m = 5.0
[tracker.annealed_particle_filter]
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mocap-dir", required=True)
    parser.add_argument("--skiagraph", default="skiagraph")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--takes", nargs="*", default=TAKES)
    arguments = parser.parse_args()
    print("| take | planted | error, mm | its part, mm | share | search, mm | remains, mm | sum - error, mm |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for take in arguments.takes:
            for words, player, settings in PLANTED:
                print(row(arguments, pathlib.Path(folder), take, words, player, settings), flush=True)


def row(arguments, folder, take, words, player, settings):
    """Plants one cause on one take; returns a row of the table."""
    place = pathlib.Path(tempfile.mkdtemp(dir=folder))
    (place / "planted.toml").write_text(BASE.format(take=take, frames=arguments.frames))
    mocap = ["--mocap-dir", arguments.mocap_dir, "--quiet"]
    seeds = ["--seeds", str(arguments.seeds)]
    known = mocap
    if player == "body":
        call(arguments, ["render", place / "planted.toml", "--out", place / "set", "--key", "default", *mocap])
        lengthen(place / "set")
        tracker = ["--tracker", "annealed_particle_filter"]
        call(arguments, ["track", place / "set", *tracker, *seeds, "--out", place / "run", "--quiet"])
        call(arguments, ["evaluate", place / "set", place / "run", "--quiet"])
        known = ["--set", place / "set"]
    else:
        call(arguments, ["run", place / "planted.toml", "--out", place / "run", *settings, *seeds, *mocap])
    found = json.loads(call(arguments, ["explain", place / "run", "--json", *known]))
    parts = {cause["player"]: cause["error_mm"] for cause in found["causes"]}
    error, part = found["error_mm"], parts[player]
    rest = sum(parts.values()) + found["rest_mm"] - error
    numbers = f"{error:.1f} | {part:.1f} | {100 * part / error:.0f} % | {parts.get('search', 0):.1f}"
    return f"| {take} | {words} | {numbers} | {found['rest_mm']:.1f} | {rest:.0e} |"


def lengthen(folder):
    """Makes the tracker's body in a set 5 % too long: its joints, markers and solids, with the same girths."""
    path = folder / "start/body.json"
    body = json.loads(path.read_text())
    points = [joint["origin"]["position"] for joint in body["joints"]]
    points += [marker["point"] for marker in body["markers"].values() if marker]
    points += [solid["tapered_capsule"][end] for link in body["links"] for solid in link["solids"] for end in ("a", "b")]
    for point in points:
        point[:] = [1.05 * x for x in point]
    path.write_text(json.dumps(body))
    listing = folder / "files.sha256"
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    lines = listing.read_text().splitlines()
    name = "  start/body.json"
    listing.write_text("".join((digest + name if line.endswith(name) else line) + "\n" for line in lines))


def call(arguments, words):
    """Runs the program; returns what it prints."""
    done = subprocess.run([arguments.skiagraph, *map(str, words)], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    main()
