"""Which terms a scalar matrix has besides a Laplacian and any diagonal: told by its row sums, tried in order.

Rows of c L add up to zero. Where they do not, D is whatever it is if the other entries are those of a Laplacian. If
they are not, sums of one sign are those of a mass term, and sums of both those of S c L S, as Jacobi scaling and
equilibration leave it, with an unknown positive diagonal matrix S: L annihilates constants, so that this annihilates
1 / S. Where nothing else stands on the diagonal a positive null vector gives S, up to a factor that only c could tell
it from. With an unknown D there is no such vector, and fewer entries off the diagonal than coordinates and factors.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate import Certificate, Findings, Terms, Unique, certify_masses
from ..clock import Clock
from ..conforming.recover import shown_cells
from ..conforming.roles import OrderedCells
from ..errors import GeometryError, RecoveryError
from ..linalg import UpperTriangle, nearly_singular
from ..linalg.definite import STEPS
from ..matrix import OperatorMatrix
from ..planar.piece import left_by_map
from ..recovery import Examined, Placed, PlanarMesh, finish
from ..tolerances import ALIKE, CERTIFIED, SUMMED
from ..topology import Topology
from ..topology.surface import Together
from ..words import Reason
from .cells import TRIANGLE, evenly, guessed_from_sums, less, mass_matrix, told_without_stiffness, weights_at
from .held import Plain, RowSums
from .lengths import fit_areas
from .settled import less_mass, settled


def recover_with_terms(
    matrix: OperatorMatrix, plain: Plain, clock: Clock, tensor: tuple[float, float, float] | None = None
) -> PlanarMesh:
    """The mesh of a scalar matrix of linear triangles.

    `plain`: recovers a matrix c L + D; knows relative sizes of its pieces if told the squared lengths of edges;
    `tensor`: (kxx, kxy, kyy) to be undone.
    """
    held, found = RowSums(matrix, tensor, clock), None
    if not held.has_sums.any():
        return plain(matrix)
    with clock("topology"):
        topology = matrix.surfaces
    # Else sides of cells have vanished, or this is no mesh: scaled or not shows by itself.
    triangles = topology.pieces and not len(topology.bare_edges) and topology.multiplicity.all()
    if triangles:
        if held.sign and (alone := _mass_alone(held, topology)) is not None:
            return alone
        with clock("conformal"):
            laplacian = _is_laplacian(matrix, topology)
        if laplacian:
            return with_lumped_mass(held, plain(matrix)) if held.sign else plain(matrix)
    with suppress(RecoveryError):
        if not held.sign:
            found = _unscaled(held, plain, clock)
        elif triangles:
            found = with_consistent_mass(held, topology, plain, clock)
    if found is None:
        return plain(matrix)
    if found.status != "uncertified":
        return found
    # A term that does not fit explains nothing, and the entries may be those of c L + D as they stand.
    with suppress(RecoveryError):
        without = plain(matrix)
        return without if without.status != "uncertified" else found
    return found


def recover_elements_with_terms(
    matrix: OperatorMatrix, of_cells: Callable[[OperatorMatrix, Iterable[OrderedCells]], PlanarMesh], clock: Clock
) -> PlanarMesh | None:
    """The mesh of c L + s M or S c L S, of other elements; None where row sums show neither, or nothing comes near.

    `of_cells`: recovers a matrix c L + D on cells that its rows may form.
    """
    held = RowSums(matrix, clock=clock)
    if not held.has_sums.any():
        return None
    try:
        told = less_mass(matrix)
        cells = told[1] if told else next(shown_cells(matrix), None)
        if cells is None:
            return None
        if not (told or held.sign):
            scaled = _unscaled(held, lambda left: of_cells(left, shown_cells(left)), clock)
            if scaled is not None:
                return scaled
        # Serendipity functions have integrals of both signs.
        weights = told[2] if told else guessed_from_sums(matrix.row_sums, cells.blocks)
        if np.ptp(np.sign(np.concatenate([some.sum(axis=1) for some in weights.values()]))):
            return None

        def plain(left: OperatorMatrix) -> PlanarMesh:
            return of_cells(left, [cells])

        return settled(held, weights, cells.blocks, plain, 0 if told else 9, told=bool(told))
    except RecoveryError:
        return None


def _is_laplacian(matrix: OperatorMatrix, topology: Topology) -> bool:
    """Whether conformal maps fit the most entries off the diagonal, whatever stands on it."""
    for piece in topology.pieces:
        weights = -matrix.entries[piece.edge_rows]
        found = left_by_map(piece, weights)
        if not found or not np.median(np.abs(found[1] * found[0])) <= ALIKE * np.median(np.abs(weights)):
            return False
    return True


def _unscaled(held: RowSums, plain: Plain, clock: Clock) -> PlanarMesh | None:
    """The mesh of S c L S; None where no positive vector is annihilated, or a small D explains the row sums as well."""
    matrix = held.matrix
    with clock("scaling"):
        null = _positive_null_vector(matrix)
    if null is None:
        return None
    null = null / np.exp(np.log(null).mean())
    if np.abs(null - 1).max() <= ALIKE:  # as of any D next to nothing, with which the entries are those of c L
        with suppress(RecoveryError):
            found = plain(matrix)
            if found.status != "uncertified":
                return found
    i, j = matrix.edges.T
    found = plain(replace(matrix, entries=matrix.entries * null[i] * null[j], diagonal=matrix.diagonal * null**2))
    note = "S and c are known up to a factor that one could give the other: the geometric mean of S is 1"
    return held.with_terms(found, Terms(matrix.diagonal, scaling=1 / null), "S c L S", note)


def _positive_null_vector(matrix: OperatorMatrix) -> NDArray[np.float64] | None:
    """(n,) a vector of positive numbers that the matrix annihilates up to rounding, if there is one."""
    sign = np.sign(matrix.diagonal)
    if not (sign[0] and (sign == sign[0]).all()):
        return None
    unit = 1 / np.sqrt(np.abs(matrix.diagonal))
    scaled = sp.csr_array(sp.diags_array(unit) @ (sign[0] * matrix.csr()) @ sp.diags_array(unit))
    x = np.ones(matrix.n)
    try:
        with nearly_singular(UpperTriangle.of(scaled)) as solver:
            for _ in range(STEPS + 1):
                x = (y := solver.solve(x)) / np.abs(y).max()
    except GeometryError:  # it has eigenvalues of both signs
        return None
    return unit * x if (x > 0).all() and (np.abs(scaled @ x) <= SUMMED * (abs(scaled) @ np.abs(x))).all() else None


def _mass_alone(held: RowSums, topology: Topology) -> PlanarMesh | None:
    """Areas of the triangles of a mass matrix; None where areas do not explain it.

    There are e + n equations for m areas, and triangles that are none, holes of three edges, come out with area zero.
    """
    matrix, sign = held.matrix, held.sign
    if not (sign * matrix.entries > 0).all():
        return None
    triangles, opposite = _in_one(topology)
    areas = told_without_stiffness(matrix, triangles, opposite)
    if areas is None:
        return None
    hole = np.abs(areas) <= CERTIFIED * np.abs(matrix.row_sums[triangles].sum(axis=1))
    areas, triangles = areas[~hole], triangles[~hole]
    left = less(matrix, {TRIANGLE: triangles}, {TRIANGLE: evenly(TRIANGLE, areas)})
    error = float(max(np.abs(left.entries / matrix.entries).max(), np.abs(left.diagonal / matrix.diagonal).max()))
    if not (error <= CERTIFIED and (sign * areas > 0).all()):
        return None
    mesh = PlanarMesh(
        points=np.full((matrix.n, 2), np.nan),
        triangles=triangles,
        component=topology.component,
        hinges=topology.hinges,
        scale=np.zeros(len(topology.pieces)),
        node_status=np.ones(matrix.n, dtype=np.int8),
        operator="mass",
        n_holes=topology.n_holes + int(hole.sum()),
        reaction=1.0,
        areas=areas,
    )
    said = ["the areas are those times s, if the factor of the mass matrix is s"]
    equal = float(np.ptp(areas)) <= ALIKE * float(np.abs(areas).max())
    if equal:
        said.append(
            "all areas are equal, and on triangles that are all alike c L + s M, with a negative c and the lumped mass "
            "matrix M, may have the same entries"
        )

    def examine(_: PlanarMesh, compared: Certificate) -> Examined:
        fits = f"the mass matrix of triangles with these areas is the given one to {compared.backward_error:.1e}"
        shapeless = (
            "a mass matrix has no shape: it depends on the areas of the triangles alone, and any that have them will do"
        )
        return Examined(Findings((f"{fits} (relative)", shapeless), compared.backward_error, unique=unique))

    unique: Unique = "searched" if equal else "proved"
    return finish(
        held.clock,
        lambda: Placed(mesh, (*matrix.warnings, *said)),
        lambda _: certify_masses(matrix.edges, matrix.entries, matrix.diagonal, triangles, areas),
        examine,
    )


def _in_one(topology: Topology) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(m, 3) triangles of all pieces, and the edges that face their corners."""
    union = Together(topology.pieces)
    return union.vertices[union.triangles], union.edge_rows[union.opposite]


