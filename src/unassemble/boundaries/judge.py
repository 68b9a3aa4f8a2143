"""Which vertices the whole entries determine, and check.

Displacements that change no whole entry, to first order, are the null space of their Jacobian J, the logarithm of c
taken along: similarities of a piece as a whole, and what moves the vertices that are not determined. An entry that
belongs to no dependency y'J = 0 fits whatever it is, and what hangs on such entries is no more than plausible. They
show in random vectors from which their image under J was taken: what is left there is zero.

So what moves a vertex is a displacement d with J d = r, r anything at unchecked entries and zero elsewhere. If one
does, then so does a random one, with probability one: x -> x + (J'J)^-1 J'(r - J x) leads to it from a random start,
with one factorisation and no basis of all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse import csgraph

from ..certificate import Certificate, Findings
from ..errors import GeometryError
from ..linalg import Factorisation, UpperTriangle, nearly_singular
from ..recovery import Examined
from ..tolerances import ROUNDED
from ..topology import Piece
from ..topology.keys import pair_keys
from ..words import Reason, count_of
from .fit import WholeEntries, jacobian_rows


def determined(
    problem: WholeEntries, z: NDArray, scale: NDArray, whole: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.complex128]]:
    """Vertices (n,), up to a similarity of all of them, and entries (e,) that determine and check them.

    At positions z and a scale with which whole entries, (e,) bool, fit, but for what one more step of Gauss and Newton
    leaves of their misfits: last are the displacements (n,) of that.
    """
    piece = problem.piece
    jacobian = jacobian_rows(piece.n_vertices, [(problem.gradient(z, scale), piece.stencil)])
    misfit = problem.misfits(z, scale)
    return determined_by(jacobian, problem.slopes(z, scale), whole, z, piece, misfit, problem.analysed)


def determined_by(
    jacobian: sp.bsr_array, slopes: NDArray, whole: NDArray[np.bool_], z: NDArray, piece: Piece, misfit: NDArray,
    analysed: Callable[[UpperTriangle], Factorisation] | None = None,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.complex128]]:  # fmt: skip
    """The same by the derivatives of entries, (e, 2 n) in blocks of x and y, theirs by log c, (e, k), and misfits (e,).

    Of the piece only its edges and its boundary matter, between the n vertices. With what has analysed the pattern of
    the normal matrix already.
    """
    n = len(z)
    length = np.abs(z[piece.edges[:, 1]] - z[piece.edges[:, 0]])
    size = np.bincount(piece.edges.ravel(), np.repeat(length, 2), n) / np.bincount(piece.edges.ravel(), minlength=n)
    row = np.repeat(np.arange(len(whole)), np.diff(jacobian.indptr))
    held = np.zeros(n, dtype=bool)
    held[jacobian.indices[whole[row]]] = True
    data = jacobian.data * (size[jacobian.indices] * whole[row])[:, None, None]
    scaled = sp.bsr_array((data, jacobian.indices, jacobian.indptr), shape=jacobian.shape)
    slopes = np.where(whole[:, None], slopes, 0.0)
    basis = np.linalg.qr(slopes[:, slopes.any(axis=0)])[0]
    try:
        checked, free, step = _judged(scaled, basis, whole, held, misfit * whole, analysed)
    except GeometryError:
        checked, free, step = np.zeros_like(whole), np.zeros((n, 0), np.complex128), np.zeros(n, np.complex128)
    if not checked.any():
        return np.zeros(n, dtype=bool), checked, step * size
    held = np.zeros(n, dtype=bool)
    held[jacobian.indices[checked[row]]] = True
    vertices = _moving_alike(piece, z, free * size[:, None], size, held)
    loose = np.bincount(row, ~vertices[jacobian.indices], len(whole)) > 0
    return vertices, checked & ~loose, step * size


def unknowns(known: NDArray[np.bool_], factors: int) -> int:
    """Coordinates of determined vertices, of which one has no entry, and factors, less a similarity."""
    return 2 * max(int(known.sum()), 2) - 4 + factors


def node_status(component: NDArray[np.int64], parts: Sequence[tuple[NDArray, NDArray]]) -> NDArray[np.int8]:
    """(n,) as in :class:`..recovery.Recovery`: what the piece says of a row whose component, (n,), it is in.

    `parts`: rows (k,) of each piece, and whether each is determined there, (k,) bool. A vertex of two pieces may be
    determined in one of them only.
    """
    status = np.ones(len(component), np.int8)
    for label, (rows, known) in enumerate(parts):
        own = component[rows] == label
        status[rows[own]] = np.where(known[own], 0, 2)
    return status


@dataclass(frozen=True, eq=False)
class PartComparison:
    """A mesh compared with the entries that are whole, of all those of its matrix."""

    certificate: Certificate
    pairs: NDArray[np.int64]  # (k, 2) the whole entries at points that are determined

    @property
    def backward_error(self) -> float:
        """The largest misfit of a whole entry."""
        n = int(self.certificate.pairs.max(initial=0)) + 1
        place = np.searchsorted(self.certificate.pairs @ [n, 1], pair_keys(n, *self.pairs.T))
        return float(self.certificate.misfits[place].max(initial=0.0))

    def worst(self, count: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Entries that fit worst, whole or not, and their misfits."""
        return self.certificate.worst(count)


