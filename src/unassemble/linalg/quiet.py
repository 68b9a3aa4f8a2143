"""Libraries that print."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def quiet() -> Iterator[None]:
    """Nothing that compiled code prints reaches the standard output, which may be a pipe to another program."""
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
