"""What a search for labels may do."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SearchOptions:
    """Choices of the search, chosen on random meshes (``benchmarks/cells.py``); work is counted in solves."""

    most_vertices: int = 20_000  # of a graph whose labels are relaxed and searched for
    # work that a graph is worth: so many solves, and as much more
    solves: float = 150
    work: float = 2.5e5
    overhead: float = 500  # work that a solve costs beside one for each vertex
    # parts of what is left: for the last wrong ones of relaxed labels; for the likeliest start of the others, half of
    # what is left for each of the next; and of all, for cells that no embedding at hand has
    relaxing: float = 0.4
    first: float = 0.7
    widening: float = 0.25
    close: float = 0.15  # misfit of labellings that few cells are missing in
    # entries, as many as the misfit adds up to, that small changes can put right, each of which takes a ranking; and
    # the part of all entries that leaps can, which change many labels at once
    most_left: float = 120
    most_wrong: float = 0.25
    least_relaxed: int = 60  # vertices from which labels are relaxed
    # solves that a relaxation, a leap and ranking the changes of a labelling cost
    relaxation: float = 30
    leaping: float = 2
    ranking: float = 8
    leaps: int = 8  # changes of many labels at once, one after the other
    batch: int = 8  # small changes of a labelling that are tried at a time
    in_vain: int = 40  # changes in all without an improvement
    tried: float = 0.25  # a labelling with a batch tried is put off behind those with so much more misfit
    better: float = 0.9  # misfit, relative to the least before, that is an improvement worth its price
    # labellings whose changes are ranked for as much misfit as there is, if it goes on falling as it has; this is asked
    # after so many
    patience: int = 15
    at_least: int = 5
    # moves that are ranked at a time, as many as `moves_work` over the vertices; around a labelling that fits as many
    # as `beside_work` over the vertices
    moves: float = 1500
    moves_work: float = 3e5
    beside_work: float = 2e6
    # moves that are ranked together with what they touch, and those that are given before moves of three labels
    leaders: int = 60
    soon: int = 8
    # distance of the shift, relative, to the c at hand, so much nearer than to other maps that one step tells; and to
    # that of a labelling that fits
    near: float = 1e-3
    nearest: float = 1e-6
    faint: float = 1e-4  # mean misfit of moves that may fit as well

    def price(self, n: int) -> float:
        """Work of solving a labelling of n vertices."""
        return n + self.overhead

    def worth(self, n: int) -> float:
        """Work for a graph of n vertices, in one component or several."""
        return self.solves * self.price(n) + self.work


SEARCH = SearchOptions()
