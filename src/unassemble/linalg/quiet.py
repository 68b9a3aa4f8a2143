"""Libraries that print."""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_alone = threading.RLock()


@contextmanager
def quiet() -> Iterator[None]:
    """Nothing reaches the standard output, which may be a pipe to another program, while compiled code runs.

    What other threads print in the meantime is lost as well; a second one that asks for quiet waits.
    """
    with _alone:
        try:
            kept = os.dup(1)
        except OSError:  # closed, as in services
            yield
            return
        _flush()
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        try:
            yield
        finally:
            _flush()
            os.dup2(kept, 1)
            os.close(null)
            os.close(kept)


def _flush() -> None:
    """What is waiting to be printed, in Python and in C."""
    with suppress(Exception):
        sys.stdout.flush()
    with suppress(Exception):  # on Windows the C library goes by other names
        ctypes.CDLL(None).fflush(None)
