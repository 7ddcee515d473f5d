"""Which questions does the hard suite separate? Runs it and writes results/separation.md.

    python tests/pipelines/separation.py PROGRAM OUT > results/separation.md

Sweeps that OUT has of an earlier call are continued.
"""

import csv
import json
import subprocess
import sys
import tomllib
from pathlib import Path

SUITE = Path("scenarios/suites/hard")
HEAD = """# What separates

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


def main() -> None:
    program, out = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2])
    print(HEAD)
    minutes, never = {}, []
    for sweep in sorted(SUITE.glob("*.toml")):
        folder = out / sweep.stem
        command = [program, "sweep", sweep, "--out", folder, "-j", "2", "--json", "--quiet"]
        found = json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)
        question = tomllib.loads(sweep.read_text())["description"]
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
    print(f"\nA tracker that never moves: {', '.join(never)} mm.")
    print(f"\nMinutes of processor time: {', '.join(f'{name} {time:.1f}' for name, time in minutes.items())}; together {sum(minutes.values()):.0f}.")


if __name__ == "__main__":
    main()
