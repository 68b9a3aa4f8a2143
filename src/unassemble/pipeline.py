"""The door: options, file, checks, and which operator's recovery a matrix is for."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .clock import Clock
from .diagnosis import explained, indefinite, judged, refuse_masses
from .errors import GeometryError, InputError, RecoveryError
from .linalg import threads as thread_limit
from .masses import weighed
from .matrix import OperatorMatrix, check_matrix, is_file, read_matrix
from .metric import could_be_planar, flattened, perhaps_planar, realised, recover_surface, unless_planar
from .operators import VectorReading, asked_for, second_reading, vector_valued
from .options import Direction, FrameOptions, OperatorOptions, ScalarOptions
from .outputs import PlanarMesh, Recovery, Surface
from .progress import StageDisplay, quiet_libraries
from .readings import ScalarReadings
from .scalar.placement import Placement
from .tolerances import LARGEST_NOISE, ROUNDED


def recover(
    A: Any,
    *,
    operator: str = "auto",
    method: str | None = None,
    refine: bool = True,
    scale: float | None = None,
    noise: float | None = None,
    drop_zeros: float | None = None,
    anchors: Sequence[Any] | Mapping[int, Any] | None = None,
    tensor: tuple[float, float, float] | None = None,
    direction: Direction | None = None,
    handed: str | None = None,
    standard_deviations: bool = False,
    triangulate: bool = False,
    block_size: int | None = None,
    numbering: Any = None,
    cells: bool = True,
    realise: bool = False,
    mass: Any = None,
    variable: str | None = None,
    threads: int | None = None,
    progress: Callable[[str], None] | bool | None = None,
) -> Recovery:
    """Recover the mesh that a matrix was assembled on.

    Scalar: A = c L + D, where L is the stiffness matrix of the Laplacian with linear elements on triangles in the
    plane and natural boundary conditions, c any nonzero number and D any diagonal matrix, both unknown.
    Vector-valued: isotropic linear elasticity in the plane or in space, with supports; see
    :mod:`unassemble.elasticity`. And frames, shells and plates, whose nodes have rotations beside
    displacements; see :mod:`unassemble.structures`. And the Laplacian of triangulated surfaces in space, c L + D, of
    which the edge lengths are found; see :mod:`unassemble.metric`.

    Parameters
    ----------
    A : sparse matrix or array, ndarray, path, or "-"
        A matrix; or a file with one: Matrix Market, scipy's ``.npz``, ``.mat``; ``"-"`` reads Matrix Market from
        standard input. Explicit zeros are structure.
    operator : {"auto", "laplacian", "elasticity", "surface"}
        Which operator A belongs to. ``"auto"`` reads planar meshes as scalar, matrices whose graph is none but
        whose rows form nodes of two or three unknowns as elasticity, and what fits no mesh in the plane but a surface
        in space as that.
    method : {None, "conformal", "angles"}
        How positions are found: by the conformal null vector, the default, or by the 2002 paper's equations for angles.
    refine : bool
        Polish the positions by Gauss-Newton to the level that the entries allow; not those of ``"angles"``, whose
        verdict is their own.
    scale : float, optional
        c, where it is known.
    noise : float, optional
        Standard deviation of independent Gaussian errors in the entries of the upper triangle; the certificate
        becomes a chi-square test. Where both triangles carry errors of their own their mean is fitted, and its
        error is smaller by a factor sqrt(2).
    drop_zeros : float, optional
        Forget stored entries of at most this times the largest off-diagonal entry of their row and of their
        transpose's.
    anchors : sequence of (row, x, y) or (row, x, y, z), or mapping of row to (x, y) or (x, y, z), optional
        Known positions. Two fix the similarity of their piece, a third, not in line, the mirror image. Elasticity
        knows its axes: two fix all.
    tensor : (kxx, kxy, kyy), optional
        A belongs to div(K grad) with this constant K; needs an orientation.
    direction : (row, row, degrees), optional
        Angle from the x axis of the line between two points.
    handed : {"left", "right"}, optional
        Side of that line, or of the line between two anchors, on which the piece's centroid lies.
    standard_deviations : bool
        Compute error bars: for `noise`, the rounding that entries show, or the noise that the misfit shows.
    triangulate : bool
        Divide cells of more than three vertices into triangles; the vertices lie on a circle, so that every division
        is a Delaunay triangulation and the matrix does not prefer one.
    block_size : {2, 3, 4, 6}, optional
        Vector-valued matrices: unknowns per node; found where it is not given. Four, of straight beams, and six are
        displacements and rotations.
    numbering : {"interleaved", "by component"} or (node_of_row, direction_of_row), optional
        Vector-valued matrices: how the unknowns stand; found where it is not given.
    cells : bool
        Vector-valued matrices: look for elements too, not only where nothing else confirms coordinates.
    realise : bool
        Surfaces: look for coordinates in space that have the edge lengths.
    mass : sparse matrix or array, ndarray, or path, optional
        The mass matrix of the same mesh, which tells its size, or with `anchors` its density; see
        :func:`unassemble.masses.weighed`.
    variable : str, optional
        Name of the variable in a ``.mat`` file.
    threads : int, optional
        Threads of the linear algebra libraries.
    progress : callable or bool, optional
        Called with the name of each stage as it starts; True shows the stage on standard error.

    Returns
    -------
    Recovery
        Certified or not; look at ``status``.

    Raises
    ------
    InputError
        For options that contradict each other, and files that cannot be read.
    RecoveryError
        If no mesh can be recovered from this matrix.

    Examples
    --------
    Two right triangles, the diagonal stored as an explicit zero. Without the scale there would be as many unknowns as
    entries, and no certificate:

    >>> import scipy.sparse as sp
    >>> from unassemble import recover
    >>> row, column = [0, 0, 0, 1, 2], [1, 2, 3, 3, 3]
    >>> half = sp.coo_array(([-0.5, -0.5, 0.0, -0.5, -0.5], (row, column)), shape=(4, 4))
    >>> full = sp.coo_array(
    ...     (list(half.data) * 2, (row + column, column + row)), shape=(4, 4)
    ... )
    >>> square = recover(full, scale=1.0)
    >>> square.status, len(square.triangles), float(round(square.scale[0], 12))
    ('certified', 2, 1.0)
    """
    about = OperatorOptions(operator=operator, block_size=block_size, numbering=numbering, cells=cells)
    frame = FrameOptions(anchors=anchors, tensor=tensor, direction=direction, handed=handed)
    planar = ScalarOptions(
        method="conformal" if method is None else method,
        refine=refine,
        scale=scale,
        noise=noise,
        standard_deviations=standard_deviations,
        triangulate=triangulate,
        threads=threads,
    )
    scalar_only = {
        "method": method, "scale": scale, "noise": noise, "tensor": tensor, "direction": direction,
        "handed": handed, "standard_deviations": standard_deviations or None,
    }  # fmt: skip
    given = tuple(name for name, value in scalar_only.items() if value is not None)
    with quiet_libraries(), StageDisplay(enabled=progress is True, wanted=True) as display:
        clock = Clock(progress if callable(progress) else display if progress else None)
        with clock("read"):
            matrix = read_matrix(A, variable=variable) if is_file(A) else A

        def answer(matrix: Any) -> Recovery:
            with clock("check"):
                checked = check_matrix(matrix, drop_zeros=drop_zeros, noise=noise)
            return _Task(checked, clock, about, frame, planar, given, realise).answer()

        with thread_limit(threads):
            return answer(matrix) if mass is None else weighed(answer, matrix, mass, frame.anchors)


@dataclass(frozen=True, eq=False)
class _Task:
    """A checked matrix and what is asked of it; `given` are the options given that only scalar matrices have."""

    matrix: OperatorMatrix
    clock: Clock
    about: OperatorOptions
    frame: FrameOptions
    planar: ScalarOptions
    given: tuple[str, ...]
    realise: bool = False

    def answer(self) -> Recovery:
        """What is asked for; mass matrices that are not read are refused by name."""
        refuse_masses(self.matrix, planar=not self.about.names_nodes, exact=True)
        try:
            found = self._as_asked()
        except RecoveryError:
            refuse_masses(self.matrix, planar=False)
            if (apart := self.matrix.without_joining_zeros()) is None:
                raise
            return replace(self, matrix=apart).answer()
        if not (found.certified or isinstance(found, PlanarMesh)):
            refuse_masses(self.matrix, planar=False)
        return found

    def _as_asked(self) -> Recovery:
        """As the operator that is named; else as the one that the graph shows, or else the first that fits."""
        if self.about.names_nodes:
            return self._as_vector()
        if self.about.operator == "surface":
            return self._as_surface()
        if self.about.operator == "laplacian":
            try:
                return judged(self._readings.likeliest(), self.matrix)
            except RecoveryError as error:
                raise explained(error, self.matrix) from error
        # Unknowns of one node overlap in more rows than nodes of scalar elements do: this takes no time from them.
        with suppress(InputError, RecoveryError):  # options may be for vector-valued matrices only
            found = (self._readings.lattice or self._readings.other_elements) if self._readings.crowded else None
            if found is not None and found.certified:
                return found
        at_sight = vector_valued(self.matrix)
        if at_sight is None:
            return self._first_that_fits()
        try:
            return self._as_vector(at_sight)
        except RecoveryError as error:
            if said := indefinite(self.matrix):
                raise GeometryError(said) from error
            raise

    @cached_property
    def _readings(self) -> ScalarReadings:
        self.planar.check_scale(self.matrix.entries)
        return ScalarReadings(self.matrix, Placement.of(self.matrix.n, self.frame), self.clock, self.planar)

    def _first_that_fits(self) -> Recovery:
        """A planar mesh; or a surface in space; or nodes of several unknowns where no rows, or fewer, belong to these.

        A straight beam's rows, for one, fall apart into planar graphs.
        """
        try:
            found = self._readings.likeliest()
        except RecoveryError as error:
            curved = self._as_certified_surface()
            other = self._as_second_reading() if curved is None else unless_planar(curved)
            if other is not None:
                return other
            raise explained(error, self.matrix) from error
        if found.certified:
            return found
        curved = self._as_certified_surface() if found.status == "uncertified" else None
        if curved is not None:
            noise, little = found.estimated_noise, LARGEST_NOISE * np.abs(found.scale).min()
            if curved.fits_no_plane or (not found.missing_term and (noise is None or noise > little)):
                return unless_planar(curved)
            note = "a surface in space has exactly these entries, as one has nearly any: see `operator='surface'`"
            found = replace(found, warnings=(*found.warnings, note))
        if not found.node_status.any():
            return judged(found, self.matrix)
        other = self._as_second_reading()
        better = other is not None and (other.certified or other.node_status.mean() < found.node_status.mean())
        return other if other is not None and better else judged(found, self.matrix)

    def _as_second_reading(self) -> Recovery | None:
        """The matrix as a vector-valued one, if anything speaks for that."""
        reading = second_reading(self.matrix)
        try:
            return None if reading is None else self._as_vector(reading)
        except (RecoveryError, InputError):  # options may be for scalar matrices only
            return None

    def _as_surface(self) -> Surface:
        """A surface in space, with coordinates on demand; a flat one with those of the planar mesh that it is."""
        found: Surface | None = None
        try:
            found = self._lengths()
        except GeometryError as error:
            failure = error
        if found is None or perhaps_planar(found):
            with suppress(RecoveryError):
                planar = self._readings.likeliest()
                triangles = planar.divided()[0]
                if planar.certified and (found is None or len(triangles) < len(found.triangles)):
                    found = self._lengths(triangles)  # holes of three edges, that were taken for triangles
                found = None if found is None else flattened(found, planar)
        if found is None:
            raise failure
        return realised(found, self.clock) if self.realise and found.dim == 3 else found

    def _as_certified_surface(self) -> Surface | None:
        """The matrix as that of a surface that is bent, if it is one without doubt."""
        if np.ptp(self.matrix.entries) <= ROUNDED * self.matrix.row_size.max():
            return None  # the Laplacian of a graph, most likely
        try:
            found = self._lengths()
        except (RecoveryError, InputError):  # options may be for planar meshes only
            return None
        if not found.certified or could_be_planar(found):
            return None
        chosen = replace(found, choice="no mesh in the plane has these entries")
        return realised(chosen, self.clock) if self.realise else chosen

    def _lengths(self, triangles: NDArray[np.int64] | None = None) -> Surface:
        fit = ("scale", "noise", "standard_deviations")
        unfit = [name for name in self.given if name not in fit] + ["anchors"] * bool(self.frame.anchors)
        if unfit:
            raise InputError(
                f"`{unfit[0]}` is not for surfaces in space: leave it out, or choose `operator='laplacian'`"
            )
        self.planar.check_scale(self.matrix.entries)
        return recover_surface(self.matrix, self.clock, self.planar, triangles)

    def _as_vector(self, reading: VectorReading | None = None) -> Recovery:
        """As read, or else as options say."""
        from .vector import recover_vector  # loads elasticity

        if self.given:
            raise InputError(
                f"`{self.given[0]}` is for scalar matrices, and this one is read as vector-valued: leave it out, or "
                "choose `operator='laplacian'`"
            )
        if reading is None:
            with self.clock("numbering"):
                reading = asked_for(self.matrix, self.about.block_size, self.about.numbering)
        try:
            return recover_vector(self.matrix, reading, self.clock, anchors=self.frame.anchors, cells=self.about.cells)
        except GeometryError as error:
            raise GeometryError(f"the matrix is {reading.name}, but {error}") from error
