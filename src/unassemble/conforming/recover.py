"""A scalar matrix of any planar element on one page: cells, positions, place, certificate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..cells import Alternative
from ..certificate import Unique
from ..clock import Clock
from ..elements.surface import fields_of
from ..errors import GeometryError, SolverError, TopologyError
from ..matrix import OperatorMatrix
from ..options import ScalarOptions
from ..recovery import ConformingMesh, PlanarMesh
from ..scalar.noise import Noise, with_vanished
from ..scalar.placement import Placement
from ..scalar.recover import finished, small
from ..scalar.solving import Solved, Task
from ..topology import Topology, local_numbering
from ..topology.keys import distinct, pair_keys
from ..words import Reason
from .fit import Fitted, fitted
from .parts import Part, parts_of, reversal
from .roles import OrderedCells, ordered_cells
from .sets import node_sets


def recover_conforming(
    stored: OperatorMatrix, shown: Iterable[OrderedCells], placement: Placement, clock: Clock, options: ScalarOptions
) -> PlanarMesh:
    """The mesh of a checked scalar matrix, certified or the nearest.

    `shown`: see :func:`shown_cells`. Raises TopologyError if rows form no cells, GeometryError if the entries fit none
    that they form.
    """
    task = Task(options, placement, Noise.known(stored, options.noise))
    failure: Exception = TopologyError("no sets of rows that are coupled to each other are cells of any known element")
    best: PlanarMesh | None = None
    remaining, even, all_of_it = iter(shown), False, small(stored)
    while best is None or not best.certified or ((all_of_it or even) and best.uniqueness != "proved"):
        with clock("cells"):
            cells = next(remaining, None)
        if cells is None:
            break
        even = cells.even
        try:
            mesh = _recovered(stored, cells, clock, task)
        except (TopologyError, GeometryError, SolverError) as error:
            failure = error
            continue
        if best is not None and best.certified and mesh.certified:
            return _ambiguous(best, mesh)
        if best is None or (not best.certified and (mesh.certified or mesh.backward_error < best.backward_error)):
            best = mesh
    if best is None:
        raise failure
    # Few cells, or cells that are all alike, have hardly any entries that differ, and fit those of masses as well.
    sign = np.sign(stored.diagonal[0]) if len(stored.edges) else 0.0
    if sign and (sign * stored.diagonal > 0).all() and (sign * stored.entries > 0).all():
        return replace(best, verdict=best.verdict.beside(_LIKE_MASS))
    return best


_LIKE_MASS = Reason("all entries have one sign, as those of a mass matrix have, and this may be one on other cells")


def _ambiguous(one: PlanarMesh, other: PlanarMesh) -> PlanarMesh:
    """A mesh beside which another fits."""
    rows = [
        {frozenset(cell): tuple(cell) for some in mesh.cells.values() for cell in some.tolist()}
        for mesh in (one, other)
    ]
    differ = [
        tuple(mine[key] for key in sorted(mine, key=sorted) if key not in theirs) for mine, theirs in (rows, rows[::-1])
    ]
    other_cells = (Alternative(differ[0], differ[1]),)
    return replace(one, verdict=one.verdict.beside(_OTHER_SIDES), alternatives=other_cells)


_OTHER_SIDES = Reason(
    "another mesh has the matrix as well, which does not tell which sides the cells of this mesh have"
)


def shown_cells(
    stored: OperatorMatrix, *, mass: bool = False, lost: NDArray[np.bool_] | None = None
) -> Iterator[OrderedCells]:
    """Cells that the rows may form, the likeliest first; with a mass term, or others `lost` at some rows, (n,) bool."""
    numbering = local_numbering(stored.n, stored.edges)
    order = numbering.vertices
    near = OperatorMatrix(
        stored.n,
        numbering.edges,
        stored.entries[numbering.edge_rows],
        stored.diagonal[order],
        replaced=None if stored.replaced is None else stored.replaced[order],
    )
    for sets in node_sets(near, None if lost is None else lost[order]):
        with suppress(TopologyError):
            blocks, told = ordered_cells(near, sets, mass=mass, lost=lost is not None)
            yield OrderedCells({kind: order[cells] for kind, cells in blocks.items()}, told, order, sets.even)


def _recovered(stored: OperatorMatrix, cells: OrderedCells, clock: Clock, task: Task) -> PlanarMesh:
    with clock("cells"):
        parts = parts_of(cells)
        matrix, topology = _with_zeros(stored, parts)
    with clock("positions"):
        errors = with_vanished(topology, task.noise)
        own = [piece.edge_rows for piece in topology.pieces]
        fits = [fitted(part, -matrix.entries[o], errors[o], task) for part, o in zip(parts, own, strict=True)]
    spare = np.array([fit.freedom for fit in fits])
    models = [fit.entries for fit in fits]
    unique: Unique = "proved" if cells.told else "searched"

    def drawn(placed: list[NDArray]) -> PlanarMesh:
        return joined(topology, fits, placed, task.placement)

    solved = Solved(stored, matrix, topology, fits, models, spare, task, task.noise)
    return finished(solved, drawn, lambda _: ([], unique), (), clock)


def _with_zeros(stored: OperatorMatrix, parts: Sequence[Part]) -> tuple[OperatorMatrix, Topology]:
    """The matrix with zeros for pairs of its cells that have no entry, and the parts as pieces with all their pairs."""
    n, given = stored.n, stored.edges @ [stored.n, 1]
    pairs = [pair_keys(n, *part.rows.T) for part in parts]
    keys = distinct(np.concatenate([given, *pairs]))
    edges, entries, old = np.column_stack([keys // n, keys % n]), np.zeros(len(keys)), np.searchsorted(keys, given)
    entries[old] = stored.entries
    pieces = tuple(
        replace(part.piece, edge_rows=np.searchsorted(keys, own)) for part, own in zip(parts, pairs, strict=True)
    )
    vanished = np.delete(np.arange(len(keys)), old)
    return replace(stored, edges=edges, entries=entries), Topology(n, edges, pieces, "cliques", vanished=vanished)


def joined(
    topology: Topology, fits: Sequence[Fitted], placed: Sequence[NDArray[np.complex128]], placement: Placement
) -> ConformingMesh:
    """Parts, pieces of the topology, put together at positions `placed`, those that are mirrored turned over."""
    points = np.full((topology.n_vertices, 2), np.nan)
    blocks: dict[str, NDArray[np.int64]] = {}
    for fit, z in list(zip(fits, placed, strict=True))[::-1]:  # the first part at a hinge comes last
        vertices, (a, b, c) = fit.part.piece.vertices, z[fit.part.piece.triangles].T
        points[vertices] = np.column_stack([z.real, z.imag])
        mirrored = (np.conj(b - a) * (c - a)).imag.sum() < 0
        for kind, cells in fit.part.blocks.items():
            own = vertices[cells[:, reversal(kind)] if mirrored else cells]
            blocks[kind.name] = np.concatenate([own, blocks.get(kind.name, own[:0])])
    return ConformingMesh(
        **fields_of(blocks),
        points=points,
        hinges=topology.hinges,
        operator=placement.operator,
        component=topology.component,
        scale=np.array([fit.scale for fit in fits]) / placement.stretch,
        n_holes=sum(fit.part.n_holes for fit in fits),
        quadrature=", ".join(dict.fromkeys(rule for fit in fits for rule in fit.rule.values())),
        straight=all(fit.straight for fit in fits),
    )
