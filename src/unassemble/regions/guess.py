"""Which triangles have the same factor, at first sight.

The halves g = cot / 2 of a triangle's weights satisfy g1 g2 + g2 g3 + g3 g1 = 1/4, so that sharing each entry equally
between its two triangles gives a value of c for each of them, right to some thirty per cent. Medians over neighbours
bring that down to a few per cent and keep jumps where they are.
"""

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ..matrix import OperatorMatrix
from ..topology import Piece
from ..topology.numbering import connected

_WIDTH = 0.05  # of the Gaussians whose sum is the density of log c
_VALLEY = 0.5  # the least density between two peaks, relative to the lower one, up to which they are two


def uneven(matrix: OperatorMatrix) -> bool:
    """Whether entries have several sizes, each in many rows, so that regions are likelier than one factor.

    By the density of log sizes, those of rows being means over their entries, then twice over their neighbours; that
    takes next to no time.
    """
    ends = matrix.edges.T
    graph = sp.coo_array((np.ones(ends.shape[1]), ends), shape=(matrix.n, matrix.n)).tocsr()
    graph = graph + graph.T + sp.eye_array(matrix.n)
    count = graph.sum(axis=1)
    total = np.bincount(ends.ravel(), np.tile(np.abs(matrix.entries), 2), matrix.n)
    size = np.log(total / count + np.finfo(float).tiny)
    for _ in range(2):
        size = (graph @ size) / count
    return len(_valleys(size)) > 0


def guessed_regions(
    piece: Piece, weights: NDArray, given: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Regions (m,) of triangles, edge-connected, and their factors (k,), from -A_ij (e,), if anything of it is given.

    What a side lacks is taken for the mean of the other two.
    """
    share = np.where(given, weights / (piece.inner + 1.0), 0.0)
    sides, lacking = share[piece.opposite], ~given[piece.opposite]
    mean = sides.sum(axis=1, keepdims=True) / np.maximum((~lacking).sum(axis=1, keepdims=True), 1)
    sides = np.where(lacking, mean, sides)
    unit = np.abs(share).max() + np.finfo(float).tiny
    a, b, c = sides.T / unit
    own = np.log(unit) + np.log(2 * np.sqrt(np.maximum(a * b + b * c + c * a, 1e-12)))
    corners = corners_of(piece)
    touching = sp.csr_array(corners @ corners.T)
    smooth = own
    for _ in range(3):
        smooth = _medians(touching, smooth)
    region = _connected(piece, np.searchsorted(_valleys(smooth), smooth))
    region = _broad(piece, region, smooth)
    scale = np.array([np.exp(np.median(own[region == k])) for k in range(region.max() + 1)])
    return region, np.sign(weights.sum()) * scale


def corners_of(piece: Piece) -> sp.csr_array:
    """(m, n) ones: which triangles have which vertices."""
    m = len(piece.triangles)
    ones = np.ones(3 * m, dtype=np.int32)
    return sp.csr_array((ones, piece.triangles.ravel(), np.arange(0, 3 * m + 1, 3)), shape=(m, piece.n_vertices))


def _medians(graph: sp.csr_array, values: NDArray) -> NDArray[np.float64]:
    """(m,) medians over the neighbours of each, itself among them."""
    order = np.argsort(values)
    rank = np.empty(len(order), dtype=graph.indices.dtype)
    rank[order] = np.arange(len(order))
    ranked = sp.csr_array((graph.data, rank[graph.indices], graph.indptr), shape=graph.shape)
    ranked.sort_indices()
    return np.asarray(values[order[ranked.indices[graph.indptr[:-1] + np.diff(graph.indptr) // 2]]])


def _valleys(values: NDArray) -> NDArray[np.float64]:
    """Values that part the peaks of the density of others."""
    step = _WIDTH / 4
    grid = np.arange(values.min() - 1, values.max() + 1, step)
    density = gaussian_filter1d(np.histogram(values, np.append(grid, grid[-1] + step) - step / 2)[0] * 1.0, 4)
    peaks = np.flatnonzero((density[1:-1] > density[:-2]) & (density[1:-1] >= density[2:])) + 1
    while len(peaks) > 1:
        low = [density[i : j + 1].min() / min(density[i], density[j]) for i, j in pairwise(peaks)]
        k = int(np.argmax(low))
        if low[k] < _VALLEY:
            break
        peaks = np.delete(peaks, k + (density[peaks[k]] > density[peaks[k + 1]]))
    return np.array([grid[i + int(density[i : j + 1].argmin())] for i, j in pairwise(peaks)])


def _connected(piece: Piece, region: NDArray) -> NDArray[np.int64]:
    """(m,) edge-connected parts of regions."""
    one, other = piece.facing[piece.inner].T // 3
    alike = region[one] == region[other]
    return connected(len(region), one[alike], other[alike])[1]


def _broad(piece: Piece, region: NDArray, values: NDArray) -> NDArray[np.int64]:
    """(m,) without regions that have no vertex to themselves: blends of those beside them, which they are given to."""
    both = piece.facing[piece.inner] // 3
    both = np.concatenate([both, both[:, ::-1]])
    boundary = np.zeros(piece.n_vertices, dtype=bool)
    boundary[piece.boundary] = True
    while (count := region.max() + 1) > 1:
        least, most = np.full(piece.n_vertices, count), np.full(piece.n_vertices, -1)
        for corner in piece.triangles.T:
            np.minimum.at(least, corner, region)
            np.maximum.at(most, corner, region)
        broad = np.bincount(least[(least == most) & ~boundary], minlength=count) > 0
        typical = np.array([np.median(values[region == k]) for k in range(count)])
        here, there = both[~broad[region[both[:, 0]]] & (region[both[:, 0]] != region[both[:, 1]])].T
        if not broad.any() or not len(here):
            break
        cost = np.abs(typical[region[there]] - values[here]) + 1e3 * ~broad[region[there]]
        order = np.lexsort((cost, here))
        here, there = here[order], there[order]
        first = np.append(True, here[1:] != here[:-1])
        moved = region.copy()
        moved[here[first]] = region[there[first]]
        region = np.unique(moved, return_inverse=True)[1].ravel()
    return region
