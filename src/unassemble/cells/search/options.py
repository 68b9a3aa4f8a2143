"""What a search for labels may do."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SearchOptions:
    """Choices of the search, chosen on random meshes (``benchmarks/cells.py``); work is counted in solves.

    Attributes
    ----------
    most_vertices : int
        Of a graph whose labels are relaxed and searched for.
    solves, work : float
        Solves that a graph is worth: so many, and `work` over its vertices and `overhead` more.
    overhead : float
        Vertices that a graph costs as much as, whatever its size.
    relaxing, first, widening : float
        Parts of what is left: for the last wrong ones of relaxed labels; for the likeliest start of the others, half
        of what is left for each of the next; and of all, for cells that no embedding at hand has.
    close : float
        Misfit of labellings that few cells are missing in.
    most_left, most_wrong : float
        Entries, as many as the misfit adds up to, that small changes can put right, each of which takes a ranking; and
        the part of all entries that leaps can, which change many labels at once.
    least_relaxed : int
        Vertices from which labels are relaxed.
    relaxation, leaping, ranking : float
        Solves that a relaxation, a leap and ranking the changes of a labelling cost.
    leaps : int
        Changes of many labels at once, one after the other.
    batch : int
        Small changes of a labelling that are tried at a time.
    in_vain : int
        Changes in all without an improvement.
    tried : float
        A labelling with a batch tried is put off behind those with so much more misfit.
    better : float
        Misfit, relative to the least before, that is an improvement worth its price.
    patience, at_least : int
        Labellings whose changes are ranked for as much misfit as there is, if it goes on falling as it has; this is
        asked after so many.
    moves, moves_work, beside_work : float
        Moves that are ranked at a time, as many as `moves_work` over the vertices; around a labelling that fits as
        many as `beside_work` over the vertices.
    leaders, soon : int
        Moves that are ranked together with what they touch, and those that are given before moves of three labels.
    near, nearest : float
        Distance of the shift, relative, to the c at hand, so much nearer than to other maps that one step tells; and to
        that of a labelling that fits.
    faint : float
        Mean misfit of moves that may fit as well.
    """

    most_vertices: int = 20_000
    solves: float = 150
    work: float = 3e5
    overhead: float = 500
    relaxing: float = 0.4
    first: float = 0.7
    widening: float = 0.25
    close: float = 0.15
    most_left: float = 120
    most_wrong: float = 0.25
    least_relaxed: int = 60
    relaxation: float = 30
    leaping: float = 2
    ranking: float = 8
    leaps: int = 8
    batch: int = 8
    in_vain: int = 40
    tried: float = 0.25
    better: float = 0.9
    patience: int = 15
    at_least: int = 5
    moves: float = 1500
    moves_work: float = 3e5
    beside_work: float = 2e6
    leaders: int = 60
    soon: int = 8
    near: float = 1e-3
    nearest: float = 1e-6
    faint: float = 1e-4


DEFAULT = SearchOptions()