def partly(
    status: NDArray[np.int8],
    compared: PartComparison,
    claimed: NDArray[np.bool_],
    spare: int,
    told: str = "",
    *,
    bars: bool,
) -> Examined:
    """What is said of a mesh that whole entries determine where status, (n,), is 0.

    Certified if it gives them back, some of them to `spare`, and no `claimed` cell, (m,) bool, is turned over. `told`
    names what else than points was found, and `bars` says whether standard deviations were asked for.
    """
    error, count = compared.backward_error, len(compared.pairs)
    known, plausible = int((status == 0).sum()), int((status == 2).sum())
    fits = (
        f"{known:,} of {len(status):,} points are determined by {count:,} whole entries, which the operator "
        f"re-assembled on them{told} gives back to {error:.1e} (relative)"
    )
    objections = []
    if claimed[compared.certificate.flipped].any():
        objections.append(Reason("cells are turned over"))
    if not spare > 0:
        objections.append(Reason(f"{fits}, but no entries are to spare"))
    note = (
        f"{count_of(plausible, 'position is', 'positions are')} plausible and no more (`node_status` 2): next to "
        "unknowns that were taken out, or that other terms share, entries do not determine them"
    )
    notes = [note] * bool(plausible) + ["standard deviations are not computed of parts of a mesh, or of regions"] * bars
    return Examined(Findings((fits,), error, tuple(objections)), notes)


def _judged(
    jacobian: sp.bsr_array, slope: NDArray, entries: NDArray[np.bool_], held: NDArray[np.bool_], misfit: NDArray,
    analysed: Callable[[UpperTriangle], Factorisation] | None,
) -> tuple[NDArray[np.bool_], NDArray[np.complex128], NDArray[np.complex128]]:  # fmt: skip
    """(e,) entries that others say something about, and (n, k) displacements that leave these as they are.

    And (n,) those that leave least of a misfit (e,). `jacobian` (e, 2 n) is in lengths of edges, zero for all but some
    `entries`, (e,) bool, and `slope` (e, k) an orthonormal basis of the columns of log c; vertices `held`, (n,) bool,
    are those that some of the entries depend on.

    The inverse is that of J'J, made definite by a small shift: eigenvalues less than some hundred times as large
    count as zero, so that a larger one, which slivers ask for, counts more as free. With c free its columns are
    projected out, which is a matter of low rank.
    """
    transposed = jacobian.T.tobsr()
    normal = UpperTriangle.of(transposed @ jacobian)

    def without_slope(image: NDArray) -> NDArray[np.float64]:
        return np.asarray(image - slope @ (slope.T @ image))

    with nearly_singular(normal, analysed and analysed(normal)) as solver:
        pull = transposed @ slope
        response = solver.solve(pull) if pull.size else pull
        left = slope.T @ slope - pull.T @ response

        def preimage(y: NDArray) -> NDArray:
            x = solver.solve(np.ascontiguousarray(transposed @ without_slope(y)))
            return np.asarray(x + response @ np.linalg.lstsq(left, pull.T @ x, rcond=None)[0])

        rng, probes = np.random.default_rng(1), 2
        y = rng.standard_normal((len(slope), probes)) * entries[:, None]
        x = preimage(np.column_stack([misfit, y]))
        step = np.ascontiguousarray(x[:, 0]).view(np.complex128)
        y = y - jacobian @ x[:, 1:]
        for _ in range(2):  # what the shift leaves, and rounding
            y = y - jacobian @ preimage(y)
        y = without_slope(y)
        checked = entries & (np.abs(y).max(axis=1) > 1e-6)
        right = rng.standard_normal(y.shape) * (entries & ~checked)[:, None]
        x = rng.standard_normal((2 * len(held), probes)) * np.repeat(held, 2)[:, None]
        for _ in range(5):
            change = preimage(right - jacobian @ x)
            x = x + change
            if np.abs(change).max() <= ROUNDED * np.abs(x).max():
                break
        return checked, np.ascontiguousarray((x / np.linalg.norm(x, axis=0)).T).view(np.complex128).T, step


def _moving_alike(piece: Piece, z: NDArray, free: NDArray, size: NDArray, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) the most vertices that every displacement moves by one similarity: about one of those far from the rim.

    Beyond a neck others may move by another one.
    """
    n = len(z)
    graph = sp.coo_array((np.ones(len(piece.edges), np.int8), piece.edges.T), shape=(n, n)).tocsr()
    graph = graph + graph.T
    outside = np.union1d(piece.boundary.ravel(), np.flatnonzero(~held))
    depth = np.where(held, csgraph.dijkstra(graph, unweighted=True, indices=outside, min_only=True), -1)
    basis = np.column_stack([np.ones(n), z / np.abs(z).max()])
    best = np.zeros(n, dtype=bool)
    for _ in range(8):
        deepest = int(depth.argmax())
        alike = np.zeros(n, dtype=bool)
        alike[[deepest, *graph.indices[graph.indptr[deepest] : graph.indptr[deepest + 1]]]] = True
        depth[alike] = -1
        while True:
            fit = np.linalg.lstsq(basis[alike], free[alike], rcond=None)[0]
            moves = np.abs(free - basis @ fit).max(axis=1, initial=0.0)
            now = held & (moves <= 1e-9 * size)
            if now.sum() <= alike.sum():
                alike = np.zeros(n, dtype=bool) if (alike & ~now).any() else now
                break
            alike = now
        depth[alike] = -1
        best = alike if alike.sum() > best.sum() else best
        if 2 * best.sum() > held.sum():
            break
    return best