def with_consistent_mass(held: RowSums, topology: Topology, plain: Plain, clock: Clock) -> PlanarMesh | None:
    """The mesh of c L + s M; None where no areas come near the entries."""
    matrix, (triangles, opposite) = held.matrix, _in_one(topology)
    # Row sums of at least their rounding; those that have lost digits that a certificate could notice weigh less.
    sums = np.maximum(np.abs(matrix.row_sums), held.rounding)
    if not sums.all():  # rows of zeros
        return None
    trust = np.minimum(1.0, CERTIFIED * sums / held.rounding)
    with clock("metric"):
        fit = fit_areas(matrix.edges, triangles, opposite, held.sign * matrix.entries, sums, trust)
    if fit is None or fit[2] >= ALIKE:
        return None
    areas, squared_lengths, _ = fit
    weights = {TRIANGLE: evenly(TRIANGLE, held.sign * areas)}
    return settled(held, weights, {TRIANGLE: triangles}, lambda left: plain(left, squared_lengths), 0, told=False)


def with_lumped_mass(held: RowSums, found: PlanarMesh) -> PlanarMesh:
    """A mesh of c L + D; if D is proportional to the areas about its vertices that is a lumped mass matrix."""
    if not found.certified:
        return found
    blocks, sums = {TRIANGLE: found.divided()[0]}, held.matrix.row_sums
    share = mass_matrix(held.matrix.n, blocks, weights_at(found.points, blocks)).sum(axis=1)
    reaction = float(sums.sum() / share.sum())
    if not (np.abs(sums - reaction * share) <= ALIKE * np.abs(reaction * share) + held.rounding).all():
        return found
    terms = Terms(held.matrix.diagonal, reaction, lumped=True)
    again = held.with_terms(found, terms, "c L + s M, M the lumped mass matrix,")
    if not again.certified:
        return found
    return replace(again, verdict=again.verdict.beside(_LIKE_MASS)) if _all_alike(again) else again


def _all_alike(mesh: PlanarMesh) -> bool:
    """Whether all triangles are translated or turned by half a turn, and none of their sides has vanished.

    With areas a of all triangles, consistent masses add s a / 12 for each triangle at an edge where lumped ones add
    nothing: that is a change of the cotangents of three angles, which are those of other triangles, all alike as well.
    """
    triangles = mesh.triangles
    if mesh.n_polygons or not len(triangles):
        return False
    z = mesh.points[triangles] @ [1, 1j]
    sides = (np.roll(z, -1, axis=1) - z) ** 2  # by their squares, which do not know a direction
    ratio = np.roll(sides, 1, axis=1) / sides
    right = (np.abs(ratio.imag) <= ALIKE * np.abs(ratio)) & (ratio.real < 0)  # their entries vanish
    size = np.abs(sides).max()
    powers = [(sides / size) ** k for k in (1, 2, 3)]
    same = all((np.abs(p.sum(axis=1) - p.sum(axis=1)[0]) <= ALIKE).all() for p in powers)
    return bool(same and not right.any())


_LIKE_MASS = Reason(
    "all triangles are alike, and with a consistent mass matrix in place of the lumped one triangles of another shape "
    "have the same entries"
)
