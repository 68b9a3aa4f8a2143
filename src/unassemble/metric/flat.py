"""Surfaces that are flat: the planar mesh says more, with more certainty."""

from dataclasses import replace

import numpy as np

from ..recovery import PlanarMesh, Surface
from ..tolerances import CERTIFIED
from ..words import Reason
from .verdict import VARYING


def could_be_planar(surface: Surface) -> bool:
    """Whether a surface is flat, and its boundary turns as that of a planar domain does.

    The outer loop of each piece turns once to the left, and all others once to the right; those of a cylinder do not
    turn at all. Where loops touch the question is left open.
    """
    if not (surface.flat and surface.orientable.all()):
        return False
    if (np.bincount(surface.boundary.ravel(), minlength=surface.n_points) > 2).any():
        return True
    first, last = surface.boundary_offsets[:-1], surface.boundary_offsets[1:]
    vertices = [np.unique(surface.boundary[a:b]) for a, b in zip(first, last, strict=True)]
    turns = np.array([surface.curvature[loop].sum() for loop in vertices]) / (2 * np.pi)
    piece = surface.component[surface.boundary[first, 0]]
    outer = np.bincount(piece, turns > 0, minlength=surface.n_components)
    return bool((np.abs(np.abs(turns) - 1) < 1e-3).all() and (outer == 1).all())


def perhaps_planar(surface: Surface) -> bool:
    """Whether a planar mesh may have the same matrix: it is flat, or a hole may have been taken for a triangle.

    A planar mesh with a hole of three edges that is taken for a triangle mostly has lengths as well, and bends about
    that triangle; and so does one with three edges outside. Whether it is one the planar mesh tells, which has entries
    to spare.
    """
    if not (surface.orientable & (surface.genus == 0)).all():
        return False
    inside = surface.curvature.copy()
    inside[surface.boundary] = 0  # boundaries bend as they like
    bent = float(inside[surface.triangles].sum(axis=1).max())
    return could_be_planar(surface) or bent > _BENT[0 if surface.loops.all() else 1]


# Radians at the corners of a triangle that is none: 2.2 to 3.8 in the place of a hole; 14.5 in that of the outside,
# which has to hold all 4 pi, where on other closed surfaces at most 4.2 was seen.
_BENT = (1.5, 8.0)


def flattened(surface: Surface, planar: PlanarMesh) -> Surface:
    """A flat surface with the coordinates of the planar mesh that the same matrix gives, and with its certificate.

    In the plane there may be more entries than unknowns, and then rows may have any sum. A surface that is flat and no
    planar mesh, a cylinder for one, stays as it is; so does one that is bent, whose lengths are others where rows were
    taken out.
    """
    whole = planar.backward_error <= CERTIFIED and not planar.node_status.any()
    if not (whole and could_be_planar(surface) and planar.n_components == surface.n_components):
        return surface
    (ax, ay), (bx, by), (cx, cy) = planar.points[surface.triangles].transpose(1, 2, 0)
    # That it is flat shows that the coefficient is constant.
    notes = [note for note in (*surface.warnings, *planar.warnings) if note != VARYING]
    turned = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0
    return replace(
        surface,
        points=planar.points,
        triangles=np.where(turned[:, None], surface.triangles[:, [0, 2, 1]], surface.triangles),
        verdict=planar.verdict.explained("the surface is flat", *planar.verdict.reasons),
        backward_error=max(planar.backward_error, surface.backward_error),
        warnings=tuple(dict.fromkeys(notes)),
        reaction=planar.reaction,
        realisation={"misfit": 0.0, "largest": 0.0, "misfits": []},
    )


def unless_planar(surface: Surface) -> Surface:
    """A surface that was not asked for, certified only where no mesh in the plane has its triangles.

    It has as many lengths as entries, so that nearly any matrix on these triangles is that of one.
    """
    if surface.fits_no_plane:
        return surface
    varies = Reason(
        "the lengths give every entry back, but so may a coefficient that varies in the plane",
        advice="say so by `operator='surface'` if it is one in space, or else assemble it with a constant coefficient",
    )
    return replace(surface, verdict=surface.verdict.despite(varies))
