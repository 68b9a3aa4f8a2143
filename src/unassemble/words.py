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


def kind_text(euler: int, orientable: bool, loops: int) -> str:
    """What kind of surface has this Euler characteristic and number of boundary loops."""
    extra = 2 - int(loops) - int(euler)
    sort = count_of(extra // 2, "handle") if orientable else f"one-sided, {count_of(extra, 'cross-cap')}"
    rim = count_of(int(loops), "boundary loop") if loops else "closed"
    return f"{rim}, {sort}, Euler characteristic {euler}"
