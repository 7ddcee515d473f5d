"""Exact synthetic truth for markerless human motion trackers, from Python.

>>> import skiagraph
>>> walk = skiagraph.Set("sets/walk")
>>> def stay(frame):
...     return frame.info.start.markers
>>> result = walk.evaluate(skiagraph.track(walk, stay))
>>> result.metrics["humaneva_mm"] > 50
True

Units are metres, radians and seconds, in a world with Z up; metrics state theirs in their names. docs/python.md
describes the package. Nothing is printed unless ``progress=True``.
"""

from .benchmark_set import Arrays, Images, Keypoints, Set, Start, Truth
from .camera import Camera
from .commands import Cell, Program, Sweep, render, sweep, track
from .comparing import Comparison, Gate, Verdict, compare, gate, save_baseline
from .errors import InputError, MissingPackageError, NoTruthError, ProgramError, SkiagraphError, TrackerError
from .executable import program
from .measuring import Result, Run, evaluate
from .rerun import to_rerun
from .tracking import Frame, SetInfo, StartPose, Tracker, View, serve

__all__ = [
    "Arrays",
    "Camera",
    "Cell",
    "Comparison",
    "Frame",
    "Gate",
    "Images",
    "InputError",
    "Keypoints",
    "MissingPackageError",
    "NoTruthError",
    "Program",
    "ProgramError",
    "Result",
    "Run",
    "Set",
    "SetInfo",
    "SkiagraphError",
    "Start",
    "StartPose",
    "Sweep",
    "Tracker",
    "TrackerError",
    "Truth",
    "Verdict",
    "View",
    "compare",
    "evaluate",
    "gate",
    "program",
    "render",
    "save_baseline",
    "serve",
    "sweep",
    "to_rerun",
    "track",
]
