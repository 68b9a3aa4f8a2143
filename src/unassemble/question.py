"""Which operator's recovery a checked matrix is for."""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .clock import Clock
from .diagnosis import explained, indefinite, judged, refuse_masses
from .errors import GeometryError, InputError, RecoveryError
from .matrix import OperatorMatrix
from .metric import could_be_planar, flattened, perhaps_planar, realised, recover_surface, unless_planar
from .operators import VectorReading, asked_for, second_reading, vector_valued
from .options import FrameOptions, OperatorOptions, ScalarOptions
from .outputs import PlanarMesh, Recovery, Surface
from .readings import ScalarReadings
from .scalar.placement import Placement
from .tolerances import LARGEST_NOISE


@dataclass(frozen=True, eq=False)
class Question:
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
        if self.matrix.alike:
            return None
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
            named = self.about.numbering is not None
            anchors, cells = self.frame.anchors, self.about.cells
            return recover_vector(self.matrix, reading, self.clock, anchors=anchors, cells=cells, named=named)
        except GeometryError as error:
            raise GeometryError(f"the matrix is {reading.name}, but {error}") from error
