"""Runs of trackers in loops of their own."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from .commands import track
from .errors import InputError
from .tracking import Answer, Frame

if TYPE_CHECKING:
    from .benchmark_set import Set
    from .measuring import Run

#: Seconds for a frame: people look at frames in notebooks.
_PATIENCE_S = 86_400


class Session:
    """A run of a tracker in a loop of your own, recorded as :func:`track` does; ``set.tracking(seed=0)`` begins it.

    ``frame`` is the one whose pose is wanted, None after the last. ``out``, ``name``, ``frame_limit`` (a day) and
    ``force`` are those of :func:`track`. A session that is left early leaves no run.

    >>> session = Set("sets/walk").tracking(seed=3)
    >>> for frame in session:
    ...     following = session.step(frame.info.start.markers)
    >>> session.run.estimate["seeds"].tolist(), session.run.evaluate().grade
    ([3], 'poor')
    """

    def __init__(self, of: Set, *, seed: int = 0, name: str = "session", **options: Any) -> None:
        if unknown := sorted(options.keys() - {"out", "frame_limit", "force"}):
            raise TypeError(f"a session has no option {', '.join(unknown)}; it has out, frame_limit and force")
        self._found: SimpleQueue[Any] = SimpleQueue()
        self._answers: SimpleQueue[Any] = SimpleQueue()
        self._run: Run | None = None
        self._frames = of.frames
        options = {"seed": seed, "name": name, "frame_limit": _PATIENCE_S, **options}
        # the thread does not hold the session, so that one that nobody has ends
        arguments = (of, options, self._found, self._answers)
        threading.Thread(target=_relay, args=arguments, daemon=True).start()
        self.frame: Frame | None = self._next()

    def step(self, answer: Answer) -> Frame | None:
        """Answers the frame, as a tracker does: None for a lost one; returns the next frame, None after the last.

        Raises:
            TrackerError: it is no estimate; the session is over.
            InputError: the session is over.
        """
        if self.frame is None:
            raise InputError(f"all {self._frames} frames are answered" if self._run else "the session is over")
        self.frame = None
        self._answers.put((answer,))
        self.frame = self._next()
        return self.frame

    def _next(self) -> Frame | None:
        found = self._found.get()
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
            raise InputError(
                f"{left}: expected session.step(...) for each of {self._frames} frames, None for a lost one"
            )
        return self._run

    def close(self) -> None:
        """Ends the session; one with unanswered frames leaves no run."""
        if self.frame is not None:
            self.frame = None
            self._answers.put(())
            self._found.get()

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        if answers := self.__dict__.get("_answers"):  # not if __init__ was called wrongly
            answers.put(())

    def __iter__(self) -> Iterator[Frame]:
        while (frame := self.frame) is not None:
            yield frame
            steps = (self._frames if self.frame is None else self.frame.index) - frame.index
            if steps != 1:
                self.close()
                raise InputError(f"expected one session.step(...) for frame {frame.index}, found {steps}")


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
