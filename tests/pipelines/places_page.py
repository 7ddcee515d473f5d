"""Writes results/keypoints.svg, and the tables of results/keypoints.md to standard output.

Usage: python tests/pipelines/places_page.py sweeps/keypoints/runs.csv sweeps/keypoint-costs/runs.csv places.csv
"""

import csv
import math
import sys
from collections import defaultdict
from pathlib import Path

PLACES = ["studio, 4 cameras", "gym, 2 cameras", "gym, 4 cameras", "gym, 8 cameras", "outdoors, 4 cameras"]
COSTS = ["exact", "keypoints 1 % (2 px)", "definition 14 mm", "clocks 10 ms", "cameras 0.5 degrees"]
OURS = ["triangulated", "triangulated, filtered", "triangulated, smoothed", "filter, keypoints", "filter, silhouettes", "filter, both"]
PIPELINES = ["Pose2Sim", "Pose2Sim, filtered", "aniposelib", "aniposelib, optimised"]
BARS = {"Pose2Sim, filtered": "#888888", "triangulated, smoothed": "#c77b00", "filter, keypoints": "#b03060",
        "filter, silhouettes": "#2f6db5", "filter, both": "#1a7f37"}
GREATEST_MM = 500


def read(sweeps, places):
    """Errors in mm by condition and method, in the order of the draws of the noise."""
    rows = []
    for file in sweeps:
        with open(file, newline="") as cells:
            rows += [(row["condition"], row["method"], row["observation.seed"], row["humaneva_mm"]) for row in csv.DictReader(cells)]
    with open(places, newline="") as lines:
        rows += csv.reader(lines, delimiter=";")
    found = defaultdict(list)
    for condition, method, _, error in sorted((row for row in rows if row[3]), key=lambda row: int(row[2])):
        found[condition, method].append(float(error))
    return found


def mean(values):
    return sum(values) / len(values) if values else None


def cell(values):
    """One number for each draw."""
    return " / ".join(f"{error:.1f}" if error < 100 else f"{error:.0f}" for error in values) or "-"


def table(found, columns):
    lines = ["| mm | " + " | ".join(columns) + " |", "|---|" + "---:|" * len(columns)]
    for method in OURS + PIPELINES:
        lines.append(f"| {method} | " + " | ".join(cell(found[condition, method]) for condition in columns) + " |")
    return "\n".join(lines)


def figure(found):
    """Bars by place, with a logarithmic axis."""
    width, height, left, bottom, top = 980, 370, 50, 300, 30

    def y(mm):
        return bottom - math.log10(mm) / math.log10(GREATEST_MM) * (bottom - top)

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
             f'<rect width="{width}" height="{height}" fill="white"/>', f'<text x="{left}" y="16">HumanEva error, mm, mean of the draws of the noise</text>']
    for mm in (1, 2, 5, 10, 20, 50, 100, 200, 500):
        parts.append(f'<line x1="{left}" x2="{width - 10}" y1="{y(mm):.1f}" y2="{y(mm):.1f}" stroke="#dddddd"/>'
                     f'<text x="{left - 8}" y="{y(mm) + 4:.1f}" text-anchor="end">{mm}</text>')
    for group, place in enumerate(PLACES):
        start = left + 12 + group * 185
        parts.append(f'<text x="{start + 82}" y="{bottom + 20}" text-anchor="middle">{place}</text>')
        for bar, (method, colour) in enumerate(BARS.items()):
            error = mean(found[place, method])
            if error is not None:
                x = start + 33 * bar
                parts.append(f'<rect x="{x}" width="29" y="{y(error):.1f}" height="{bottom - y(error):.1f}" fill="{colour}"/>'
                             f'<text x="{x + 14}" y="{y(error) - 4:.1f}" text-anchor="middle">{error:.0f}</text>')
    for index, (method, colour) in enumerate(BARS.items()):
        x = left + index * 180
        parts.append(f'<rect x="{x}" y="{height - 24}" width="12" height="12" fill="{colour}"/>'
                     f'<text x="{x + 18}" y="{height - 13}">{method}</text>')
    return "\n".join(parts + ["</svg>", ""])


def main():
    *sweeps, places = sys.argv[1:]
    found = read(sweeps, places)
    Path("results/keypoints.svg").write_text(figure(found))
    print(table(found, PLACES), table(found, COSTS), sep="\n\n")


if __name__ == "__main__":
    main()
