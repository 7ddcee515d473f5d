"""Writes results/keypoints.svg and the tables of results/keypoints.md to standard output.

Usage: python tests/pipelines/places_page.py sweeps/keypoints/runs.csv sweeps/keypoint-costs/runs.csv places.csv
"""

import csv
import sys
from collections import defaultdict
from pathlib import Path

PLACES, CAMERAS = ["studio", "gym", "outdoors"], ["2", "4", "8"]
CONDITIONS = ["exact", "keypoints 1 % (2 px)", "definition 14 mm", "clocks 10 ms", "cameras 0.5 degrees"]
OURS = ["triangulated", "triangulated, filtered", "triangulated, smoothed", "filter, keypoints", "filter, silhouettes", "filter, both"]
PIPELINES = ["Pose2Sim", "Pose2Sim, filtered", "aniposelib", "aniposelib, optimised"]
COLOURS = dict(zip(["Pose2Sim, filtered", "triangulated, smoothed", "filter, keypoints", "filter, silhouettes", "filter, both"],
                   ["#888888", "#c77b00", "#b03060", "#2f6db5", "#1a7f37"]))


def read(sweep, costs, places):
    """Errors in mm by condition, number of cameras and method."""
    found = defaultdict(list)
    for file in (sweep, costs):
        for row in csv.DictReader(open(file, newline="")):
            condition = row.get("observation.preset") or row["condition"]
            if row["humaneva_mm"]:
                found[condition, row.get("rig.ring.count", "4"), row["method"]].append(float(row["humaneva_mm"]))
    for condition, cameras, method, _, error in csv.reader(open(places, newline=""), delimiter=";"):
        found[condition, cameras, method].append(float(error))
    return found


def cell(values):
    if not values:
        return "-"
    mean = sum(values) / len(values)
    return f"{mean:.1f}" if mean < 100 else f"{mean:.0f}"


def table(found, title, columns):
    lines = [f"| {title} | " + " | ".join(" ".join(column).strip() for column in columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for method in OURS + PIPELINES:
        values = [cell(found[condition, cameras.split()[0] if cameras else "4", method]) for condition, cameras in columns]
        lines.append(f"| {method} | " + " | ".join(values) + " |")
    return "\n".join(lines)


def figure(found):
    """Error by place with four cameras, logarithmic."""
    import math

    width, height, left, bottom, top = 720, 360, 60, 300, 20
    y = lambda mm: bottom - (math.log10(mm) - 0) / 2.5 * (bottom - top)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
             f'<rect width="{width}" height="{height}" fill="white"/>']
    for mm in (1, 2, 5, 10, 20, 50, 100, 200):
        parts.append(f'<line x1="{left}" x2="{width - 10}" y1="{y(mm):.1f}" y2="{y(mm):.1f}" stroke="#dddddd"/>'
                     f'<text x="{left - 8}" y="{y(mm) + 4:.1f}" text-anchor="end">{mm}</text>')
    parts.append(f'<text x="{left}" y="14">HumanEva error, mm, four cameras</text>')
    for group, place in enumerate(PLACES):
        start = left + 20 + group * 215
        parts.append(f'<text x="{start + 85}" y="{bottom + 20}" text-anchor="middle">{place}</text>')
        for bar, (method, colour) in enumerate(COLOURS.items()):
            values = found[place, "4", method]
            if values:
                mm = sum(values) / len(values)
                parts.append(f'<rect x="{start + 34 * bar}" width="30" y="{y(mm):.1f}" height="{bottom - y(mm):.1f}" fill="{colour}"/>'
                             f'<text x="{start + 34 * bar + 15}" y="{y(mm) - 4:.1f}" text-anchor="middle">{mm:.0f}</text>')
    for index, (method, colour) in enumerate(COLOURS.items()):
        x = 20 + index * 140
        parts.append(f'<rect x="{x}" y="{height - 22}" width="12" height="12" fill="{colour}"/><text x="{x + 16}" y="{height - 11}">{method}</text>')
    return "\n".join(parts + ["</svg>", ""])


def main():
    found = read(*sys.argv[1:])
    Path("results/keypoints.svg").write_text(figure(found))
    print(table(found, "mm", [(place, f"{cameras} cameras") for place in PLACES for cameras in CAMERAS]))
    print()
    print(table(found, "mm, 4 cameras", [(condition, "") for condition in CONDITIONS]))


if __name__ == "__main__":
    main()
