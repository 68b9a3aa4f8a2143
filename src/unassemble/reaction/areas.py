"""A mass matrix alone: linear equations for the areas of triangles."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..errors import SolverError
from ..linalg.normal import NormalEquations
from .metric import Skeleton


def areas_of_mass(skeleton: Skeleton, entries: NDArray, diagonal: NDArray) -> NDArray[np.float64] | None:
    """(m,) s times the area of each triangle, by least squares; None where they are not determined.

    s M has s a / 12 from every triangle on each of its edges, and s a / 6 at each of its corners.

    Parameters
    ----------
    skeleton : Skeleton
    entries : (e,) float64
        A_ij.
    diagonal : (n,) float64
    """
    matrix = sp.csr_array(sp.vstack([skeleton.at_edges / 12, skeleton.at_vertices / 6]))
    given = np.concatenate([entries, diagonal])
    size = 1 / np.maximum(np.abs(given), np.finfo(float).tiny)  # graded meshes: all to the same number of digits
    weighted = sp.csr_array(sp.diags_array(size) @ matrix)
    try:
        equations = NormalEquations(weighted)
    except SolverError:
        return None
    areas = equations.solve(size * given)
    areas = areas + equations.solve(size * given - weighted @ areas)
    equations.release()
    return np.asarray(areas)
