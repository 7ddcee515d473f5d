"""Which questions does the hard suite separate? Runs it and writes results/separation.md.

    python tests/pipelines/separation.py PROGRAM OUT > results/separation.md

Sweeps that OUT has of an earlier call are continued.
"""

import csv
import json
import subprocess
import sys
from pathlib import Path

SUITE = Path("scenarios/suites/hard")
HEAD = """# What separates

The suite `scenarios/suites/hard` asks one question in each sweep, under conditions in which its answers should differ: images of 320 x 240, two
seconds, five seeds, each with its own draw of the noise. *Effect* is the difference of the worst and the best value as a share of the worst; *apart*
says whether their 95 % intervals are; *ranks agree* is Kendall's tau of the ranks of the values between draws (between clips, where there are
several). Errors are HumanEva's, in mm. Where two values of one axis are not apart, the suite says `ceiling reached`: this axis is no question there.

| question | axis | mean by value (95 % interval) | effect | apart | ranks agree |
|---|---|---|---:|---|---:|"""


def number(value: float) -> str:
    return f"{value:.1f}"


def cell(value: dict) -> str:
    mean = value["means"][0]
    ends = f" ({number(mean['ci95'][0])} to {number(mean['ci95'][1])})" if mean["ci95"] else ""
    return f"{value['value']}: {number(mean['mean'])}{ends}"


def main() -> None:
    program, out = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2])
    print(HEAD)
    minutes, never = {}, []
    for sweep in sorted(SUITE.glob("*.toml")):
        folder = out / sweep.stem
        said = subprocess.run(
            [program, "sweep", sweep, "--out", folder, "-j", "2", "--json", "--quiet"], check=True, capture_output=True, text=True
        )
        found = json.loads(said.stdout)
        question = sweep.read_text().splitlines()[0].removeprefix("# ")
        with (folder / "timing.csv").open() as lines:
            minutes[sweep.stem] = sum(float(row["processor_s"]) for row in csv.DictReader(lines)) / 60
        frozen = found["by_axis"]["all"][0]["frozen"]
        never.append(f"{sweep.stem} {number(frozen)}")
        for axis in found["by_axis"]["axes"]:
            (separation,) = axis["separation"]
            apart = "yes" if separation["apart"] else "**ceiling reached**"
            values = ", ".join(cell(value) for value in axis["values"])
            tau = separation["rank_agreement"]
            agree = "" if tau is None else f"{tau:.2f}"
            print(f"| {question} (`{sweep.stem}`) | `{axis['axis']}` | {values} | {100 * separation['effect']:.0f} % | {apart} | {agree} |")
    print(f"\nA tracker that never moves: {', '.join(never)} mm.")
    print(f"\nProcessor time, a build with debug checks, minutes: {', '.join(f'{name} {time:.1f}' for name, time in minutes.items())};")
    print(f"together {sum(minutes.values()):.0f}.")


if __name__ == "__main__":
    main()
