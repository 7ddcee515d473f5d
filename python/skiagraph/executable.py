"""The program ``skiagraph``: where it is, whether it fits this package, and how it is called."""

from __future__ import annotations

import inspect
import json
import os
import re
import sys
import sysconfig
from collections.abc import Iterable, Mapping
from contextlib import suppress
from functools import lru_cache
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError, ProgramError, SkiagraphError
from .paths import given

if TYPE_CHECKING:
    import subprocess

#: Variable that names the program to use instead of the one that came with this package.
VARIABLE = "SKIAGRAPH"

#: Seconds that an interrupted program gets to end by itself; it needs 0.6 at most.
_GRACE_S = 1.5

_INTERRUPTED, _BAD_INPUT, _TRY_AGAIN, _SIGINT = 130, 2, 75, 2


def program() -> Path:
    """The program's path: ``$SKIAGRAPH`` if set, else the one of the wheel, else that on the ``PATH``.

    Its version is compared with the package's once per process.

    Raises:
        ProgramError: it is missing, cannot be started, or is of another version.
    """
    return _checked(os.environ.get(VARIABLE), os.environ.get("PATH"))


@lru_cache
def _checked(named: str | None, path: str | None) -> Path:
    import subprocess

    found = _find(named, path)
    try:
        said = subprocess.run([found, "--version"], capture_output=True, text=True, timeout=60, check=True).stdout
    except (OSError, subprocess.SubprocessError) as error:
        raise ProgramError(f"cannot start {found}: {error}") from error
    ours, theirs = package_version(), said.split()[-1] if said.split() else "unknown"
    if ours not in (None, theirs):
        remedy = f"install both from one wheel, or name a program of version {ours} in ${VARIABLE}"
        raise ProgramError(f"{found} is version {theirs}, but this package is version {ours}; {remedy}")
    return found


def _find(named: str | None, path: str | None) -> Path:
    from shutil import which

    if named:
        if (meant := which(named)) is None:
            raise ProgramError(f"${VARIABLE} is {named}, which is no program that can be run")
        return Path(meant).absolute()
    name = "skiagraph" + (sysconfig.get_config_var("EXE") or "")
    schemes = [sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")]
    # pip install --target DIR puts programs into DIR/bin
    schemes.append(str(Path(__file__).parents[1] / "bin"))
    for folder in schemes:
        if folder and which(name, path=folder):
            return Path(folder) / name
    if (elsewhere := which(name, path=path)) is not None:
        return Path(elsewhere)
    raise ProgramError(
        f"the program skiagraph is neither in the environment of this Python ({sysconfig.get_path('scripts')}) nor on "
        f"the PATH; install the wheel with pip, or name the program in ${VARIABLE}"
    )


def package_version() -> str | None:
    """The version of this package; None in a checkout that is not installed."""
    from importlib import metadata

    try:
        return metadata.version("skiagraph")
    except metadata.PackageNotFoundError:
        return None


def call(
    arguments: Iterable[object], *, progress: bool = False, may: Iterable[int] = (), cwd: str | None = None
) -> tuple[int, str]:
    """Runs the program; returns its exit code (0 or one of `may`) and its standard output.

    With `progress` it writes progress and notes to standard error, else nothing is printed. It ends with this process.
    """
    child = start(arguments, progress=progress, cwd=cwd, environment={"SKIAGRAPH_PARENT": str(os.getpid())})
    try:
        out, said = child.communicate()
    except BaseException as error:
        stop(child, error)
        raise
    return check(child.returncode, out, said, may=may), out


def called_json(arguments: Iterable[object], *, may: Iterable[int] = ()) -> dict[str, Any]:
    """The object that the program prints with ``--json``."""
    return dict(json.loads(call([*arguments, "--json"], may=may)[1]))


def call_for_path(
    arguments: Iterable[object], *, progress: bool = False, cwd: str | None = None
) -> tuple[str, Path, list[str]]:
    """Runs the program; returns its standard output, what it says to have written, and notes about its input."""
    out = call(arguments, progress=progress, cwd=cwd)[1].rstrip()
    found = _fields(out, "skiagraph.written/1")
    notes = [in_python(note) for note in found["notes"]]
    return out.rpartition("\n")[0].rstrip(), Path(cwd or "", found["path"]).absolute(), notes


def start(
    arguments: Iterable[object],
    *,
    progress: bool = False,
    environment: Mapping[str, str] | None = None,
    cwd: str | None = None,
) -> subprocess.Popen[str]:
    """Starts the program with its output captured; standard error only without `progress`."""
    import subprocess

    command = [str(program()), *map(str, arguments), *([] if progress else ["--quiet"])]
    try:
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=None if progress else subprocess.PIPE,
            text=True,
            encoding="utf-8",
            cwd=cwd,
            env={**os.environ, "SKIAGRAPH_CALLER": "python", **(environment or {})},
        )
    except ValueError as error:
        raise InputError(f"an argument holds characters that cannot be given to a program: {error}") from None


