"""Runs of trackers in loops of their own."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

from .benchmark_set import PATIENCE_S, Set
from .commands import track
from .errors import InputError
from .measuring import Run
from .paths import PathName
from .tracking import Answer, Frame, SetInfo, message_of


class Session:
    """A run of a tracker in a loop of your own, recorded as :func:`track` does; ``set.tracking(seed=0)`` begins it.

    ``info`` is what a tracker of this seed is told; ``frame`` is the one whose pose is wanted, None after the last.
    ``out``, ``name``, ``frame_limit`` (a day), ``restarts`` and ``force`` are those of :func:`track`: a step that takes
    longer than ``frame_limit`` loses its frame, with a warning. A session that is left early leaves no run.
    """

    def __init__(self, of: Set | PathName, *, seed: int = 0, name: str = "session", **options: Any) -> None:
        of = of if isinstance(of, Set) else Set(of)
        self._found: SimpleQueue[Any] = SimpleQueue()
        self._answers: SimpleQueue[Any] = SimpleQueue()
        self._run: Run | None = None
        self._given: int | None = None
        self._frames, self._process, self._kind = of.frames, os.getpid(), ""
        options = {"seed": seed, "name": name, "frame_limit": PATIENCE_S, **options}
        # the thread does not hold the session, so that one that nobody has ends
        arguments = (of, options, self._found, self._answers)
        thread = threading.Thread(target=_relay, args=arguments, daemon=True)
        thread.start()
        self.frame: Frame | None = self._next()
        #: What a tracker is told before the first frame, with the seed.
        self.info: SetInfo = self.frame.info if self.frame is not None else of.info
        # at the end of this process, too, before the temporary folder of the run is removed
        weakref.finalize(self, _end, self._answers, thread)

    def __repr__(self) -> str:
        return f"Session({self.frame or self._run or 'over'})"

    def __reduce__(self) -> str:
        raise InputError("a session cannot be sent to another process; begin one there with set.tracking(seed=...)")

    def step(self, answer: Answer, frame: Frame | int | None = None) -> Frame | None:
        """Answers the frame, as a tracker does: None for a lost one; returns the next frame, None after the last. With
        `frame`, a frame of this session or its index, an answer to another one is refused.

        Raises:
            TrackerError: it is no estimate; the frame can be answered again.
            InputError: the session is over, or the answer is to another frame.
        """
        if self.frame is None:
            raise InputError(f"all {self._frames} frames are answered or lost" if self._run else "the session is over")
        if isinstance(frame, Frame) and frame.info.folder != self.info.folder:
            raise InputError(f"expected a frame of this session, found one of {frame.info.folder}")
        index = frame.index if isinstance(frame, Frame) else frame
        if index not in (None, self.frame.index):
            raise InputError(f"expected the answer to frame {self.frame.index}, found that to frame {index!r:.80}")
        if os.getpid() != self._process:
            raise InputError("the session is that of another process; begin one here with set.tracking(seed=...)")
        if self._given not in (None, self.frame.index):
            self.close()
            raise InputError(f"expected one session.step(...) for frame {self._given}, found 2")
        self._kind = message_of(answer, self.frame, self._kind)[1]
        self.frame = None
        self._answers.put((answer,))
        self.frame = self._next()
        return self.frame

    def _next(self) -> Frame | None:
        found = self._found.get()
        if isinstance(found, InputError) and found.fields.get("kind") == "busy":
            found.args = (f"{found}; if it is an earlier session of yours, close() or a with statement ends it",)
        if isinstance(found, BaseException):
            raise found
        self._run = None if isinstance(found, Frame) else found
        return found if isinstance(found, Frame) else None

    @property
    def run(self) -> Run:
        """The run, when all frames are answered.

        Raises:
            InputError: there are frames without an answer.
        """
        if self._run is None:
            left = "the session is over" if self.frame is None else f"frame {self.frame.index} has no answer"
            raise InputError(f"{left}: expected session.step(...) for all {self._frames} frames, None for a lost one")
        return self._run

    def close(self) -> None:
        """Ends the session; one with unanswered frames leaves no run."""
        if self.frame is not None and os.getpid() == self._process:
            self.frame = None
            self._answers.put(())
            self._found.get()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Frame]:
        try:
            while (frame := self.frame) is not None:
                self._given = frame.index
                yield frame
                if self.frame is frame:
                    self.close()
                    raise InputError(f"expected one session.step(...) for frame {frame.index}, found 0")
        finally:
            self._given = None


def _end(answers: SimpleQueue[Any], thread: threading.Thread) -> None:
    answers.put(())
    if thread is not threading.current_thread():
        thread.join()


def _relay(of: Set, options: dict[str, Any], found: SimpleQueue[Any], answers: SimpleQueue[Any]) -> None:
    """Hands the frames of a run to a session, and its answers back; no answer ends it."""

    def step(frame: Frame) -> Answer:
        found.put(frame)
        (answer,) = answers.get()
        return answer

    try:
        found.put(track(of, step, **options))
    except BaseException as error:
        found.put(error)
