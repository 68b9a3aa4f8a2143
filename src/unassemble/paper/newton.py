"""Newton's iteration (7) and the inner-outer iteration (paper, sections 3.2 and 3.3)."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .bicg import bicg
from .cgls import cgls
from .equations import AngleSystem
from .forcing import forcing
from .krylov import KrylovResult, LinearMap
from .lsqr import lsqr
from .square import Picked, square_rows

_log = logging.getLogger(__name__)

Inner = Literal["cgls", "lsqr", "bicg"]


@dataclass(frozen=True)
class NewtonOptions:
    """Settings of the outer iteration.

    Attributes
    ----------
    forcing : {"newton", "2^-i", "1.1^-i", "eisenstat-walker"} or float
        How accurately each step is solved for; "newton" is (7) itself, with 1e-10. A number is the same always.
    inner : {"cgls", "lsqr", "bicg"}
        The Krylov method; bicg works on the square system of picked interior equations.
    square : {"interior", "edges"}
        The equations that bicg leaves out.
    tolerance : float
        The residual norm |F| to reach.
    max_outer, max_inner, max_products : int
        Outer steps; inner steps of one outer step; products with J and its transpose in all.
    damped : bool
        Halve a step until |F| falls. The paper takes whole steps.
    divergence : float
        Give up when |F| exceeds this many times its first value.
    """

    forcing: str | float = "1.1^-i"
    inner: Inner = "cgls"
    square: Literal["interior", "edges"] = "interior"
    tolerance: float = 1e-6
    max_outer: int = 200
    max_inner: int = 20_000
    max_products: int = 400_000
    damped: bool = False
    divergence: float = 1e4

    def __post_init__(self) -> None:
        forcing(self.forcing)
        if self.inner not in ("cgls", "lsqr", "bicg"):
            raise InputError(f"there is no inner method {self.inner!r}; the choices are cgls, lsqr, bicg")
        if self.tolerance <= 0 or min(self.max_outer, self.max_inner, self.max_products) < 1:
            raise InputError("the tolerance and all limits of the angle iteration must be positive")


@dataclass(frozen=True, eq=False)
class History:
    """One entry for the start and one for each outer step.

    Attributes
    ----------
    residuals : (k + 1,) float64
        |F|.
    inner_steps : (k + 1,) int64
        Krylov steps so far.
    factors : (k + 1,) float64
        The paper's c.
    """

    residuals: NDArray[np.float64]
    inner_steps: NDArray[np.int64]
    factors: NDArray[np.float64]

    def steps_to(self, reduction: float) -> int | None:
        """Krylov steps until |F| had fallen by this factor; None if it never had."""
        reached = np.flatnonzero(self.residuals <= reduction * self.residuals[0])
        return int(self.inner_steps[reached[0]]) if len(reached) else None

    def continued(self, other: History) -> History:
        """Its steps, and those of another that started where it ended."""
        return History(
            np.r_[self.residuals, other.residuals[1:]],
            np.r_[self.inner_steps, self.inner_steps[-1] + other.inner_steps[1:]],
            np.r_[self.factors, other.factors[1:]],
        )


@dataclass(frozen=True, eq=False)
class NewtonResult:
    """Where the outer iteration ended.

    Attributes
    ----------
    x : (unknowns,) float64
        The iterate of least residual.
    converged : bool
    status : str
        One sentence.
    history : History
    products : int
        With J and with its transpose.
    """

    x: NDArray[np.float64]
    converged: bool
    status: str
    history: History
    products: int


def solve(system: AngleSystem, start: NDArray, options: NewtonOptions | None = None) -> NewtonResult:
    """Inner-outer iteration on F(x) = 0 from the unknowns `start`, deterministic."""
    options = options or NewtonOptions()
    rows = _rows(system, options)
    eta_of = forcing(options.forcing)
    x = best = start.copy()
    residual = system.residual(x)
    norms, steps, factors = [float(np.linalg.norm(residual))], [0], [system.factor(x)]
    products, eta, status = 0, 1.0, None
    while status is None:
        eta = eta_of(norms, eta)
        inner = _inner(system, x, residual, rows, eta, options, products)
        x, residual = _step(system, x, residual, inner.step, options)
        products += 2 * inner.steps + (options.inner != "bicg")
        norms.append(float(np.linalg.norm(residual)))
        steps.append(steps[-1] + inner.steps)
        factors.append(system.factor(x))
        if norms[-1] <= min(norms):
            best = x
        _log.debug("outer step %d: |F| = %.3e, %d inner steps", len(norms) - 1, norms[-1], inner.steps)
        status = _verdict(norms, steps, products, options)
    history = History(np.array(norms), np.array(steps), np.array(factors))
    return NewtonResult(best, norms[-1] <= options.tolerance, status, history, products)


def _rows(system: AngleSystem, options: NewtonOptions) -> NDArray | None:
    """Rows of the square system for bicg; None for the least-squares methods, which take all."""
    if options.inner != "bicg":
        return None
    if options.square == "interior":
        first, last = system.row_of_interior, system.row_of_edges
    else:
        first, last = system.row_of_edges, system.row_of_loops
    return square_rows((system.n_equations, system.n_unknowns), first, last)


def _inner(
    system: AngleSystem,
    x: NDArray,
    residual: NDArray,
    rows: NDArray | None,
    eta: float,
    options: NewtonOptions,
    products: int,
) -> KrylovResult:
    matrix: LinearMap = system.jacobian(x)
    most = min(options.max_inner, max(1, (options.max_products - products) // 2))
    if rows is not None:
        return bicg(Picked(matrix, rows), -residual[rows], tolerance=eta, max_steps=most)
    method = cgls if options.inner == "cgls" else lsqr
    return method(matrix, -residual, tolerance=eta, max_steps=most)


def _step(
    system: AngleSystem, x: NDArray, residual: NDArray, step: NDArray, options: NewtonOptions
) -> tuple[NDArray, NDArray]:
    """The whole step, kept inside (8); halved until the residual falls where that is asked for."""
    size = float(np.linalg.norm(residual))
    for _ in range(30):
        new, _ = system.advance(x, step)
        value = system.residual(new)
        if not options.damped or float(np.linalg.norm(value)) < size:
            break
        step = step / 2
    return new, value


def _verdict(norms: list[float], steps: list[int], products: int, options: NewtonOptions) -> str | None:
    """A sentence if the iteration is over."""
    reached = f"the residual of the angle equations is {norms[-1]:.1e}"
    if norms[-1] <= options.tolerance:
        return f"converged: {reached} after {len(norms) - 1} outer and {steps[-1]} inner steps"
    if not np.isfinite(norms[-1]) or norms[-1] > options.divergence * norms[0]:
        return f"diverged: {reached} after {len(norms) - 1} outer steps; try a forcing term, or another start"
    if steps[-1] == steps[-2]:
        return f"broke down: {reached}, and the inner iteration took no step; try cgls or lsqr"
    if products >= options.max_products:
        return f"stopped: {reached} after {products} products, the most allowed; allow more, or another start"
    if len(norms) - 1 >= options.max_outer:
        return f"stopped: {reached} after {len(norms) - 1} outer steps, the most allowed; allow more, or another start"
    return None
