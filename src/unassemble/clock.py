"""Time by stage."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

_log = logging.getLogger(__name__)


@dataclass
class Clock:
    """Seconds by stage; tells a listener as each begins.

    Of a stage within another the time counts for the inner one only: all of them add up to the time that passed.
    """

    listener: Callable[[str], None] | None = None
    timings: dict[str, float] = field(default_factory=dict)
    _inside: list[float] = field(default_factory=lambda: [0.0], repr=False)  # seconds of stages within each open one

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Measure a stage; several of one name add up."""
        if self.listener:
            self.listener(stage)
        self._inside.append(0.0)
        start = time.perf_counter()
        try:
            yield
        finally:
            whole = time.perf_counter() - start
            seconds = whole - self._inside.pop()
            self._inside[-1] += whole
        self.timings[stage] = self.timings.get(stage, 0.0) + seconds
        _log.info("%s: %.3g s", stage, seconds)
