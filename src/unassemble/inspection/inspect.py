"""What a matrix is, and what can be recovered from it, without recovering it."""

from dataclasses import asdict
from typing import Any

from ..cells import guessed
from ..diagnosis import Diagnosis, diagnosed, further_terms, indefinite, mass_matrix
from ..errors import NotPlanarError, RecoveryError
from ..matrix import OperatorMatrix, load
from ..operators import VectorReading, second_reading, vector_valued
from ..progress import quiet_libraries
from ..tolerances import MOST
from ..topology import Topology, components, located, require_planar
from .facts import element_facts, matrix_facts, mesh_facts, nodes_facts, surface_facts
from .inspection import Inspection

_NO_CELLS = "the graph of the matrix is planar, but no cell shows in it, nor do the entries suggest any"


def inspect_matrix(A: Any, *, variable: str | None = None, drop_zeros: float | None = None) -> Inspection:
    """Describe a matrix; quick, since nothing is solved: cells are those that recovery begins with.

    `A`: an OperatorMatrix, a sparse matrix or array, an ndarray, a path, or ``"-"``; `variable`: the name of the
    variable in a ``.mat`` file; `drop_zeros`: forget stored entries of at most this, as in :func:`unassemble.recover`.
    Raises InputError if a file cannot be read as a matrix; MatrixError if the matrix lacks what every operator has.

    Examples
    --------
    >>> inspection = inspect_matrix([[1.0, -0.5, -0.5], [-0.5, 1.0, -0.5], [-0.5, -0.5, 1.0]])
    >>> inspection.n_triangles, inspection.n_holes, inspection.operator
    (1, 0, 'laplacian, linear triangles')
    """
    with quiet_libraries():
        matrix = A if isinstance(A, OperatorMatrix) else load(A, variable=variable, drop_zeros=drop_zeros)
        found = _inspected(matrix)
        if found.recoverable.startswith("nothing") and (apart := matrix.without_joining_zeros()):  # as recovery does
            found = _inspected(apart)
        return found


def _inspected(matrix: OperatorMatrix) -> Inspection:
    def of(shown: dict[str, Any], found: Diagnosis | None = None, *, planar: bool = False) -> Inspection:
        """With what a diagnosis says, of a scalar matrix that is read."""
        read_as = asdict(found or diagnosed(matrix, planar=planar))
        further = further_terms(matrix) if found is None else ""
        return Inspection(**matrix_facts(matrix), **read_as, further=further, planar=planar, **shown)

    def of_nodes(vector: VectorReading) -> Inspection:
        read_as = nodes_facts(matrix, vector)
        read_as["evidence"] += (said,) if (said := indefinite(matrix)) else ()  # where recovery fails it says so
        return Inspection(**matrix_facts(matrix), **read_as, planar=False, obstacle=vector.why)

    mass = mass_matrix(matrix, planar=True)
    if mass is not None and mass.unread:
        return of({"obstacle": mass.name}, mass)
    if len(matrix.edges) > 3 * matrix.n and (shown := element_facts(matrix)):
        return of(shown)
    if (vector := vector_valued(matrix)) is not None:
        return of_nodes(vector)
    read, topology = matrix, matrix.surfaces
    if not topology.pieces and (curved := surface_facts(matrix)):
        return of(curved)
    if _left_over(matrix, topology):
        read, topology = guessed(matrix, topology)
    if not topology.pieces or _left_over(read, topology):
        error = _not_planar(matrix)
        if error or not topology.pieces:
            if shown := element_facts(matrix):
                return of(shown, planar=error is None)
            if (vector := second_reading(matrix)) is not None:  # as recovery does
                return of_nodes(vector)
            return of({"obstacle": str(error or _NO_CELLS)}, planar=error is None)
    found = mesh_facts(read, topology)
    if found["mixed_signs"] or found["n_undetermined"] > MOST * matrix.n:  # as in recovery where no mesh fits
        if (mass := mass_matrix(matrix, planar=False)) is not None:
            return of({"obstacle": mass.name}, mass)
        if (vector := second_reading(matrix)) is not None:
            return of_nodes(vector)
    return of(found, planar=True)


def _not_planar(matrix: OperatorMatrix) -> RecoveryError | None:
    """Why the largest component of the graph is not planar; None where some component is."""
    parts, errors = components(matrix.n, matrix.edges), []
    for part in parts:
        try:
            require_planar(len(part.vertices), part.edges)
        except NotPlanarError as error:
            errors.append(located(error, part, named=len(parts) > 1))
        else:
            return None
    return errors[0]


def _left_over(matrix: OperatorMatrix, topology: Topology) -> bool:
    """Whether nonzero entries belong to no cell."""
    return bool((matrix.entries[topology.bare_edges] != 0).any())
