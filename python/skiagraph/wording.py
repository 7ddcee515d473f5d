"""The program's messages and tables in the words of Python: keywords for options, no paths of temporary folders."""

from __future__ import annotations

import inspect
import re
import tempfile
from functools import lru_cache
from typing import Any

#: Keywords that are not the names of the program's options, because Python has no such names or says more.
RENAMED = {"from": "pipeline", "zip": "pair"}

#: Commands and arguments that advice names, and what does the same here.
_SAID = [
    (re.compile(r"skiagraph baseline save (\S+) RUN(?! --)"), r'save_baseline("\1", run)'),
    (re.compile(r"(the placeholder \{\w+\} has no value: give) ([\w.]+)=VALUE"), r'\1 settings={"\2": ...}'),
]

#: Advice on draws of the noise and clips, and where it is explained for the command line.
_DRAWS = re.compile(r"(clips(?: instead)?) \(docs/ci\.md\)")

_OPTION = re.compile(
    r"""(?P<quote>['`]?)--(?P<name>[a-z][a-z-]+)
    (?:[ ](?:
        (?:<[^>]+>|[A-Z]{2,}\b)                                   # a placeholder
        |(?P<value>-?\d[\w.]*|-?[a-z]+(?:,-?[a-z]+)*(?=[)\];.,]|[ ](?:if|or)\b|$))
    ))?(?P=quote)""",
    re.VERBOSE,
)


def in_python(text: str) -> str:
    """A message whose advice can be followed from Python; commands that are written out stay commands.

    >>> in_python("it seems to be in millimetres (--units mm); choose another --out, or use --force to rename it")
    'it seems to be in millimetres (`units="mm"`); choose another `out`, or use `force=True` to rename it'
    >>> in_python("save one with skiagraph baseline save walk RUN --force")
    'save one with skiagraph baseline save walk RUN --force'
    >>> in_python("no baseline has this name; save one with skiagraph baseline save walk RUN")
    'no baseline has this name; save one with save_baseline("walk", run)'
    >>> in_python("skiagraph plan-seeds runs/mine --margin 2mm")
    'skiagraph plan-seeds runs/mine --margin 2mm'
    """
    text = re.sub(_temporary(), "", text.removeprefix("RUN: "))
    text = _DRAWS.sub(r"\1 (render(..., observation__seed=n) makes a draw; docs/python.md)", text)
    for said, meant in _SAID:
        text = said.sub(meant, text)
    return _OPTION.sub(_keyword, text)


def is_temporary(command: str) -> bool:
    """Whether a command names a temporary folder of this package."""
    return re.search(_temporary(), command) is not None


def _temporary() -> str:
    return re.escape(tempfile.gettempdir()) + r"[/\\]skiagraph-\w{8}[/\\]"


def _keyword(found: re.Match[str]) -> str:
    name = found["name"].replace("-", "_")
    name, kinds = RENAMED.get(name, name), _keywords()
    clause = re.split(r"[;:\n(]", found.string[: found.start()])[-1]
    is_command = re.search(r"\bskiagraph [a-z-]+ ", clause) or clause.count("`") % 2
    if name not in kinds or is_command:
        return found[0]
    value = found["value"]
    if kinds[name] == "bool":
        return f"`{name}=True`" + (f" {value}" if value else "")
    if value is None:
        return f"`{name}`"
    return f"`{name}={value}`" if re.fullmatch(r"-?[\d.]+", value) else f'`{name}="{value}"`'


def kind_of(option: str) -> str | None:
    """The type of the keyword of an option of the program, as text; None if there is no such keyword.

    >>> kind_of("force"), kind_of("zip"), kind_of("seeds"), kind_of("json")
    ('bool', 'bool', 'int | None', None)
    """
    name = option.replace("-", "_")
    return _keywords().get(RENAMED.get(name, name))


@lru_cache
def _keywords() -> dict[str, str]:
    """The keywords of the package's functions, and their types as text."""
    import skiagraph

    called: list[Any] = [skiagraph.Program, *filter(inspect.isfunction, vars(skiagraph).values())]
    return {name: str(of.annotation) for each in called for name, of in inspect.signature(each).parameters.items()}
