"""What a user sees of long work: the stage that it is in, and no warnings of other libraries."""

import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from shutil import get_terminal_size
from typing import IO, Self

_SENTENCES = {
    "read": "reading the matrix",
    "check": "checking the matrix",
    "topology": "recognising triangles",
    "numbering": "finding nodes and directions",
    "null space": "solving for coordinates",
    "cells": "recognising elements",
    "conformal": "solving for positions",
    "faces": "telling cells from holes",
    "polish": "polishing",
    "metric": "solving for edge lengths",
    "realise": "looking for coordinates in space",
    "place": "placing pieces",
    "certify": "assembling the matrix again",
    "deviations": "computing standard deviations",
    "write": "writing",
    "plot": "drawing",
}


class StageDisplay:
    """One line with the present stage and the time elapsed; a context manager, called with each stage.

    It appears only if the stream is a terminal and the work takes longer than a moment, and vanishes at the end.

    The stream is standard error by default. Where the line is `wanted` it is shown on a stream that is no terminal as
    well, as in a notebook. `delay` and `interval` are seconds before it appears, and between its updates.
    """

    def __init__(
        self,
        stream: IO[str] | None = None,
        *,
        enabled: bool = True,
        wanted: bool = False,
        delay: float = 1.0,
        interval: float = 0.2,
    ):
        self._stream = stream or sys.stderr
        self._delay = delay
        self._interval = interval
        self._stage = ""
        self._start = time.time()
        self._done = threading.Event()
        shown = enabled and (wanted or self._stream.isatty())
        # A thread, because stages may spend minutes in compiled code that calls nobody.
        self._thread = threading.Thread(target=self._show, daemon=True) if shown else None

    def __call__(self, stage: str) -> None:
        """Tell that a stage begins."""
        self._stage = _SENTENCES.get(stage, stage)

    def __enter__(self) -> Self:
        if self._thread:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._done.set()
        if self._thread:
            self._thread.join()

    def _show(self) -> None:
        if self._done.wait(self._delay):
            return
        from tqdm import tqdm

        tqdm.monitor_interval = 0  # its own thread would wake up for nothing
        size = get_terminal_size()  # never zero, which some terminals say and tqdm would believe
        form = "{desc}, {elapsed}"
        with tqdm(file=self._stream, bar_format=form, leave=False, ncols=size.columns, nrows=size.lines) as line:
            line.start_t = self._start
            while True:
                line.set_description_str(self._stage or "working")
                if self._done.wait(self._interval):
                    return


@contextmanager
def quiet_libraries() -> Iterator[None]:
    """Warnings that come from other modules than this package's are not shown; its own are faults, and are."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"(?!unassemble\b)")
        yield
