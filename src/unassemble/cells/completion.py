"""Components whose triangles do not explain the matrix: cells looked for, vanished entries put back."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ..budget import Budget
from ..errors import GeometryError, RecoveryError
from ..matrix import OperatorMatrix
from ..planar.piece import PieceMesh
from ..tolerances import LITTLE
from ..topology import LocalNumbering, Piece, Polygons, Topology, components, located, require_planar
from ..topology.keys import contains, distinct, pair_keys
from .doubt import Attempt, Outcome, Solved, unexplained
from .judge.labelling import Labelling, add_differing_factors
from .judge.within_errors import misfits
from .search.options import SEARCH
from .search.search import first_labelling, label_cells
from .undivided import undivided


@dataclass(frozen=True, eq=False)
class _Component:
    """What components of the graph were found to be; rows of edges are left as they are."""

    pieces: Solved
    vanished: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))
    polygons: Polygons = field(default_factory=Polygons.none)


def completed(
    matrix: OperatorMatrix,
    topology: Topology,
    attempt: Attempt,
    doubtful: NDArray[np.bool_],
    scale: float | None = None,
) -> tuple[OperatorMatrix, Topology, list[Outcome]]:
    """Read every doubtful component again.

    `topology`: surfaces of 3-cycles, see :func:`unassemble.topology.surfaces`; `attempt`: gives positions of one of its
    pieces, or says why there are none; `doubtful` (n,): see :func:`in_doubt`; `scale`: c, where it is known.

    Returns the matrix with the vanished entries of the cells' triangles as zeros; its topology, components of which
    nothing can be made being among its failures; and unpolished positions of each piece, or why there are none.

    Raises RecoveryError if no component has cells.
    """
    kept = [(piece, attempt(piece)) for piece in topology.pieces if not doubtful[piece.vertices[0]]]
    parts = [_Component(kept)]
    failures: list[RecoveryError] = []
    label, found = np.full(matrix.n, -1), components(matrix.n, matrix.edges)
    for k, part in enumerate(found):
        label[part.vertices] = k
    own: list[list[Piece]] = [[] for _ in found]
    for piece in topology.pieces:
        own[label[piece.vertices[0]]].append(piece)

    by_graph_alone = matrix.unweighted and scale is None
    budget = Budget(0 if by_graph_alone else SEARCH.worth(matrix.n))
    for part, pieces in zip(found, own, strict=True):
        if not doubtful[part.vertices[0]]:
            continue
        try:
            parts.append(_labelled(matrix, part, pieces, attempt, scale, budget))
        except RecoveryError as error:
            failures.append(located(error, part, named=len(found) > 1))
    if not any(part.pieces for part in parts):
        raise failures[0]
    return _merged(matrix, topology, parts, tuple(map(str, failures)))


def guessed(matrix: OperatorMatrix, topology: Topology) -> tuple[OperatorMatrix, Topology]:
    """The cells that the angles suggest in components with nonzero entries on no triangle; nothing is solved.

    Parameters and results are those of :func:`completed`, without positions.
    """
    doubtful = unexplained(matrix, topology)
    unsolved = GeometryError("not solved")
    kept: Solved = [(piece, unsolved) for piece in topology.pieces if not doubtful[piece.vertices[0]]]
    parts = [_Component(kept)]
    for part in components(matrix.n, matrix.edges):
        if doubtful[part.vertices[0]]:
            labelling = first_labelling(len(part.vertices), part.edges, -matrix.entries[part.edge_rows])
            if labelling is not None:
                parts.append(_part(matrix, part, labelling))
    return _merged(matrix, topology, parts, ())[:2]


def _labelled(
    matrix: OperatorMatrix,
    numbering: LocalNumbering,
    own: list[Piece],
    attempt: Attempt,
    scale: float | None,
    budget: Budget,
) -> _Component:
    """One component: the labelling that fits, or the triangles that there were, or the best labelling."""
    weights = -matrix.entries[numbering.edge_rows]
    errors = None if matrix.errors is None else matrix.errors[numbering.edge_rows]
    labelling = label_cells(len(numbering.vertices), numbering.edges, weights, scale, errors, budget)
    if labelling is not None and labelling.fits:
        return _part(matrix, numbering, labelling)
    before = _Component([(piece, attempt(piece)) for piece in own])
    misfit = misfits(matrix.n, matrix.edges, -matrix.entries, before.pieces)
    if placed := [(piece, mesh) for piece, mesh in before.pieces if isinstance(mesh, PieceMesh)]:
        add_differing_factors(placed, misfit, scale)
    size = float(np.sqrt(np.mean(misfit[numbering.edge_rows] ** 2)))
    if labelling is not None and labelling.size < LITTLE * size and labelling.misfit.max() < 1:
        return _part(matrix, numbering, labelling)
    n, e = len(numbering.vertices), len(numbering.edges)
    if labelling is None or not own:
        require_planar(n, numbering.edges)
    if own:
        return before
    raise GeometryError(
        f"of the meshes tried on the graph of the matrix, which is planar ({n} rows, {e} entries above the diagonal), "
        "none has its entries: they may belong to no mesh, as those of a network, or lack zeros that should be stored"
    )


def _part(matrix: OperatorMatrix, numbering: LocalNumbering, labelling: Labelling) -> _Component:
    """A labelling in the numbering of the matrix."""
    vertices = numbering.vertices
    pieces: Solved = [
        (replace(piece, vertices=vertices[piece.vertices]), mesh or GeometryError("no map fits the entries of a piece"))
        for piece, mesh in zip(labelling.pieces, labelling.meshes, strict=True)
    ]
    pairs = np.sort(vertices[labelling.edges], axis=1)
    added = ~contains(pair_keys(matrix.n, *matrix.edges.T), pair_keys(matrix.n, *pairs.T))
    return _Component(pieces, pairs[added], undivided([piece for piece, _ in pieces], added)[1])


def _merged(
    matrix: OperatorMatrix, topology: Topology, parts: list[_Component], failures: tuple[str, ...]
) -> tuple[OperatorMatrix, Topology, list[Outcome]]:
    """All parts on one list of edges."""
    n = matrix.n
    given = pair_keys(n, *matrix.edges.T)
    vanished = np.concatenate([part.vanished for part in parts])
    keys = distinct(np.concatenate([given, pair_keys(n, *vanished.T)]))
    edges = np.column_stack([keys // n, keys % n])
    entries = np.zeros(len(keys))
    old = np.searchsorted(keys, given)
    entries[old] = matrix.entries
    solved = sorted((item for part in parts for item in part.pieces), key=lambda item: int(item[0].vertices.min()))
    ends = [piece.vertices[piece.edges].T for piece, _ in solved]
    pieces = tuple(
        replace(piece, edge_rows=np.searchsorted(keys, pair_keys(n, *pair)))
        for (piece, _), pair in zip(solved, ends, strict=True)
    )
    whole = replace(
        topology,
        edges=edges,
        pieces=pieces,
        method="the numbers",
        failures=(*topology.failures, *failures),
        vanished=np.delete(np.arange(len(keys)), old),
        polygons=Polygons.joined([part.polygons for part in parts]),
    )
    errors = None if matrix.errors is None else np.zeros(len(keys))
    if errors is not None and matrix.errors is not None:
        errors[old] = matrix.errors
    return replace(matrix, edges=edges, entries=entries, errors=errors), whole, [mesh for _, mesh in solved]
