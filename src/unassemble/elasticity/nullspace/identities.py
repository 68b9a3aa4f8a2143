"""The linear identities between an elasticity matrix and the coordinates of its nodes.

With p_c = int lambda d_c phi_i and q_c = int mu d_c phi_i, row i of block (c, b) of the matrix, applied
to the coordinate x_a, is

    (A^{cb} x_a)_i = delta_ab p_c + delta_ac q_b + delta_cb q_a.

At each node these d^3 numbers lie in a space of dimension 2 d, known beforehand, and where homogeneous material
surrounds the node, they vanish. What sticks out of that space is linear in the coordinates and vanishes for the true
ones. p and q never appear as unknowns.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ...nodes.nodal import NodalMatrix, determined
from ...tolerances import ALIKE, SMALL


def boundary_terms(d: int) -> NDArray[np.float64]:
    """(d, d, d, 2 d) what p_1 .. p_d, q_1 .. q_d put into the places c, b, a."""
    one = np.eye(d)
    p = np.einsum("ab,ck->cbak", one, one)
    q = np.einsum("ac,bk->cbak", one, one) + np.einsum("cb,ak->cbak", one, one)
    return np.concatenate([p, q], axis=3)


def seen_terms(valid: NDArray[np.bool_], terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """(d, d, d, k) boundary terms in the valid places (d, d, d) of one node.

    A node without a row of direction b may use its place (b, b, b) for an equation without boundary terms.
    """
    d = len(valid)
    seen = terms * valid[..., None]
    for b in range(d):
        if valid[b].sum() == 1 and valid[b, b, b]:
            seen[b, b, b] = 0
    return seen


def boundary_basis(valid: NDArray[np.bool_], terms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthonormal basis of the boundary terms seen by the valid places (d, d, d) of one node: (d, d, d, k)."""
    d = len(valid)
    u, s, _ = np.linalg.svd(seen_terms(valid, terms).reshape(d**3, terms.shape[3]), full_matrices=False)
    return u[:, s > 1e-10].reshape(d, d, d, -1)


@dataclass(frozen=True, eq=False)
class Identities:
    """The valid identities of some nodes, as an operator on the coordinates of the nodes they touch.

    Row k couples to ``columns[indices[indptr[k]:indptr[k + 1]]]``.
    """

    rows: NDArray[np.int64]  # (m,) nodes whose rows are used
    columns: NDArray[np.int64]  # (n,) nodes that these rows touch, increasing
    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    data: NDArray[np.float64]  # (nnz, d, d) blocks relative to the size of their row, zero where not valid
    valid: NDArray[np.bool_]  # (m, d, d, d) places (c, b, a) that count
    kinds: list[tuple[NDArray[np.int64], NDArray[np.float64]]]  # rows with the same places, and their boundary basis
    equations: NDArray[np.int64]  # (m,) of each row once p and q are eliminated

    @property
    def dim(self) -> int:
        """Dimension of space."""
        return self.data.shape[1]

    @cached_property
    def _stacked(self) -> sp.csr_array:
        """(m d d, n): all blocks of the matrix, rows ordered by node, c, b."""
        d = self.dim
        shape = (len(self.rows) * d * d, len(self.columns))
        return sp.bsr_array((self.data.reshape(-1, d * d, 1), self.indices, self.indptr), shape=shape).tocsr()

    @cached_property
    def _even(self) -> bool:
        """Whether pairs (c, b) are valid for all coordinates or for none."""
        return bool((self.valid == self.valid[..., :1]).all())

    def apply(self, x: NDArray) -> NDArray[np.float64]:
        """(m, d, d, d, k) products A^{cb} x_a, by node, c, b, a, for k fields x of shape (n, d, k)."""
        n, d, k = x.shape
        value = (self._stacked @ x.reshape(n, d * k)).reshape(-1, d, d, d, k)
        return value if self._even else value * self.valid[..., None]

    def residual(self, x: NDArray) -> NDArray[np.float64]:
        """(m, d, d, d, k) what sticks out of the boundary terms; zero for the true coordinates."""
        return self.outside_terms(self.apply(x))

    def outside_terms(self, value: NDArray) -> NDArray[np.float64]:
        """(m, d, d, d, k) what sticks out of the boundary terms of such products, which are overwritten."""
        for rows, basis in self.kinds:
            part = np.einsum("cbap,ncbak->npk", basis, value[rows], optimize=True)
            value[rows] -= np.einsum("cbap,npk->ncbak", basis, part, optimize=True)
        return value

    def gradient(self, residual: NDArray) -> NDArray[np.float64]:
        """(n, d, k) transpose of :meth:`residual`, for values in its range."""
        d, k = self.dim, residual.shape[-1]
        return (self._stacked.T @ residual.reshape(-1, d * k)).reshape(-1, d, k)

    def normal_matrix(self) -> sp.bsr_array:
        """(n d, n d) the normal matrix in blocks of d; those of zeros are missing, except on the diagonal."""
        d = self.dim
        q = self._boundary_part()
        normal = self._gram() - q.T @ q
        if (np.abs(normal.diagonal()).reshape(-1, d).max(axis=1) == 0).any():  # a node in no equation
            stored = sp.eye_array(normal.shape[0], format="csr") * np.finfo(float).tiny
            normal = sp.csr_array(normal.tocsr() + stored).tobsr((d, d))
        normal.sort_indices()
        return normal

    def _gram(self) -> sp.bsr_array:
        """The normal matrix with p and q set to zero."""
        d, stacked = self.dim, self._stacked
        if self._even:  # the same for all coordinates
            one = sp.csr_array(stacked.T @ stacked)
            blocks = one.data[:, None, None] * np.eye(d)
            return sp.bsr_array((blocks, one.indices, one.indptr), shape=(d * one.shape[0],) * 2)
        parts = []
        for a in range(d):
            part = sp.csr_array(sp.diags_array(self.valid[..., a].ravel().astype(float)) @ stacked)
            parts.append(sp.kron(part.T @ part, np.diag(np.arange(d) == a).astype(float), format="csr"))
        return sp.csr_array(sum(parts[1:], start=parts[0])).tobsr((d, d))

    def _boundary_part(self) -> sp.bsr_array:
        """Components of the products along the boundary terms: blocks of 2 d by d."""
        d, m = self.dim, len(self.rows)
        row = np.repeat(np.arange(m), np.diff(self.indptr))
        blocks = np.zeros((len(self.indices), 2 * d, d))
        for rows, basis in self.kinds:
            here, k = np.isin(np.arange(m), rows)[row], basis.shape[3]
            if k:
                weights = basis.transpose(0, 1, 3, 2).reshape(d * d, -1)
                blocks[here, :k] = (self.data[here].reshape(-1, d * d) @ weights).reshape(-1, k, d)
        return sp.bsr_array((blocks, self.indices, self.indptr), shape=(2 * d * m, d * len(self.columns)))


