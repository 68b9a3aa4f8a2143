"""How the boundary and the time of BFS-Embedding grow with a mesh (paper, sections 2.4 and 5)."""

from __future__ import annotations

import time

import numpy as np

from unassemble.paper import bfs_embedding

from . import meshes
from .cases import Case, case_of
from .examples import perforated, two_hexagonal_holes
from .tables import Table, table


def growth_table(refinements: int = 3, repeats: int = 3) -> Table:
    """Refinements of the paper's unstructured meshes, and shaken lattices; the least time of several runs."""
    rows = []
    for name, mesh in (("Figure 5", meshes.ellipse()), ("Figure 6", meshes.rocket())):
        for k in range(refinements + 1):
            rows.append(_row(f"{name}, sides in {2**k}" if k else name, mesh, repeats))
            mesh = meshes.refined(mesh)
    rows += [_row(f"{k} x {k} lattice", perforated(k, 0), repeats) for k in (20, 40, 80, 160)]
    columns = ("mesh", "vertices", "boundary vertices", "boundary over the root of vertices", "elements",
               "BFS-Embedding", "for each element")  # fmt: skip
    return table("growth", columns, rows)


def _row(name: str, mesh: meshes.Mesh, repeats: int) -> list[str | int | float | None]:
    example = case_of(mesh, name)
    seconds = min(_timed(example) for _ in range(repeats))
    n, boundary = example.piece.n_vertices, len(np.unique(example.piece.boundary))
    m = len(example.piece.triangles)
    return [name, n, boundary, boundary / np.sqrt(n), m, f"{1e3 * seconds:.1f} ms", f"{1e6 * seconds / m:.1f} µs"]


def _timed(example: Case) -> float:
    begin = time.process_time()
    bfs_embedding(example.piece, example.angles)
    return time.process_time() - begin


def counts_table(cases: tuple[Case, ...]) -> Table:
    """The numbers of section 2.3, and what section 2.2 asks: a tri-connected graph, loops of four edges, no zeros."""
    import networkx

    rows = []
    for example in (*cases, case_of(two_hexagonal_holes(), "two holes of six edges")):
        counts, piece = example.corners.counts, example.piece
        graph = networkx.Graph(piece.edges.tolist())
        zeros = int((np.abs(example.weights) < 1e-12 * np.abs(example.weights).max()).sum())
        rows.append([
            f"Figure {example.figure}" if example.figure else example.name,
            *(counts.v, counts.e, counts.m, counts.w, counts.h), counts.equations, counts.unknowns, counts.surplus,
            networkx.node_connectivity(graph), ", ".join(map(str, sorted(np.diff(piece.loop_offsets).tolist()))), zeros,
        ])  # fmt: skip
    columns = ("mesh", "v", "e", "m", "w", "h", "equations", "angles", "surplus", "connectivity", "loops of edges",
               "zero entries")  # fmt: skip
    return table("counts", columns, rows)
