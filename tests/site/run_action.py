"""Runs the steps of action.yml as GitHub would, in the cases that its users meet.

python tests/site/run_action.py PROGRAM

Steps that use other actions are left out. Needs PyYAML, and NumPy for the tracker of the first tutorial.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import zipfile

import yaml
from run_tutorials import PAGES, blocks, install, put

ROOT = PAGES.parents[1]
EXPRESSION = re.compile(r"\$\{\{ *([\w.]+) *\}\}")
# noise, and a short clip to be quick
SETTINGS = "observation.silhouette=corrupted\nboundary_px=0.5\nmotion.last_frame=15"


class Job:
    """A job on a runner: its workspace, its temporary folder and what steps leave for later ones."""

    def __init__(self, folder: pathlib.Path, path: str) -> None:
        self.workspace, self.temporary, self.path = folder / "workspace", folder / "temporary", path
        self.workspace.mkdir()
        self.temporary.mkdir()
        for block in blocks((PAGES / "judge-my-tracker.md").read_text(encoding="utf-8")):
            if block.title:
                put(block, self.workspace)

    def use(self, **given: str) -> tuple[int, str, str, dict[str, str]]:
        """Runs the action: exit code, what is printed, the summary, the outputs."""
        action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
        known = {name: settings.get("default") for name, settings in action["inputs"].items()}
        assert given.keys() <= known.keys(), given
        values = {f"inputs.{name}": value for name, value in (known | given).items()}
        assert None not in values.values(), "a required input is missing"
        values |= {"github.action_path": str(ROOT), "runner.temp": str(self.temporary)}
        printed, files = (
            "",
            {name: self.temporary / name for name in ("GITHUB_OUTPUT", "GITHUB_PATH", "GITHUB_STEP_SUMMARY")},
        )
        for file in files.values():
            file.write_text("")
        code = 0
        for step in action["runs"]["steps"]:
            if "uses" in step:
                assert re.search(r"@[0-9a-f]{40}$", step["uses"]), f"{step['uses']}: not a commit"
                continue
            # an expression within a script would run what an input contains
            assert step["shell"] == "bash" and "${{" not in step["run"], step["name"]
            environment = {
                name: EXPRESSION.sub(lambda found: values[found[1]], text) for name, text in step["env"].items()
            }
            done = subprocess.run(
                ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
                cwd=self.workspace,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                env={
                    "HOME": os.environ.get("HOME", "/"),
                    "PATH": self.path,
                    **{name: str(file) for name, file in files.items()},
                    **environment,
                },
            )
            printed, code = printed + done.stdout, done.returncode
            if code != 0:
                break
            outputs = dict(line.split("=", 1) for line in files["GITHUB_OUTPUT"].read_text().splitlines())
            values |= {f"steps.{step.get('id')}.outputs.{name}": value for name, value in outputs.items()}
            self.path = os.pathsep.join([*files["GITHUB_PATH"].read_text().splitlines(), self.path])
        outputs = dict(line.split("=", 1) for line in files["GITHUB_OUTPUT"].read_text().splitlines())
        return code, printed, files["GITHUB_STEP_SUMMARY"].read_text(), outputs


def wheel(folder: pathlib.Path, program: pathlib.Path) -> pathlib.Path:
    """A package that pip can install without a network: it starts the program."""
    path = folder / "skiagraph-0-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        script = zipfile.ZipInfo("skiagraph-0.data/scripts/skiagraph")
        script.external_attr = 0o100755 << 16
        archive.writestr(script, f"#!/bin/sh\nexec '{program}' \"$@\"\n")
        archive.writestr("skiagraph-0.dist-info/METADATA", "Metadata-Version: 2.1\nName: skiagraph\nVersion: 0\n")
        archive.writestr(
            "skiagraph-0.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
        )
        archive.writestr("skiagraph-0.dist-info/RECORD", "")
    return path


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        programs = folder / "programs"
        programs.mkdir()
        install(programs, sys.argv[1])
        program = (programs / "skiagraph").resolve()
        # the first use finds no program and installs one
        (programs / "skiagraph").unlink()
        job = Job(folder, f"{programs}{os.pathsep}/usr/bin{os.pathsep}/bin")
        mine = {"tracker": "python3 mine.py", "baseline": "mine", "scenario": "walk.toml", "settings": SETTINGS}

        code, printed, _, _ = job.use(**mine, package=str(wheel(folder, program)))
        assert code == 2 and "::error title=skiagraph gate::" in printed and "no baseline has this name" in printed, (
            printed
        )
        code, printed, summary, _ = job.use(**mine, save="true")
        assert code == 0 and "commit it" in summary and (job.workspace / "results/baselines/mine.json").is_file(), (
            printed
        )
        code, printed, summary, outputs = job.use(**mine)
        assert code == 0 and summary.startswith("### PASS") and outputs["verdict"] == "PASS", printed
        assert (pathlib.Path(outputs["runs"]) / "1" / "report.html").is_file(), outputs

        worse = {**mine, "tracker": "python3 worse.py"}
        text = (job.workspace / "mine.py").read_text()
        (job.workspace / "worse.py").write_text(text.replace("columns.mean()", "columns.min()"))
        code, printed, summary, outputs = job.use(**worse)
        assert code == 1 and summary.startswith("### FAIL") and outputs["verdict"] == "FAIL", printed
        assert "::error title=FAIL humaneva_mm::" in printed, printed

        for wrong, words in [
            ({"repeat": "both"}, "expected draws or seeds"),
            ({"scenario": "none.toml"}, "none.toml"),
            ({"tracker": "false"}, "false"),
        ]:
            code, printed, _, _ = job.use(**{**mine, **wrong})
            assert code != 0 and words in printed and "::error title=skiagraph::" in printed, printed
        code, printed, _, _ = job.use(
            **{**mine, "settings": "motion.last_frame=5", "repeat": "seeds", "baseline": "seeds"}
        )
        assert code == 2 and "no baseline has this name" in printed, printed
    print("the action passes, fails, saves baselines and explains mistakes")


if __name__ == "__main__":
    main()
