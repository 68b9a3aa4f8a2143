"""Counted work: what bounds every search, so that an answer never depends on the load of a machine."""

from __future__ import annotations

from dataclasses import dataclass

AT_ONCE = 1 << 22
"""Numbers that array code makes in one go: 32 MB of them in double precision."""

LARGE = 20_000
"""Order beyond which what is far from linear, in time or in memory, is left out or replaced."""

REFINEMENTS = 30
"""Steps of iterative refinement at most; where it converges it takes far fewer."""

REDRAWN = 8
"""Times that rounding, or noise, is drawn anew to see what it does: their scale is then known to a factor of three."""

SAMPLE = 2000
"""Rows, cells or faces of which a share, a median or a fit is taken where all of them would tell the same."""


@dataclass
class Budget:
    """Work that a search may do, in units of about one matrix entry touched once.

    A sparse product costs its number of stored entries, a factorisation the entries of its factors times their mean
    number in a column, a step of plain Python about a hundred. Nothing is measured: the same search spends the same
    on every machine.
    """

    work: float  # units in all; infinite for a search that its caller bounds otherwise
    spent: float = 0.0  # units taken so far, those of shares included
    parent: Budget | None = None

    @property
    def left(self) -> float:
        """Units that can still be taken, here and from every budget that this one is a share of."""
        own = self.work - self.spent
        return own if self.parent is None else min(own, self.parent.left)

    def take(self, cost: float) -> bool:
        """Take `cost` units and say True; where fewer are left take none and say False."""
        if cost > self.left:
            return False
        budget: Budget | None = self
        while budget is not None:
            budget.spent += cost
            budget = budget.parent
        return True

    def share(self, part: float) -> Budget:
        """A budget of the fraction `part` of what is left; what is taken from it is taken from this one too."""
        return Budget(part * self.left, parent=self)
