"""Time by stage."""

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

_log = logging.getLogger(__name__)


@dataclass
class Clock:
    """Seconds by stage; tells a listener as each begins."""

    listener: Callable[[str], None] | None = None
    timings: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Measure a stage; several of one name add up."""
        if self.listener:
            self.listener(stage)
        start = time.perf_counter()
        yield
        seconds = time.perf_counter() - start
        self.timings[stage] = self.timings.get(stage, 0.0) + seconds
        _log.info("%s: %.3g s", stage, seconds)
