"""Options of :func:`unassemble.recover`, checked before any work: what they mean does not depend on the matrix."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .errors import InputError
from .operators import OPERATORS

METHODS = ("conformal", "angles")


def check_options(
    *,
    operator: str,
    method: str | None,
    scale: float | None,
    noise: float | None,
    drop_zeros: float | None,
    tensor: Any,
    block_size: int | None,
    numbering: Any,
    threads: int | None,
) -> None:
    """Refuse values that no matrix can give a meaning to.

    Raises
    ------
    InputError
    """
    if operator not in OPERATORS:
        raise InputError(f"`operator={operator}` is not available in this version: use {_words(OPERATORS)}")
    if method not in (None, *METHODS):
        raise InputError(f"`method={method}` is not available in this version: use {_words(METHODS)}")
    for name, value in (("scale", scale), ("noise", noise), ("drop_zeros", drop_zeros)):
        if value is not None and not _is_number(value):
            raise InputError(f"`{name}` is a number, not {value!r}")
    if scale is not None and not (np.isfinite(scale) and scale != 0):
        raise InputError(f"`scale` is a finite nonzero number, not {scale}")
    if noise is not None and not (np.isfinite(noise) and noise > 0):
        raise InputError(f"`noise` is a positive standard deviation, not {noise}")
    for name, count in (("block_size", block_size), ("threads", threads)):
        if count is not None and (isinstance(count, bool) or not isinstance(count, (int, np.integer))):
            raise InputError(f"`{name}` is a whole number, not {count!r}")
    if tensor is not None and not _are_numbers(tensor, 3):
        raise InputError(f"`tensor` is three numbers, kxx, kxy and kyy, not {tensor!r}")
    if operator == "laplacian" and not (block_size is None and numbering is None):
        raise InputError("`block_size` and `numbering` belong to vector-valued matrices, not to `operator='laplacian'`")


def listed_anchors(anchors: Any) -> list[tuple[Any, ...]]:
    """Anchors as (row, x, y) or (row, x, y, z), rows as int where they are whole; arrays are taken row by row.

    Raises
    ------
    InputError
    """
    try:
        return [_anchor(one) for one in (() if anchors is None else anchors)]
    except (TypeError, ValueError, IndexError) as error:
        raise InputError("`anchors` are (row, x, y), in space (row, x, y, z), with whole rows") from error


def _anchor(one: Any) -> tuple[Any, ...]:
    row, *place = one
    if isinstance(row, (str, bytes)) or int(row) != row:
        raise ValueError(row)
    return int(row), *map(float, place)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _are_numbers(values: Any, count: int) -> bool:
    return isinstance(values, Iterable) and len(found := list(values)) == count and all(map(_is_number, found))


def _words(known: Iterable[str]) -> str:
    return " or ".join(map(repr, known))
