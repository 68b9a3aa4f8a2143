"""Other libraries' warnings, kept from a user who can do nothing about them."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def quiet_libraries() -> Iterator[None]:
    """Warnings that come from other modules than this package's are not shown; its own are faults, and are."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"(?!unassemble\b)")
        yield
