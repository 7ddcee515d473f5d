"""Runs every tutorial of docs/tutorials as its reader would, in an empty folder, and checks the outputs that it shows.

python tests/site/run_tutorials.py PROGRAM [PAGE...]

--write replaces shown lines that are no longer printed by the most similar ones.

A fenced block with `title="NAME"` is a file of that name; `<!-- files of PAGE -->` writes those of another page.
Blocks of bash and python are run; they must succeed. A block of text behind one shows what it prints: its lines must
appear there in this order, where … stands for anything. Other blocks are not run.
"""

import argparse
import concurrent.futures
import dataclasses
import difflib
import itertools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

PAGES = pathlib.Path(__file__).resolve().parents[2] / "docs" / "tutorials"
OTHER_FILES = re.compile(r"^<!-- files of (\S+) -->$", re.MULTILINE)
FENCE = re.compile(r"^```(\w+)(?: title=\"([^\"]+)\")?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclasses.dataclass
class Block:
    language: str
    title: str | None
    text: str
    line: int


def blocks(page: str) -> list[Block]:
    return [
        Block(found[1], found[2], found[3], page.count("\n", 0, found.start()) + 1) for found in FENCE.finditer(page)
    ]


def put(block: Block, folder: pathlib.Path) -> None:
    """Writes a block with a title as a file."""
    path = folder / block.title
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(block.text, encoding="utf-8")


def run(block: Block, folder: pathlib.Path, environment: dict[str, str]) -> tuple[int, str]:
    """Exit code and everything that is printed."""
    command = {"bash": ["bash", "-euo", "pipefail", "-c"], "python": ["python3", "-c"]}[block.language]
    done = subprocess.run(
        [*command, block.text],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    return done.returncode, done.stdout


def missing(shown: str, printed: str) -> list[str]:
    """The shown lines that are not printed, in this order."""
    rest, absent = printed.splitlines(), []
    for line in shown.splitlines():
        pattern = re.compile(".*".join(map(re.escape, line.rstrip().split("…"))))
        place = next((at for at, candidate in enumerate(rest) if pattern.fullmatch(candidate.rstrip())), None)
        if place is not None:
            rest = rest[place + 1 :]
        elif line.strip() not in ("", "…"):
            absent.append(line)
    return absent


def tail(printed: str) -> str:
    """The last lines of an output."""
    return "\n".join(printed.splitlines()[-60:])


def renewed(shown: str, printed: str) -> str:
    """The shown text with the most similar printed lines in place of those that are missing."""
    rest = [line.rstrip() for line in printed.splitlines() if line.rstrip() not in shown.splitlines()]
    for line in missing(shown, printed):
        nearest = difflib.get_close_matches(line, rest, n=1, cutoff=0.3)
        rest = [other for other in rest if other not in nearest]
        new = nearest[0] if nearest else "…"
        # what differs from run to run stays left out
        shown = shown.replace(line, new[: line.index("…")] + "…" if line.endswith("…") else new, 1)
    return shown


def check(path: pathlib.Path, programs: pathlib.Path, write: bool) -> list[str]:
    """What is wrong with a page."""
    page = path.read_text(encoding="utf-8")
    environment = {**os.environ, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    environment = {name: value for name, value in environment.items() if not name.startswith("SKIAGRAPH_")}
    wrong, printed, count, begun = [], None, 0, time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for other in OTHER_FILES.findall(page):
            for block in blocks((path.parent / other).read_text(encoding="utf-8")):
                if block.title:
                    put(block, folder)
        for block in blocks(page):
            if block.title:
                put(block, folder)
            elif block.language in ("bash", "python"):
                code, printed = run(block, folder, environment)
                count += 1
                if code != 0:
                    return [*wrong, f"{path}:{block.line}: exit code {code}\n{block.text}{tail(printed)}"]
            elif block.language == "text" and printed is not None:
                absent = missing(block.text, printed)
                if absent and write:
                    page = page.replace(block.text, renewed(block.text, printed), 1)
                elif absent:
                    lines = "\n".join(absent)
                    wrong.append(f"{path}:{block.line}: not printed:\n{lines}\nprinted was:\n{tail(printed)}")
    if count == 0:
        wrong.append(f"{path}: there is nothing to run")
    if write:
        path.write_text(page, encoding="utf-8")
    print(f"{path.name}: {count} blocks run in {time.monotonic() - begun:.0f} s", flush=True)
    return wrong


def install(programs: pathlib.Path, program: str) -> None:
    """The programs of the tutorials: `skiagraph` and this Python."""
    found = shutil.which(program)
    if found is None:
        sys.exit(f"{program}: there is no such program")
    (programs / "skiagraph").symlink_to(pathlib.Path(found).resolve())
    # a link would leave a virtual environment
    (programs / "python3").write_text(f"#!/bin/sh\nexec '{sys.executable}' \"$@\"\n")
    (programs / "python3").chmod(0o755)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program skiagraph")
    parser.add_argument("pages", nargs="*", type=pathlib.Path, help="pages [default: all tutorials]")
    parser.add_argument("--write", action="store_true", help="renew the shown lines that are no longer printed")
    arguments = parser.parse_args()
    wrong = []
    with tempfile.TemporaryDirectory() as programs:
        install(pathlib.Path(programs), arguments.program)
        pages = arguments.pages or sorted(PAGES.glob("*.md"))
        with concurrent.futures.ThreadPoolExecutor(max_workers=2) as pool:
            for found in pool.map(
                check, pages, itertools.repeat(pathlib.Path(programs)), itertools.repeat(arguments.write)
            ):
                wrong += found
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
