"""What an inspection counts."""

from contextlib import suppress
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..conforming.affine import typical_misfit
from ..conforming.parts import parts_of
from ..conforming.recover import shown_cells
from ..errors import RecoveryError, TopologyError
from ..masses import less_mass
from ..matrix import OperatorMatrix
from ..metric.mesh import SurfaceMesh
from ..nodes.nodal import nodal_matrix, uncoupled
from ..operators import VectorReading
from ..recovery import ELEMENT_NAMES
from ..structures import StructuralNumbering
from ..structures.trusses import bars_of
from ..tolerances import ROUNDED, SUMMED
from ..topology import Piece, Topology
from ..topology.manifold import Cycles, surface_readings
from ..topology.numbering import connected
from ..words import kind_text

_LIKE = 0.3  # misfit of cells that are nearly affine; of other matrices with rows that form cells it is nearer to 1


def matrix_facts(matrix: OperatorMatrix) -> dict[str, Any]:
    """Of any matrix."""
    degree = np.bincount(matrix.edges.ravel(), minlength=matrix.n)
    size = matrix.row_size
    n_isolated = int(np.count_nonzero(degree == 0))
    smaller = np.minimum(size[matrix.edges[:, 0]], size[matrix.edges[:, 1]])
    return {
        "n_rows": matrix.n,
        "n_edges": len(matrix.edges),
        "asymmetry": float(matrix.asymmetry),
        "n_connected": connected(matrix.n, *matrix.edges.T)[0] - n_isolated,
        "n_isolated": n_isolated,
        "n_vanished": int(np.count_nonzero(np.abs(matrix.entries) <= ROUNDED * smaller)),
        "n_zero_sums": int(np.count_nonzero((np.abs(matrix.row_sums) <= SUMMED * size) & (degree > 0))),
        "warnings": matrix.warnings,
    }


def nodes_facts(matrix: OperatorMatrix, vector: VectorReading) -> dict[str, Any]:
    """Of a vector-valued matrix."""
    found = vector.numbering
    shown = {"name": vector.name, "evidence": (vector.why,), "block_size": found.block_size, "n_nodes": found.n_nodes}
    if isinstance(found, StructuralNumbering):
        return shown | {"numbering": found.kind, "structure": found.layout.name}
    nodal = nodal_matrix(matrix.csr(), found)
    structure = "" if uncoupled(nodal) or bars_of(nodal) is None else "truss"
    return shown | {"numbering": vector.order, "coupled": not uncoupled(nodal), "structure": structure}


def element_facts(matrix: OperatorMatrix) -> dict[str, Any]:
    """Of a scalar matrix whose rows form cells of other elements than linear triangles; empty where they form none."""
    read = [(matrix, cells) for cells in islice(shown_cells(matrix), 1)]
    without = less_mass(matrix)
    for whole, cells in read + ([without[:2]] if without else []):  # without a mass term, and with one
        with suppress(TopologyError):
            if typical_misfit(whole, cells.blocks) > _LIKE:
                continue
            parts = parts_of(cells)
            names = [ELEMENT_NAMES[kind.name] for kind in cells.blocks]
            return {
                "element": names[0] if len(names) == 1 else "mixed",
                "n_triangles": sum(len(some) for kind, some in cells.blocks.items() if kind.simplex),
                "n_quads": sum(len(some) for kind, some in cells.blocks.items() if not kind.simplex),
                "n_holes": sum(part.n_holes for part in parts),
                "n_boundary_edges": sum(len(part.piece.boundary) for part in parts),
                "n_pieces": len(parts),
                "cells_from": "graph" if cells.told else "entries",
            }
    return {}


def mesh_facts(matrix: OperatorMatrix, topology: Topology) -> dict[str, Any]:
    """Of the cells that recovery begins with."""
    pieces = topology.pieces
    polygons = topology.polygons
    n_triangles = sum(len(piece.triangles) for piece in pieces) - int((polygons.size - 2).sum())
    signs = [_of_other_sign(piece, -matrix.entries[piece.edge_rows]) for piece in pieces]
    return {
        "n_triangles": n_triangles,
        "n_holes": topology.n_holes,
        "n_boundary_edges": sum(len(piece.boundary) for piece in pieces),
        "n_pieces": len(pieces),
        "n_hinges": len(topology.hinges),
        "n_bare_edges": len(topology.bare_edges),
        "n_undetermined": len(topology.undetermined),
        "n_polygons": polygons.count,
        "n_vanished_sides": len(topology.vanished) - int((polygons.size - 3).sum()),
        "cells_from": "entries" if len(topology.vanished) else "graph",
        "mixed_signs": tuple(row for rows in signs for row in rows),
    }


def _of_other_sign(piece: Piece, weights: NDArray) -> list[int]:
    """The first row in which c has another sign than in most: c L_ii is the sum of a row's weights, and L_ii > 0."""
    sums = np.bincount(piece.edges.ravel(), np.repeat(weights, 2), piece.n_vertices)
    positive = np.count_nonzero(sums > 0) * 2 >= len(sums)
    return piece.vertices[sums <= 0 if positive else sums >= 0][:1].tolist()


def surface_facts(matrix: OperatorMatrix) -> dict[str, Any]:
    """Of a graph that is that of a surface with handles or cross-caps, or without a boundary; else empty."""
    cycles = Cycles.of(matrix.n, matrix.edges)
    try:
        mesh = SurfaceMesh.of(cycles, next(surface_readings(cycles)))
    except RecoveryError:
        return {}
    kinds = [kind_text(*kind) for kind in zip(mesh.euler, mesh.orientable, mesh.loops, strict=True)]
    return {
        "surface": "; ".join(kinds[:3]) + ("; ..." if len(kinds) > 3 else ""),
        "n_triangles": len(mesh.triangles),
        "n_boundary_edges": len(mesh.boundary),
        "n_pieces": mesh.n_pieces,
        "n_hinges": len(mesh.hinges),
        "cells_from": "graph",
    }
