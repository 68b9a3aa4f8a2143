"""Whether a matrix is a mass matrix, of whatever elements and unknowns: its eigenvalues and its couplings say so.

Scaled to identity blocks at its nodes, a consistent mass matrix has eigenvalues between bounds that depend on the
element alone, not on the mesh or on densities (Wathen 1987); those of a stiffness matrix come near to zero. And a rigid
translation feels all masses at once, so that the couplings of most unknowns add up in one vector, where those of
stiffnesses are against each other. Those of straight simplices, cubic ones too, show in the sums of their rows.

A. J. Wathen, Realistic eigenvalue bounds for the Galerkin mass matrix, IMA J. Numer. Anal. 7 (1987), 449-457.
"""

from fractions import Fraction

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from ..elements import exact_rule, shape_functions
from ..elements.kinds import KINDS, Kind
from ..errors import GeometryError
from ..masses import less_mass
from ..matrix import OperatorMatrix
from ..nodes.grouping import same_pattern
from ..nodes.unknowns import nodes_of_pattern
from ..structures.layouts import SPACE
from ..tolerances import ALIKE, HARDLY_ANY, LAST_DIGITS, LITTLE, NEARLY_ALL, ROUNDED, SUMMED
from ..topology import components
from ..words import count_of
from .cliques import CELLS, cells_of, often
from .kinds import LENGTHS, UNREAD, Diagnosis

_SIMPLICES = {
    "linear elements on segments": Kind("line", "line", 1, 2),
    "linear elements on triangles": KINDS["triangle"],
    "quadratic elements on triangles": KINDS["triangle6"],
    "cubic elements on triangles": KINDS["triangle10"],
    "linear elements on tetrahedra": KINDS["tetra"],
    "quadratic elements on tetrahedra": KINDS["tetra10"],
}

_OR_HELD = ", or the stiffness matrix of a body of a few nodes that is held all around, which recovery tells"


def refuse_masses(matrix: OperatorMatrix, *, planar: bool, exact: bool = False) -> None:
    """Raise a GeometryError that names a mass matrix which recovery does not read; as :func:`mass_matrix`."""
    mass = mass_matrix(matrix, planar=planar, exact=exact)
    if mass is not None and mass.unread:
        raise GeometryError(mass.sentence())


def mass_matrix(matrix: OperatorMatrix, *, planar: bool, exact: bool = False) -> Diagnosis | None:
    """What kind of mass matrix this is; None where it is none.

    `planar`: whether it may still be that of a mesh in the plane, which are read with much mass beside little
    stiffness; `exact`: whether only equations count: small bodies that are held all around have such eigenvalues as
    well.
    """
    # Most matrices of meshes in the plane are seen to be none by their signs alone, which takes no time.
    sign, nothing = np.sign(matrix.diagonal[np.abs(matrix.diagonal).argmax()]), ROUNDED * np.abs(matrix.entries).max()
    if planar and len(matrix.edges) <= 3 * matrix.n and (sign * matrix.entries < -nothing).any():
        return None
    root = np.sqrt(np.abs(matrix.diagonal))[matrix.edges].prod(axis=1)
    if not exact and (np.abs(matrix.entries) <= LAST_DIGITS * root).all():  # functions are orthogonal: Crouzeix-Raviart
        return Diagnosis("mass", "a lumped mass matrix", ("all but its diagonal is rounding",), UNREAD["mass"])
    # Diagonal entries of one sign, made positive, without the rows of zeros: unknowns without a mass, or points inside
    # of a mesh whose boundary has one. Rows of stiffnesses may add up to zero.
    nothing = ROUNDED * np.abs(matrix.diagonal).max()
    used = np.abs(matrix.diagonal) > nothing
    if not used.any() or np.ptp(np.sign(matrix.diagonal[used])):
        return None
    whole = sign * matrix.csr()
    whole.data[np.abs(whole.data) <= nothing] = 0
    whole.eliminate_zeros()
    M = whole[used][:, used]
    if not M.shape[0] < M.nnz == whole.nnz or M.shape[0] <= 2:
        return None
    without = () if used.all() else (f"{count_of(int((~used).sum()), 'row is', 'rows are')} zero",)
    if simplices := _simplices(M):
        name, kind, ratios = simplices
        advice = LENGTHS if kind.dim == 1 else "" if planar and kind == KINDS["triangle"] else UNREAD["mass"]
        parts = " or ".join(str(Fraction(ratio).limit_denominator(1000)) for ratio in ratios)
        sums = f"every row adds up to {parts} times its diagonal entry"
        return Diagnosis("mass", f"a mass matrix of {name}", (sums, *without), advice)
    crowded = M.nnz > 7 * M.shape[0] - 12  # twice 3 n - 6, and the diagonal
    bounds = _bounds(M) if not exact and (crowded or not planar) else None
    # Rows may form straight triangles of second or third order, where more than their mass is there.
    less = None if bounds is None else less_mass(matrix)
    more = less is not None and bool(np.abs(less[0].entries).max() > ALIKE * np.abs(matrix.entries).max())
    if bounds is None or more:
        return None
    shown = (
        f"scaled to identity blocks its least eigenvalue is {bounds[0]:.2g}, where those of stiffnesses near zero",
        f"its couplings add up in one vector, to a largest eigenvalue of {bounds[1]:.2g}, as under a translation",
    )
    return Diagnosis("mass", f"a consistent mass matrix{_unknowns(M)}", (*shown, *without), UNREAD["mass"])


