"""Everything that ``import skiagraph`` offers."""

from .benchmark_set import Arrays as Arrays, Images as Images, Keypoints as Keypoints, Set as Set, Truth as Truth
from .camera import Camera as Camera
from .commands import Cell as Cell, Program as Program, Sweep as Sweep, render as render, sweep as sweep, track as track
from .comparing import (
    Comparison as Comparison,
    Gate as Gate,
    RegressionCheck as RegressionCheck,
    SetMaker as SetMaker,
    Verdict as Verdict,
    compare as compare,
    gate as gate,
    save_baseline as save_baseline,
)
from .errors import (
    InputError as InputError,
    MisreadWarning as MisreadWarning,
    MissingNameError as MissingNameError,
    MissingPackageError as MissingPackageError,
    NoTruthError as NoTruthError,
    ProgramError as ProgramError,
    SkiagraphError as SkiagraphError,
    TrackerError as TrackerError,
)
from .executable import program as program
from .measuring import Metrics as Metrics, Result as Result, Run as Run, evaluate as evaluate
from .rerun import to_rerun as to_rerun
from .session import Session as Session
from .tracking import (
    Answer as Answer,
    AnyTracker as AnyTracker,
    Frame as Frame,
    SetInfo as SetInfo,
    Start as Start,
    Tracker as Tracker,
    View as View,
    serve as serve,
)
