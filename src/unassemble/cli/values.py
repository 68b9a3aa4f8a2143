"""What option values mean; nothing here needs the matrix."""

from __future__ import annotations

import math
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


class Number(click.ParamType):
    """A finite number, possibly restricted.

    Parameters
    ----------
    what : str
        Ends the sentence "... is not" for values that are refused.
    accepts : callable
    """

    name = "number"

    def __init__(self, what: str = "a finite number", accepts: Any = lambda value: True):
        self._what = what
        self._accepts = accepts

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Read a word."""
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not (math.isfinite(number) and self._accepts(number)):
            self.fail(f"{value!r} is not {self._what}", param, ctx)
        return number


class Numbers(click.ParamType):
    """Rows, then finite numbers, separated by commas.

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
        if not self._least <= len(words) <= len(self._parts):
            self.fail(f"{value!r} is not of the form {self._form}", param, ctx)
        return tuple(
            self._row(word, param, ctx) if part == "ROW" else self._number(word, param, ctx)
            for part, word in zip(self._parts, words, strict=False)
        )

    def _row(self, word: str, param: click.Parameter | None, ctx: click.Context | None) -> int:
        try:
            row = int(word)
        except ValueError:
            row = -1
        if row < 0:
            self.fail(f"{word.strip()!r} is not a row of a matrix: rows count from 0", param, ctx)
        return row

    def _number(self, word: str, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            self.fail(f"{word.strip()!r} is not a finite number", param, ctx)
        return number


def check_anchors(
    ctx: click.Context, param: click.Parameter, anchors: tuple[tuple[Any, ...], ...]
) -> tuple[tuple[Any, ...], ...]:
    """Refuse a row that is anchored twice."""
    rows = [anchor[0] for anchor in anchors]
    twice = next((row for k, row in enumerate(rows) if row in rows[:k]), None)
    if twice is not None:
        raise click.BadParameter(f"row {twice} is anchored twice", ctx, param)
    return anchors


def check_tensor(
    ctx: click.Context, param: click.Parameter, tensor: tuple[float, float, float] | None
) -> tuple[float, float, float] | None:
    """Refuse a tensor that is not positive definite."""
    if tensor is None:
        return None
    kxx, kxy, kyy = tensor
    if not (kxx > 0 and kyy > 0 and kxx * kyy > kxy * kxy):
        raise click.BadParameter("the tensor is not positive definite: both eigenvalues must be above 0", ctx, param)
    return tensor


def check_orientation(tensor: Any, anchors: tuple[tuple[Any, ...], ...], direction: Any, handed: str | None) -> None:
    """Refuse a tensor whose axes are not known, and a side of no line.

    Raises
    ------
    click.UsageError
    """
    line = direction is not None or len(anchors) > 1
    if handed and not line:
        raise click.UsageError("--handed needs a line to refer to: give --direction, or two --anchor, as well")
    if tensor and not (spans_plane(anchors) or (line and handed)):
        missing = "--handed left|right as well" if line else "--direction ROW,ROW,DEGREES with --handed left|right"
        raise click.UsageError(
            "--tensor can be undone only with a known orientation: "
            f"give three --anchor that are not in line, or {missing}"
        )


def spans_plane(anchors: tuple[tuple[Any, ...], ...]) -> bool:
    """Whether known positions are not all on one line."""
    if len(anchors) < 3:
        return False
    _, x0, y0 = anchors[0][:3]
    arms = [(x - x0, y - y0) for _, x, y, *_ in anchors[1:]]
    u, v = max(arms, key=lambda arm: math.hypot(*arm))
    return max(abs(u * y - v * x) for x, y in arms) > 1e-9 * (u * u + v * v)