def _simplices(M: sp.csr_array) -> tuple[str, Kind, list[float]] | None:
    """The straight elements whose mass matrix this is, and what rows add up to, over their diagonal entries.

    The area of a cell is a factor of its whole mass matrix: what a row of some kind of node, a corner say, adds up
    to over its diagonal entry is the same on all cells, and so on all meshes.
    """
    diagonal = M.diagonal()
    share = M.sum(axis=1) / diagonal
    for name, kind in _SIMPLICES.items():
        at, weights = exact_rule(kind, more=1)
        value = shape_functions(kind, at)
        ratios = np.unique((weights @ value / (weights @ value**2)).round(10)).tolist()
        apart = np.abs(share[:, None] - ratios) <= SUMMED * abs(M).sum(axis=1)[:, None] / diagonal[:, None]
        if apart.any(axis=1).all() and apart.any(axis=0).all():
            return name, kind, ratios
    return None


def _bounds(M: sp.csr_array) -> tuple[float, float] | None:
    """Least and largest eigenvalue, scaled to identity blocks; None for other matrices than those of masses."""
    root = sp.diags_array(1 / np.sqrt(M.diagonal()))
    scaled = (root @ M @ root).tocsr()
    couplings = scaled - sp.eye_array(scaled.shape[0])
    if not couplings.maximum(0).sum() > LITTLE * abs(couplings).sum():
        return None  # on a graph with two colours, a grid's, the signs of one colour may be turned
    together, all_of_them = _extreme(couplings, "LA"), _extreme(abs(couplings), "LA")
    if together is None or all_of_them is None:
        return None
    # The share of masses is 0.94 and more; that of as much stiffness beside them 0.8. Biquadratic and triquadratic
    # elements have couplings of both signs, and equal weights come to 0.97 of the largest eigenvalue instead.
    if together < NEARLY_ALL * all_of_them and M.sum() / M.diagonal().sum() < NEARLY_ALL * (1 + together):
        return None
    # Masses of beams have 0.08, of hexahedra 1/8, of quadrilaterals 1/4, of triangles and tetrahedra 1/2.
    least = _extreme(scaled, "SA", _blocks(scaled))
    return None if least is None or least < HARDLY_ANY else (least, 1 + together)


def _unknowns(M: sp.csr_array) -> str:
    """Of which elements, or of how many unknowns per node, as far as the graph shows that."""
    upper = sp.triu(M, 1).tocoo()
    edges = np.column_stack([upper.row, upper.col]).astype(np.int64)
    cells = cells_of(M.shape[0], edges)
    n_parts = len(components(M.shape[0], edges))
    if (cells.nodes, cells.shared) in CELLS and n_parts == 1:
        return f" of {CELLS[cells.nodes, cells.shared][1]}, with little stiffness at most"
    if not (n_parts > 1 or often(cells.twins) or nodes_of_pattern(M) is not None):
        return ", or another matrix of inner products, since no cells show in its graph"
    # Stiffnesses of a body that is held all around keep as far from zero while it has a few dozen nodes.
    return " of several unknowns per node" + (_OR_HELD if M.shape[0] < 150 else "")


def _blocks(scaled: sp.csr_array) -> sp.csc_array:
    """The diagonal blocks of unknowns of one node, which are coupled to the same rows."""
    group = same_pattern(scaled)
    one = scaled.tocoo()
    few = np.bincount(group)[group] <= SPACE.block_size
    here = ((group[one.row] == group[one.col]) & few[one.row]) | (one.row == one.col)
    return sp.csc_array((one.data[here], (one.row[here], one.col[here])), shape=scaled.shape)


def _extreme(A: sp.csr_array, which: str, blocks: sp.csc_array | None = None) -> float | None:
    """The largest (``"LA"``) or least (``"SA"``) eigenvalue, relative to blocks; None where it does not show soon."""
    more: dict[str, object] = {}
    start: NDArray[np.float64] = np.random.default_rng(0).standard_normal(A.shape[0])
    try:
        if blocks is not None:
            more = {"M": blocks, "Minv": LinearOperator(A.shape, splu(blocks).solve)}
        found = eigsh(A, k=1, which=which, v0=start, tol=LITTLE**2, maxiter=20, return_eigenvectors=False, **more)
    except (ArpackError, RuntimeError):  # no convergence, so no gap to zero; or singular blocks
        return None
    return float(found[0])
