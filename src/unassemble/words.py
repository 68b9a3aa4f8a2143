"""Numbers with their nouns."""

from __future__ import annotations

from collections.abc import Iterable


def count_of(number: int, noun: str, plural: str | None = None) -> str:
    """A number with its noun: ``1 row``, ``2 rows``, ``1,200 vertices``.

    Parameters
    ----------
    number : int
    noun : str
        In the singular.
    plural : str, optional
        The noun with an s by default.
    """
    return f"{number:,} {noun if number == 1 else plural or noun + 's'}"


def words_of(rows: Iterable[int]) -> str:
    """Row numbers in a sentence: ``3, 17, 18``."""
    return ", ".join(map(str, rows))
