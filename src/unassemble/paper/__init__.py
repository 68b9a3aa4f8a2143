"""The 2002 paper, whole: angle equations, Newton, inner-outer iteration, starting guesses, embeddings, boundary.

Stathopoulos, Teng, "Recovering mesh geometry from a stiffness matrix", Numerical Algorithms 30, 2002.
Every file is one idea, and names the section and the equations that it follows.
"""

from .alignment import aligned, distance
from .bfs import bfs_embedding, dual_order
from .bicg import bicg
from .boundary import FixedPointOptions, boundary_fixed_point, ring
from .cgls import cgls
from .corners import Corners, corners_of
from .equations import AngleSystem, Unknowns
from .forcing import eisenstat_walker, forcing
from .harmonic import HarmonicReduction, tube_triangles
from .layout import corner_equations, least_squares_layout
from .lsqr import lsqr
from .newton import NewtonOptions, NewtonResult, solve
from .nullspace import deficiency, null_vector, spiral_matrix
from .parts import part
from .recover import AngleOptions, AngleRecovery, recover_angles
from .smoothing import coordinate_smoothing, law_of_sines
from .square import Picked, square_rows
from .starts import angles_of, barycentric_embedding, start_angles
from .substitution import cotangents_of, substitution
from .validity import inverted, signed_angles, violations

__all__ = [
    "AngleOptions",
    "AngleRecovery",
    "AngleSystem",
    "Corners",
    "FixedPointOptions",
    "HarmonicReduction",
    "NewtonOptions",
    "NewtonResult",
    "Picked",
    "Unknowns",
    "aligned",
    "angles_of",
    "barycentric_embedding",
    "bfs_embedding",
    "bicg",
    "boundary_fixed_point",
    "cgls",
    "coordinate_smoothing",
    "corner_equations",
    "corners_of",
    "cotangents_of",
    "deficiency",
    "distance",
    "dual_order",
    "eisenstat_walker",
    "forcing",
    "inverted",
    "law_of_sines",
    "least_squares_layout",
    "lsqr",
    "null_vector",
    "part",
    "recover_angles",
    "ring",
    "signed_angles",
    "solve",
    "spiral_matrix",
    "square_rows",
    "start_angles",
    "substitution",
    "tube_triangles",
    "violations",
]
