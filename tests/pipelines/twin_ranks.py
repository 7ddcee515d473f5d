"""Does the twin of a recording foretell how settings rank on the recording? By the overlap in cameras left out.

    python tests/pipelines/twin_ranks.py PROGRAM RECORDING.toml OUT

RECORDING.toml is of docs/recordings.md, with keypoints. What OUT has of an earlier call is not made again.
"""

import json
import random
import subprocess
import sys
import tomllib
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


def by_the_same_door(program: str, of: Path, cameras: Path, out: Path) -> Path:
    """The set's masks and keypoints, imported with these cameras: the start and the body are guessed alike."""
    run(program, "export", of, "--to", "openpose", "--out", out / "pose", "--force")
    (out / "masks").mkdir(exist_ok=True)
    for camera in json.loads((of / "cameras.json").read_text())["cameras"]:
        (out / "masks" / camera["name"]).symlink_to((of / camera["observations"]).resolve())
    rate = tomllib.loads((of / "set.toml").read_text())["sequence"]["frames_per_second"]
    (out / "again.toml").write_text(
        f'schema = "skiagraph.recording/1"\nname = "again"\nframes_per_second = {rate}\n'
        f'[[rig.file]]\npath = "{cameras.resolve()}"\n[masks]\npath = "masks"\n[keypoints]\npath = "pose"\n'
    )
    run(program, "import", out / "again.toml", "--out", out / "set", "--force")
    return out / "set"


def main() -> None:
    program, recording, out = str(Path(sys.argv[1]).resolve()), Path(sys.argv[2]), Path(sys.argv[3])
    sets = {side: out / side / "set" for side in ("recording", "twin")}
    if not sets["twin"].exists():
        for side in sets:
            (out / side).mkdir(parents=True, exist_ok=True)
        run(program, "import", recording, "--out", out / "set", "--force")
        run(program, "track", out / "set", *FILTER, "--out", out / "all", "--force")
        run(program, "twin", out / "set", out / "all", "--out", out / "scenario", "--force")
        run(program, "render", out / "scenario/twin.toml", "--key", "default", "--out", out / "rendered", "--force")
        # both sides have the cameras as the run corrected them, which are the twin's true ones
        for side, of in (("recording", out / "set"), ("twin", out / "rendered")):
            by_the_same_door(program, of, out / "scenario/cameras.toml", out / side)
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
