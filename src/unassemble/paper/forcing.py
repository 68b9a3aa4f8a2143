"""How accurately each Jacobian system is solved: the forcing terms of section 3.3."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..errors import InputError

Forcing = Callable[[Sequence[float], float], float]


def powers(base: float) -> Forcing:
    """base^-i at the i-th outer step, i = 1, 2, ...: Dembo's 2^-i, the paper's 1.1^-i (reference [2])."""

    def eta(norms: Sequence[float], previous: float) -> float:
        return base ** -len(norms)

    return eta


def exact(tolerance: float = 1e-10) -> Forcing:
    """The same number always: Newton's method (7), if it is small."""

    def eta(norms: Sequence[float], previous: float) -> float:
        return tolerance

    return eta


def eisenstat_walker(norms: Sequence[float], previous: float) -> float:
    """Choice 2 with gamma = 0.9, alpha = 2, with its safeguard; today's choice.

    References
    ----------
    Eisenstat, Walker, "Choosing the forcing terms in an inexact Newton method", SIAM J. Sci. Comput. 17, 1996.
    """
    if len(norms) < 2:
        return 0.5
    eta = 0.9 * (norms[-1] / norms[-2]) ** 2
    floor = 0.9 * previous**2
    return min(0.9, max(eta, floor) if floor > 0.1 else eta)


FORCINGS: dict[str, Forcing] = {
    "2^-i": powers(2.0),
    "1.1^-i": powers(1.1),
    "eisenstat-walker": eisenstat_walker,
    "newton": exact(),
}


def forcing(name: str | float) -> Forcing:
    """Look a forcing term up by its name; a number is the same tolerance always."""
    if isinstance(name, float):
        return exact(name)
    if name not in FORCINGS:
        raise InputError(f"there is no forcing term {name!r}; the choices are {', '.join(FORCINGS)}")
    return FORCINGS[name]