def stop(child: subprocess.Popen[str], reason: BaseException) -> None:
    """Interrupts the program, which keeps finished work, and waits for its end.

    At Ctrl-C the terminal has interrupted it already, and a second signal would end it before it has tidied up.
    """
    import signal
    from subprocess import TimeoutExpired

    interrupt = child.terminate if sys.platform == "win32" else lambda: child.send_signal(signal.SIGINT)
    steps = [interrupt, child.kill]
    if not isinstance(reason, KeyboardInterrupt):
        steps.pop(0)()
    for step in steps:
        with suppress(TimeoutExpired):
            child.communicate(timeout=_GRACE_S)
            return
        step()
    child.communicate()


def check(code: int, out: str, said: str | None, *, may: Iterable[int] = ()) -> int:
    """Raises the exception of an exit code other than 0 and those of `may`, from what the program printed."""
    if code == 0 or code in may:
        return code
    if code in (_INTERRUPTED, -_SIGINT):
        raise KeyboardInterrupt
    fields = _fields(out)
    message = _message(fields) or (said or "").strip().removeprefix("error: ")
    if code < 0:
        raise ProgramError(f"skiagraph was killed by signal {-code}" + (f": {message}" if message else ""))
    message = message or f"skiagraph failed with exit code {code}; its message is above"
    raise (InputError if code in (_BAD_INPUT, _TRY_AGAIN) else SkiagraphError)(message, code, fields)


def _fields(out: str, schema: str = "skiagraph.error/1") -> dict[str, Any]:
    """The object of this schema in the last line of the program's output; empty if there is none."""
    with suppress(ValueError, IndexError):
        found = json.loads(out.splitlines()[-1])
        if isinstance(found, dict) and found.get("schema") == schema:
            return found
    return {}


def _message(fields: Mapping[str, Any]) -> str | None:
    """The message of an error, which begins with a keyword where the program's begins with an option."""
    name = str(fields.get("argument", "")).removeprefix("--").replace("-", "_").lower()
    name = RENAMED.get(name, name)
    is_keyword = name in _keywords() and "detail" in fields
    message = f"{name}: {fields['detail']}" if is_keyword else fields.get("message")
    return message and in_python(message)


#: An option in a text of the program, with the value that follows it.
_VALUE = r"-?\d+(?:\.\d+)?(?:mm)?(?:,-?\d+(?:\.\d+)?)*|mm|cm|m|in|ft|y|z|rad|deg|-?[xyz](?:,-?[xyz]){2}"
_OPTION = re.compile(rf"--(?P<name>[a-z][a-z-]+)(?:[ =](?P<value>{_VALUE})(?!\w|,\S)| <[^>]+>)?")


#: Phrases of the program that are more than an option, and what they are in Python, if anything.
_PHRASES = {
    "`--truth DIR`": "Set(..., truth_at=...)",
    "rendered with --truth": "rendered with truth=...",
    r"skiagraph baseline save (\S+) RUN --baselines (\S+)": r"skiagraph.save_baseline('\1', runs, baselines='\2')",
    r"skiagraph baseline save (\S+) RUN": r"skiagraph.save_baseline('\1', runs)",
    r"[;:] (see )?skiagraph baseline show( lists those of a baseline)?": "",
    r"skiagraph track SET --tracker NAME --out RUN, and measure it with .*": "skiagraph.track(set, tracker)",
    r"(run|with) skiagraph evaluate SET (\S+)": r"\1 skiagraph.Run('\2', set).evaluate() and use its result",
    r" with skiagraph track and its option --calibrate true or false": "",
    r"(\. The plan of a sweep can be extended|; skiagraph sweep plan --extend).*": "",
    r"^override (?=[\w.]+=)": "setting ",
    r"give (\w+)=VALUE": r"give settings={'\1': ...}",
    r"--readable PATH, which may be repeated": "readable=[...]",
    r"in --exec (\".*?\")": r"in Program(\1)",
    r"^--exec (?=\S)": "the program ",
    r"the following required arguments were not provided:\s+": "what is missing is ",
    r"^array\.npz: (marker_names|estimate_joint_names): ": "names: ",
    r"array\.npz": "the array",
    "frame of the file's first frame": "frame of its first frame",
    "`(--[^`]*)`": r"\1",
}