def identities(
    nodal: NodalMatrix, valid: NDArray[np.bool_], rows: NDArray[np.int64], terms: NDArray[np.float64] | None = None
) -> Identities:
    """Collect the valid identities of some rows (m,), without those that say nothing once p and q are eliminated.

    What is `valid`, (n, d, d) or (n, d, d, d), see :func:`.nodal.valid_pairs`. The
    fewer boundary `terms` (d, d, d, t) are unknown, the more equations are left; any p and q, where they are not given.
    """
    terms = boundary_terms(nodal.dim) if terms is None else terms
    valid = valid if valid.ndim == 4 else np.repeat(valid[..., None], nodal.dim, axis=3)
    code = valid[rows].reshape(-1, nodal.dim**3) @ (1 << np.arange(nodal.dim**3))
    alike = [(code == value, boundary_basis(valid[rows[np.argmax(code == value)]], terms)) for value in np.unique(code)]
    equations = valid[rows].sum(axis=(1, 2, 3))
    for same, basis in alike:
        equations[same] -= basis.shape[3]
    telling = equations > 0
    rows, equations = rows[telling], equations[telling]
    kinds = [(np.flatnonzero(same[telling]), basis) for same, basis in alike if (same & telling).any()]
    entries = np.arange(len(nodal.indices))
    part = sp.csr_array((entries, nodal.indices, nodal.indptr), shape=(nodal.n, nodal.n))[rows]
    row = np.repeat(np.arange(len(rows)), np.diff(part.indptr))
    data = nodal.data[part.data] * (valid[rows].any(axis=3) / nodal.size[rows, None, None])[row]
    live = (data != 0).any(axis=(1, 2))
    columns, local = np.unique(part.indices[live].astype(np.int64), return_inverse=True)
    indptr = np.concatenate([[0], np.cumsum(np.bincount(row[live], minlength=len(rows)))]).astype(np.int32)
    return Identities(rows, columns, indptr, local.astype(np.int32), data[live], valid[rows], kinds, equations)


def poisson_ratio(lame_ratio: float) -> float:
    """Poisson's ratio, in plane strain where the body is plane, of lambda / mu."""
    return lame_ratio / (2 * (1 + lame_ratio))


def lame_ratio(nodal: NodalMatrix, valid: NDArray[np.bool_], points: NDArray[np.float64]) -> float | None:
    """The number lambda / mu of the body; None where it varies or does not show.

    p and q are in this ratio at every node. They vanish at nodes around which the material is homogeneous, so that
    nodes on free surfaces and material interfaces count.
    """
    known, d = determined(points), nodal.dim
    local = identities(nodal, valid, np.arange(nodal.n))
    if not len(local.rows):
        return None
    value = local.apply(np.where(known[:, None], points, 0.0)[local.columns, :, None])
    both = np.full((len(local.rows), 2 * d), np.nan)  # p and q, in units of the size of the row
    for rows, basis in local.kinds:
        if basis.shape[3] == 2 * d:  # the valid pairs determine them
            seen = seen_terms(local.valid[rows[0]], boundary_terms(d)).reshape(d**3, 2 * d)
            both[rows] = value[rows].reshape(len(rows), -1) @ np.linalg.pinv(seen).T
    unknown = nodal.graph @ (~known).astype(float) > 0
    p, q = np.split(both[np.isfinite(both).all(axis=1) & ~unknown[local.rows]], 2, axis=1)
    strength = np.linalg.norm(q, axis=1)
    if strength.max(initial=0.0) < 1e-8:
        return None
    p, q = p[strength > SMALL * strength.max()], q[strength > SMALL * strength.max()]
    ratio = float((p * q).sum() / (q * q).sum())
    misfit = np.linalg.norm(p - ratio * q, axis=1) / np.linalg.norm(q, axis=1)
    return ratio if np.max(misfit) <= ALIKE * (1 + abs(ratio)) else None
