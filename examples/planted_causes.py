"""Explains errors with `skiagraph explain`; prints the tables of results/explain.md.

Planted causes of error must be found:

    python3 examples/planted_causes.py --mocap-dir CMU [--skiagraph PROGRAM] [--seeds 2] > planted.md
    python3 examples/planted_causes.py --takes embedded:walk --frames 15 --settings "rig.ring.size_px=[160,120]"
    python3 examples/planted_causes.py --mocap-dir CMU --among gym > planted-in-a-gym.md

The built-in trackers in a place, with a tracker's body that is not the actor's:

    python3 examples/planted_causes.py --mocap-dir CMU --among gym --trackers > trackers.md

The recordings are 02_03, 02_04, 16_35, 35_08 and 49_01 of the CMU database. The tracker's body is the actor's own, so
that nothing is wrong but the planted cause, or with --among the errors of a place.
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
clip = "{clip}"
frames_per_second = 30.0
frames = {frames}
[actor]
robot = "actor"
[tracker_body]
{body}
[rig.ring]
count = 4
radius_m = 5.0
[tracker.{tracker}]
"""
MATCHED = 'robot = "actor"\nmismatch = "none"'
UNMATCHED = 'robot = "tracker40"\ncalibrate = false'
TRACKERS = [("filter", "annealed_particle_filter"), ("keypoints", "keypoints")]
CAUSES = ["cameras", "observations", "time", "body", "search"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mocap-dir", help="directory of the recordings; not for embedded:walk")
    parser.add_argument("--skiagraph", default="skiagraph")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--takes", nargs="*", default=TAKES)
    parser.add_argument("--among", metavar="PRESET", help="plant on top of the errors of a place, such as gym")
    parser.add_argument("--trackers", action="store_true", help="explain the built-in trackers, without planting anything")
    parser.add_argument("--settings", nargs="*", default=[], metavar="KEY=VALUE", help="more settings of all scenarios")
    arguments = parser.parse_args()
    if arguments.among:
        arguments.settings.append(f"observation.preset={arguments.among}")
    with tempfile.TemporaryDirectory() as folder:
        table = of_trackers if arguments.trackers else of_planted
        for line in table(arguments, lambda: pathlib.Path(tempfile.mkdtemp(dir=folder))):
            print(line, flush=True)


def of_planted(arguments, new_folder):
    """The table of planted causes, line by line."""
    yield "| take | planted | error, mm | its part, mm | share | search, mm | remains, mm | excess, mm | part of it |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for take in arguments.takes:
        without = {}
        for words, player, settings in PLANTED:
            # the same tracker without the planted cause
            tracker = tuple(setting for setting in settings if setting == "paper=true")
            if tracker not in without:
                without[tracker] = explained(arguments, new_folder(), take, tracker)
            planted = explained(arguments, new_folder(), take, settings, longer=player == "body")
            yield row(take, words, player, planted, without[tracker])


def of_trackers(arguments, new_folder):
    """The table of the built-in trackers, line by line."""
    yield "| take | tracker | error | cameras | silhouettes or keypoints | timing | body | search | remains |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for words, tracker in TRACKERS:
        for take in arguments.takes:
            error, parts, rest = explained(arguments, new_folder(), take, [], tracker, UNMATCHED)
            numbers = [error, *(parts.get(cause) for cause in CAUSES), rest]
            cells = ["" if number is None else f"{number:.1f}" for number in numbers]
            yield f"| {take} | {words} | {' | '.join(cells)} |"


def row(take, words, player, planted, without):
    """A row of the table. The excess is what the planted cause adds to the error, and the part of it what it adds to
    the part of its cause."""
    (error, parts, rest), (error_before, parts_before, _) = planted, without
    part, excess = parts[player], error - error_before
    more = part - parts_before.get(player, 0)
    numbers = f"{error:.1f} | {part:.1f} | {100 * part / error:.0f} % | {parts.get('search', 0):.1f} | {rest:.1f}"
    return f"| {take} | {words} | {numbers} | {excess:.1f} | {100 * more / excess:.0f} % |"


def explained(arguments, place, take, settings, tracker=TRACKERS[0][1], body=MATCHED, longer=False):
    """Tracks a take with these settings and explains the run: its error, the parts by cause, and what remains."""
    clip = take if ":" in take else f"{take}.amc"
    (place / "planted.toml").write_text(BASE.format(clip=clip, frames=arguments.frames, body=body, tracker=tracker))
    mocap = ["--quiet"] + (["--mocap-dir", arguments.mocap_dir] if arguments.mocap_dir else [])
    seeds = ["--seeds", str(arguments.seeds)]
    settings = [*arguments.settings, *settings]
    known = mocap
    if longer:
        words = ["--out", place / "set", "--key", "default", *settings, *mocap]
        call(arguments, ["render", place / "planted.toml", *words])
        lengthen(place / "set")
        call(arguments, ["track", place / "set", "--tracker", tracker, *seeds, "--out", place / "run", "--quiet"])
        call(arguments, ["evaluate", place / "set", place / "run", "--quiet"])
        known = ["--set", place / "set"]
    else:
        call(arguments, ["run", place / "planted.toml", "--out", place / "run", *settings, *seeds, *mocap])
    found = json.loads(call(arguments, ["explain", place / "run", "--json", *known]))
    parts = {cause["player"]: cause["error_mm"] for cause in found["causes"]}
    return found["error_mm"], parts, found["rest_mm"]


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
