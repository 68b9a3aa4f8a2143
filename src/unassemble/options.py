"""Options of :func:`unassemble.recover`, one frozen type for each subject.

Each is checked when it is made, before any work: what is refused here has no meaning for any matrix.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import GeometryError, InputError
from .reductions import ConstantTensor

Direction = tuple[int, int, float]


@dataclass(frozen=True, kw_only=True)
class OperatorOptions:
    """What is said about the operator, and about how rows form nodes; as in :func:`unassemble.recover`."""

    operator: str = "auto"
    block_size: int | None = None
    numbering: Any = None
    cells: bool = True

    def __post_init__(self) -> None:
        _known("operator", self.operator, ("auto", "laplacian", "elasticity", "surface"))
        _number("block_size", self.block_size, Integral)
        if self.operator in ("laplacian", "surface") and self.names_nodes:
            raise InputError(
                f"`block_size` and `numbering` are for vector-valued matrices, not `operator={self.operator!r}`"
            )

    @property
    def names_nodes(self) -> bool:
        """Whether the matrix is said to have several rows per node."""
        return self.operator == "elasticity" or self.block_size is not None or self.numbering is not None


@dataclass(frozen=True, kw_only=True)
class FrameOptions:
    """What is known of the true positions and axes; as in :func:`unassemble.recover`.

    Anchors and the tensor are given as there, and held as tuples of (row, x, y) or (row, x, y, z), and as the type that
    undoes it.
    """

    anchors: Any = None
    tensor: Any = None
    direction: Direction | None = None
    handed: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "anchors", _listed_anchors(self.anchors))
        self._check_direction()
        if self.handed is not None:
            _known("handed", self.handed, ("left", "right"))
        line = self.direction is not None or len(self.anchors) > 1
        if self.handed and not line:
            raise InputError("`handed` needs a line to refer to: give `direction`, or two `anchors`, as well")
        if self.tensor is None:
            return
        try:
            object.__setattr__(self, "tensor", ConstantTensor(*map(float, self.tensor)))
        except (TypeError, ValueError) as error:
            raise InputError(f"`tensor` is three numbers, kxx, kxy and kyy, not {self.tensor!r}") from error
        if not (len(self.anchors) > 2 or (line and self.handed)):
            raise InputError(
                "`tensor` can be undone only with a known orientation: give three `anchors` that are not in line, or "
                "`direction` and `handed`"
            )

    def _check_direction(self) -> None:
        if self.direction is None:
            return
        try:
            first, second, degrees = self.direction
            good = int(first) == first and int(second) == second and first != second and np.isfinite(degrees)
        except (TypeError, ValueError, OverflowError):
            good = False
        if not good:
            raise InputError("`direction` is (row, row, degrees), with whole rows that differ and a finite angle")
        if len(self.anchors) > 1:
            raise InputError("`direction` and two or more `anchors` fix the same freedom: give one of them")
        object.__setattr__(self, "direction", (int(first), int(second), float(degrees)))


@dataclass(frozen=True, kw_only=True)
class ScalarOptions:
    """How the mesh of a scalar matrix is found; as in :func:`unassemble.recover`."""

    method: str = "conformal"
    refine: bool = True
    scale: float | None = None
    noise: float | None = None
    standard_deviations: bool = False
    triangulate: bool = False
    threads: int | None = None

    def __post_init__(self) -> None:
        _known("method", self.method, ("conformal", "angles"))
        _number("threads", self.threads, Integral)
        _number("scale", self.scale)
        _number("noise", self.noise)
        if self.scale is not None and not (self.scale and np.isfinite(self.scale)):
            raise InputError(f"`scale` is a finite nonzero number, not {self.scale}")
        if self.noise is not None and not (self.noise > 0 and np.isfinite(self.noise)):
            raise InputError(f"`noise` is a positive standard deviation, not {self.noise}")

    def check_scale(self, entries: NDArray[np.float64]) -> None:
        """Refuse a factor next to which entries vanish or overflow: no triangle has such angles."""
        largest = float(np.abs(entries).max(initial=0.0))
        with np.errstate(over="ignore", under="ignore"):
            ratio = 1.0 if self.scale is None else abs(np.float64(self.scale)) / largest
        if not np.finfo(float).eps ** 2 < ratio < np.finfo(float).eps ** -2:
            said = f"the scale {self.scale:g} is out of all proportion to the entries of the matrix, whose largest is "
            raise GeometryError(f"{said}{largest:.3g}")

    @property
    def polished(self) -> bool:
        """Whether positions are polished; those of the angles are not, so that a verdict on them is their own."""
        return self.refine and self.method == "conformal"


def _listed_anchors(anchors: Any) -> tuple[tuple[Any, ...], ...]:
    """Anchors as (row, x, y) or (row, x, y, z); a mapping has rows as keys and positions as values."""
    listed = []
    try:
        if isinstance(anchors, Mapping):
            anchors = [(row, *place) for row, place in anchors.items()]
        for row, *place in () if anchors is None else anchors:
            if isinstance(row, (str, bytes)) or int(row) != row or len(place) not in (2, 3):
                raise ValueError(row)
            listed.append((int(row), *map(float, place)))
    except (TypeError, ValueError, IndexError, OverflowError) as error:
        raise InputError(
            "`anchors` are (row, x, y), in space (row, x, y, z), or a mapping of rows to positions, with whole rows"
        ) from error
    rows, places = [row for row, *_ in listed], {tuple(place) for _, *place in listed}
    if min(rows, default=0) < 0:
        raise InputError(f"row {min(rows)} of `anchors` is not in the matrix: its rows count from 0")
    if len(set(rows)) < len(rows):
        raise InputError(f"row {next(row for row in rows if rows.count(row) > 1)} is anchored twice")
    if not all(np.isfinite(place).all() for place in places):
        raise InputError("a coordinate in `anchors` is not a finite number")
    if len(places) < len(rows):
        raise InputError("two `anchors` have the same position: different rows are different points")
    return tuple(listed)


def _known(name: str, value: str, words: tuple[str, ...]) -> None:
    if not isinstance(value, str) or value not in words:
        raise InputError(f"`{name}={value}` is unknown: use {' or '.join(map(repr, words))}")


def _number(name: str, value: Any, sort: type = Real) -> None:
    if value is not None and (isinstance(value, bool) or not isinstance(value, sort)):
        raise InputError(f"`{name}` is a {'whole ' if sort is Integral else ''}number, not {value!r}")
