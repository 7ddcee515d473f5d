"""Measures how often the presets of places spoil a point, and writes the table of docs/places.md.

Usage: python tests/pipelines/places_shares.py PROGRAM [--check]
With --check the page is left as it is; the exit code is 1 if its table differs. Needs NumPy; takes 12 renders of the walk of five seconds.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy

PAGE = Path("docs/places.md")
MARKS = ("<!-- from tests/pipelines/places_shares.py -->\n", "<!-- end -->\n")
PLACES = ["studio", "gym", "outdoors"]
FAULTS = {"gross": "gross", "missing": "missed", "inversion": "inverted"}
DRAWS = 4


def shares(program, place, draw, folder):
    """The shares of a draw: {(fault, where): share}."""
    subprocess.run(
        [program, "render", "--quiet", "scenarios/walk.toml", "motion.loop_to_s=5", f"observation.preset={place}",
         f"observation.seed={draw}", "--key", "default", "--out", folder, "--force"],
        check=True, stdout=subprocess.DEVNULL,
    )
    points = numpy.load(f"{folder}/truth/keypoints.npz")
    codes = list(points["sight_names"])
    sight = points["sight"]
    in_view = sight == codes.index("in_view")
    in_image = sight != codes.index("out_of_view")
    has_side = numpy.array([name.startswith(("left_", "right_")) for name in points["keypoint_names"]])
    found = {}
    for fault, array in FAULTS.items():
        counted = has_side if fault == "inversion" else True
        for where, here in [("in plain sight", in_view), ("hidden", in_image & ~in_view), ("all", in_image)]:
            found[fault, where] = points[array][here & counted].mean()
    return found


def table(program):
    """The table as Markdown."""
    with tempfile.TemporaryDirectory() as folder:
        means = {}
        for place in PLACES:
            draws = [shares(program, place, draw, f"{folder}/set") for draw in range(1, DRAWS + 1)]
            means[place] = {row: numpy.mean([draw[row] for draw in draws]) for row in draws[0]}
    lines = ["| fault | points | " + " | ".join(PLACES) + " |", "|---|---|" + "---:|" * len(PLACES)]
    for fault, where in means[PLACES[0]]:
        cells = [f"{100 * means[place][fault, where]:.1f} %" for place in PLACES]
        lines.append(f"| `{fault}` | {where} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main():
    program, *options = sys.argv[1:]
    text = PAGE.read_text()
    before, rest = text.split(MARKS[0])
    after = rest.split(MARKS[1])[1]
    made = before + MARKS[0] + table(program) + MARKS[1] + after
    if options == ["--check"]:
        sys.exit(0 if made == text else f"{PAGE}: the table is not what {program} does; run this script without --check")
    PAGE.write_text(made)


if __name__ == "__main__":
    main()
