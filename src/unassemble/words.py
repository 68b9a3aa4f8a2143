"""Numbers with their nouns, and sentences."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


def count_of(number: int, noun: str, plural: str | None = None) -> str:
    """A number with its noun: ``1 row``, ``2 rows``, ``1,200 vertices``; the plural has an s by default."""
    return f"{number:,} {noun if number == 1 else plural or noun + 's'}"


def words_of(rows: Iterable[int]) -> str:
    """Row numbers in a sentence: ``3, 17, 18``."""
    return ", ".join(map(str, rows))


def sentences(parts: Iterable[str]) -> str:
    """The first two of some sentences, the important ones first: ``one thing. Another thing``.

    Each comes without its full stop, and beginning small; empty ones are left out.
    """
    chosen = [part for part in parts if part][:2]
    return ". ".join(part if k == 0 else part[:1].upper() + part[1:] for k, part in enumerate(chosen))


# What to do about rows, where a body or a structure is not certified.
GIVE_NUMBERING = "give the numbering if it is known"
WITHOUT_SUPPORTS = "assemble the matrix without supports, if that can be done"


@dataclass(frozen=True, init=False)
class Reason:
    """Something that speaks for or against an answer, and what to do about it."""

    #: The important one first. Each comes without its full stop, and beginning small.
    sentences: tuple[str, ...]
    #: What to do next, in one clause; empty where there is nothing to do.
    advice: str

    def __init__(self, *sentences: str, advice: str = "") -> None:
        object.__setattr__(self, "sentences", tuple(filter(None, sentences)))
        object.__setattr__(self, "advice", advice)

    def but(self, *, advice: str) -> Reason:
        """The same with another advice."""
        return Reason(*self.sentences, advice=advice)

    def __str__(self) -> str:
        return sentences(self.sentences)


def kind_text(euler: int, orientable: bool, loops: int) -> str:
    """What kind of surface has this Euler characteristic and number of boundary loops."""
    extra = 2 - int(loops) - int(euler)
    sort = count_of(extra // 2, "handle") if orientable else f"one-sided, {count_of(extra, 'cross-cap')}"
    rim = count_of(int(loops), "boundary loop") if loops else "closed"
    return f"{rim}, {sort}, Euler characteristic {euler}"