def in_python(text: str) -> str:
    """A text of the program with keywords in place of its options: ``units='mm'`` for ``--units mm``."""

    def keyword(found: re.Match[str]) -> str:
        name = found["name"].replace("-", "_")
        kind = _keywords().get(name := RENAMED.get(name, name))
        if (value := found["value"] or "") == "" or kind in ("bool", None):
            return found[0] if kind is None else f"{name}=True" if kind == "bool" else name
        return f"{name}=" + (repr(value) if not value[-1].isdigit() else f"({value})" if "," in value else value)

    for theirs, ours in _PHRASES.items():
        text = re.sub(theirs, ours, text)
    return _OPTION.sub(keyword, text).replace("Use a joint_map:", "Use joint_map=result.corrections['joint_map']:")


def option(name: str, value: Any) -> list[str]:
    """The words of an option; none for None and False, the name alone for True."""
    flag = "--" + name.replace("_", "-")
    value = given(value, name) if name in _PATHS and value is not None else value
    value = value.tolist() if isinstance(value, np.generic) else value
    kind = _keywords().get(RENAMED.get(name, name))
    wanted = {"bool": bool | None, "int | None": int | None}.get(str(kind), object)
    if not isinstance(value, wanted) or (kind not in ("bool", None) and isinstance(value, bool)):
        words = {"bool": "True or False", "int | None": "an integer"}.get(str(kind), kind)
        raise InputError(f"{name}: expected {words}, found {_named(value)}")
    if value is None or value is False:
        return []
    return [flag] if value is True else [f"{flag}={value}"]


#: Keywords that are not the names of the program's options, because Python has no such names or says more.
RENAMED = {"exec": "command", "from": "pipeline", "zip": "pair"}
_PATHS = ("truth", "mocap_dir", "rules", "baseline", "baselines")


@lru_cache
def _keywords() -> dict[str, str]:
    """The keywords of the package's functions, and their types as text."""
    from . import public
    from .measuring import Reading

    called: list[Any] = [public.Program, public.Set.export, *filter(inspect.isfunction, vars(public).values())]
    found = {name: str(of.annotation) for each in called for name, of in inspect.signature(each).parameters.items()}
    return found | {name: of.__forward_arg__ for name, of in Reading.__annotations__.items()}


def options(**values: object) -> list[str]:
    """The words of several options."""
    return [word for name, value in values.items() for word in option(name, value)]


def overrides(settings: Mapping[str, Any] | None, more: Mapping[str, Any] | None = None) -> list[str]:
    """``KEY=VALUE`` arguments of settings and of `more`, which goes first; two underscores in a key stand for a dot."""
    if not isinstance(settings, Mapping | None):
        raise InputError(f'expected settings as a dictionary, {{"rig.ring.count": 2}}, found {_named(settings)}')
    merged: dict[str, Any] = {}
    for key, value in {**(settings or {}), **(more or {})}.items():
        merged[dotted(key)] = value
    return [f"{key}={toml(value, key)}" for key, value in merged.items()]


def dotted(key: str) -> str:
    """The key of a scenario, in which two underscores may stand for a dot."""
    if not isinstance(key, str) or key.startswith("-"):
        raise InputError(f"expected the key of a setting as text, found {_named(key)}")
    return key.replace("__", ".")


def _named(value: object) -> str:
    return f"{type(value).__name__} {value!r:.80}"


def toml(value: Any, key: str = "a setting") -> str:
    """A value in TOML's notation; `key` is named if it has none."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{inner} = {toml(value[inner], f'{key}.{inner}')}" for inner in value) + "}"
    if isinstance(value, (list, tuple, range)):
        return "[" + ", ".join(toml(inner, key) for inner in value) + "]"
    if isinstance(value, PathLike):
        value = fspath(value)
    if isinstance(value, (bool, str)):
        # JSON leaves one character as it is that TOML has escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (int, float)):
        return repr(value)
    advice = "; leave it out to keep the scenario's" if value is None else ""
    raise InputError(f"{key}: expected a number, text, list or dictionary, found {_named(value)}{advice}")
