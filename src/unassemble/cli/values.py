"""How option values are spelled; what they mean, the library checks."""

from __future__ import annotations

from typing import Any

import click

DROP_ZEROS = "--drop-zeros"
_TOLERANCE = "1e-12"


class OptionalTolerance(click.Command):
    """A command whose ``--drop-zeros`` may stand without its value.

    The value is taken only where the next word is a number, so that a file name is never swallowed.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Spell the default value out before click reads the words."""
        return super().parse_args(ctx, spelled_out(args))


def spelled_out(words: list[str]) -> list[str]:
    """Words of a command line with each bare ``--drop-zeros`` given its value."""
    end = words.index("--") if "--" in words else len(words)
    result = []
    for k, word in enumerate(words):
        bare = word == DROP_ZEROS and k < end and not (k + 1 < end and _is_number(words[k + 1]))
        result.append(f"{word}={_TOLERANCE}" if bare else word)
    return result


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


class Numbers(click.ParamType):
    """Rows, then numbers, separated by commas.

    Parameters
    ----------
    form : str
        As in the help text, ``ROW,X,Y[,Z]`` for one: each ROW is a matrix row, counted from 0; what stands in
        brackets may be left out.
    """

    def __init__(self, form: str):
        self.name = self._form = form
        self._parts = form.replace("[", "").replace("]", "").split(",")
        self._least = len(form.split("[")[0].split(","))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[Any, ...]:
        """Read a word."""
        if isinstance(value, tuple):
            return value
        words = value.split(",")
        try:
            numbers = tuple(int(w) if part == "ROW" else float(w) for part, w in zip(self._parts, words, strict=False))
        except ValueError as error:
            self.fail(f"{value!r} is not of the form {self._form} ({error})", param, ctx)
        if not self._least <= len(words) <= len(self._parts):
            self.fail(f"{value!r} is not of the form {self._form}", param, ctx)
        return numbers
