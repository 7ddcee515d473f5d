"""Which questions does the hard suite separate? Runs it and writes results/separation.md.

    python tests/pipelines/separation.py PROGRAM OUT results/separation.svg > results/separation.md

Sweeps that OUT has of an earlier call are continued.
"""

import csv
import json
import subprocess
import sys
import tomllib
from html import escape
from pathlib import Path

SUITE = Path("scenarios/suites/hard")
HEAD = """# What separates

![How far the values of every axis are apart](separation.svg)

The suite `scenarios/suites/hard` asks one question in each sweep, under conditions in which its answers should differ: images of 320 x 240, two
seconds, five seeds, each with its own draw of the noise. Errors are HumanEva's in mm, with 95 % intervals over the draws; where a sweep has two motions
(a walk and a run), both are averaged. *Effect* is the difference of the greatest and the least mean as a share of the greatest. *Apart*: some
two intervals are. Where none are, *ceiling reached* says that the effect is below 30 %, so that for this tracker the axis is no question, and *scattered*
that it is larger, so that five draws are too few. *Ranks agree* is Kendall's tau of the
ranks between draws: with 1, a single draw gives the order of the values; ties count 0.

| question | axis | tracker | mean by value (95 % interval) | effect | intervals | ranks agree |
|---|---|---|---|---:|---|---:|"""


def number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"


def cell(value: dict, tracker: int) -> str:
    mean = value["means"][tracker]
    ends = f" ({number(mean['ci95'][0])} to {number(mean['ci95'][1])})" if mean["ci95"] else ""
    return f"{value['value']}: {number(mean['mean'])}{ends}"


def least_error(program: str, sweep: dict) -> float:
    """Least mean error, mm, of a filter that knows the start, in the conditions of a sweep and its first motion."""
    motions = sweep["axes"].get("motion")
    first = motions[0]["set"] if isinstance(motions, list) else []
    command = [program, "bound", SUITE / sweep["base"], *sweep.get("set", []), *first, "--every", "5", "--json"]
    found = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
    return min(source["filtered_mm"] for source in found["sources"])


def picture(bars: list[tuple[str, float, str]]) -> str:
    """Bars of the effects, the longest first."""
    colours = {"apart": "#2a6f97", "scattered": "#c9a227", "ceiling reached": "#b0b0b0"}
    rows = []
    for row, (name, effect, verdict) in enumerate(sorted(bars, key=lambda bar: -bar[1])):
        y = 30 + 22 * row
        rows.append(f'<text x="290" y="{y + 12}" text-anchor="end">{escape(name)}</text>')
        rows.append(f'<rect x="300" y="{y}" width="{4 * effect:.0f}" height="16" fill="{colours[verdict]}"/>')
        rows.append(f'<text x="{306 + 4 * effect:.0f}" y="{y + 12}">{effect:.0f} %, {verdict}</text>')
    size = f'viewBox="0 0 860 {40 + 22 * len(bars)}" font-family="sans-serif" font-size="12"'
    title = '<text x="300" y="18">error of the best value below that of the worst</text>'
    return "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', title, *rows, "</svg>", ""])


def main() -> None:
    program, out = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2])
    print(HEAD)
    minutes, never, bars, headroom = {}, [], [], []
    for sweep in sorted(SUITE.glob("*.toml")):
        folder = out / sweep.stem
        command = [program, "sweep", sweep, "--out", folder, "-j", "2", "--json", "--quiet"]
        found = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
        definition = tomllib.loads(sweep.read_text())
        question = definition["description"]
        best = min(value["means"][0]["mean"] for axis in found["by_axis"]["axes"] for value in axis["values"])
        bound = least_error(program, definition)
        headroom.append(f"| `{sweep.stem}` | {best:.1f} | {bound:.1f} | {best / bound:.1f} |")
        with (folder / "timing.csv").open() as lines:
            minutes[sweep.stem] = sum(float(row["processor_s"]) for row in csv.DictReader(lines)) / 60
        never.append(f"{sweep.stem} {number(found['by_axis']['all'][0]['frozen'])}")
        for axis in found["by_axis"]["axes"]:
            if axis["axis"] == "motion":
                continue
            for tracker, name in enumerate(found["by_axis"]["trackers"]):
                separation = axis["separation"][tracker]
                effect, tau = separation["effect"], separation["rank_agreement"]
                verdict = separation["verdict"].replace("_", " ")
                values = ", ".join(cell(value, tracker) for value in axis["values"])
                row = [
                    f"{question} (`{sweep.stem}`)",
                    f"`{axis['axis']}`",
                    name if len(found["by_axis"]["trackers"]) > 1 else "",
                    values,
                    "" if effect is None else f"{100 * effect:.0f} %",
                    verdict,
                    "" if tau is None else f"{tau:.2f}",
                ]
                print(f"| {' | '.join(row)} |")
                if effect is not None:
                    tracker_name = f", {row[2]}" if row[2] else ""
                    bars.append((f"{sweep.stem}: {axis['axis']}{tracker_name}", 100 * effect, verdict))
    print("\n## Headroom\n")
    print("The least mean error of a sweep (of one value of an axis, over the others), beside the least that any filter can have in")
    print("its first conditions if it knows body, start and spread of the motion (`skiagraph bound`, every fifth frame).\n")
    print("| sweep | least error, mm | bound, mm | ratio |\n|---|---:|---:|---:|")
    print("\n".join(headroom))
    Path(sys.argv[3]).write_text(picture(bars), encoding="utf-8")
    print(f"\nA tracker that never moves: {', '.join(never)} mm.")
    print(f"\nMinutes of processor time: {', '.join(f'{name} {time:.1f}' for name, time in minutes.items())}; together {sum(minutes.values()):.0f}.")


if __name__ == "__main__":
    main()
