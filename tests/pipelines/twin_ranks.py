"""Does the twin of a recording foretell how settings rank on the recording? By the overlap in cameras left out.

    python tests/pipelines/twin_ranks.py PROGRAM RECORDING.toml OUT

RECORDING.toml is of docs/recordings.md, with keypoints. What OUT has of an earlier call is not made again.
"""

import json
import random
import subprocess
import sys
from pathlib import Path

FILTER = ["--tracker", "annealed_particle_filter"]
SETTINGS = {
    "default": FILTER,
    "one particle": [*FILTER, "particles=1"],
    "20 particles, 2 layers": [*FILTER, "particles=20", "layers=2"],
    "200 particles": [*FILTER, "particles=200"],
    "as printed": [*FILTER, "paper=true"],
    "as printed, 50 particles": [*FILTER, "paper=true", "particles=50"],
    "body alone calibrated": [*FILTER, "--calibrate", "body"],
    "not calibrated": [*FILTER, "--calibrate", "false"],
    "keypoints and silhouettes": [*FILTER, "evidence=both"],
    "filter on keypoints": [*FILTER, "evidence=keypoints"],
    "triangulated keypoints": ["--tracker", "keypoints"],
    "frozen": ["--tracker", "frozen"],
}
DRAWS = 2000


def run(program: str, *arguments: str | Path) -> None:
    subprocess.run([program, *map(str, arguments), "--quiet"], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def overlap(program: str, of: Path, setting: str, camera: str, out: Path) -> float:
    """Mean overlap in a camera that was left out."""
    if not (out / "run.json").exists():
        run(program, "track", of, *SETTINGS[setting], "--leave-out", camera, "--out", out, "--force")
        run(program, "evaluate", of, out)
    return json.loads((out / "run.json").read_text())["left_out"][camera]["mean"]


def tau(pairs: list[tuple[float, float]]) -> float:
    """Kendall's tau-a."""
    signs = [
        ((a > c) - (a < c)) * ((b > d) - (b < d))
        for index, (a, b) in enumerate(pairs)
        for c, d in pairs[index + 1 :]
        # drawn twice
        if (a, b) != (c, d)
    ]
    return sum(signs) / max(1, len(signs))


def main() -> None:
    program, recording, out = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2]), Path(sys.argv[3])
    out.mkdir(parents=True, exist_ok=True)
    sets = {"recording": out / "set", "twin": out / "twin-set"}
    if not sets["twin"].exists():
        run(program, "import", recording, "--out", sets["recording"], "--force")
        run(program, "track", sets["recording"], *FILTER, "--out", out / "all", "--force")
        run(program, "twin", sets["recording"], out / "all", "--out", out / "twin", "--force")
        run(program, "render", out / "twin/twin.toml", "--key", "default", "--out", out / "rendered", "--force")
        run(program, "export", out / "rendered", "--to", "openpose", "--out", out / "pose", "--force")
        (out / "masks").mkdir(exist_ok=True)
        for camera in json.loads((out / "rendered/cameras.json").read_text())["cameras"]:
            (out / "masks" / camera["name"]).symlink_to((out / "rendered" / camera["observations"]).resolve())
        # the twin comes by the same door: its start and its body are guessed as those of the recording were
        rate = json.loads((sets["recording"] / "made_by.json").read_text())["settings"]["frames_per_second"]
        (out / "twin.toml").write_text(
            f'schema = "skiagraph.recording/1"\nname = "twin"\nframes_per_second = {rate}\n'
            '[[rig.file]]\npath = "twin/cameras.toml"\n[masks]\npath = "masks"\n[keypoints]\npath = "pose"\n'
        )
        run(program, "import", out / "twin.toml", "--out", sets["twin"], "--force")
    cameras = [camera["name"] for camera in json.loads((sets["recording"] / "cameras.json").read_text())["cameras"]]
    means = {}
    print(f"| | {' | '.join(f'{side} {camera}' for camera in cameras for side in sets)} | recording | twin |")
    print("|---" * (2 * len(cameras) + 3) + "|")
    for setting in SETTINGS:
        found = {
            side: [overlap(program, of, setting, camera, out / side / setting.replace(" ", "-") / camera) for camera in cameras]
            for side, of in sets.items()
        }
        means[setting] = tuple(sum(values) / len(values) for values in found.values())
        single = [f"{found[side][index]:.3f}" for index in range(len(cameras)) for side in sets]
        print(f"| {setting} | {' | '.join(single)} | {means[setting][0]:.3f} | {means[setting][1]:.3f} |", flush=True)
    pairs = list(means.values())
    draw = random.Random(0)
    taus = sorted(tau([draw.choice(pairs) for _ in pairs]) for _ in range(DRAWS))
    print(f"\nKendall's tau of {len(pairs)} settings: {tau(pairs):.2f} (95 % interval by bootstrap over settings "
          f"{taus[DRAWS // 40]:.2f} to {taus[-DRAWS // 40]:.2f})")  # fmt: skip


main()
