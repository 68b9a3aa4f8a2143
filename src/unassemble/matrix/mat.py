"""MATLAB files of versions 5 to 7, SuiteSparse's ``Problem.A`` included.

The reader of scipy (1.17) ends the process by a segmentation fault on some damaged files; this one looks at every
length before it believes it, and unpacks nothing but what may hold a sparse matrix.
"""

from __future__ import annotations

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import canonical, entry_rows
from .mat5 import Variable, read_mat5


def read_mat(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read the sparse variable of a MATLAB file.

    The SuiteSparse collection keeps explicit zeros, which MATLAB cannot store, as the pattern
    ``Problem.Zeros``; they are put back into ``Problem.A``.

    Parameters
    ----------
    stream : binary file
    name : str
        What to call it in messages.
    variable : str, optional
        Which one, such as ``"A"`` or ``"Problem.A"``; needed where several are sparse and square.

    Returns
    -------
    scipy sparse array
        Its index arrays are still to be checked.

    Raises
    ------
    MatrixFileError
        If there is no sparse variable, or the choice is open.
    ValueError
        If the file is truncated or damaged, in a few words.
    """
    variables = read_mat5(stream.read())
    found = dict(_sparse_variables(variables))
    held = _listed({key: A.shape for key, A in found.items()} or {v.name: v.shape for v in variables})
    if variable is not None:
        if variable not in found:
            raise MatrixFileError(f"{name} has no sparse variable {variable!r}: it holds {held}")
        return found[variable]
    square = [A for A in found.values() if A.shape[0] == A.shape[1]]
    candidates = square or list(found.values())
    if not candidates:
        raise MatrixFileError(f"{name} holds no sparse variable (it holds {held}): make one by sparse(A) and save it")
    if len(candidates) > 1:
        raise MatrixFileError(f"{name} holds several sparse variables ({held}): choose one by `variable=NAME`")
    return candidates[0]


def _sparse_variables(variables: list[Variable]) -> list[tuple[str, Any]]:
    found = []
    for v in variables:
        if v.sparse is not None:
            found.append((v.name, v.sparse))
        sparse = {f.name: f.sparse for f in v.fields if f.sparse is not None}
        zeros = sparse.pop("Zeros", None) if "A" in sparse else None
        if zeros is not None and zeros.shape == sparse["A"].shape:
            sparse["A"] = _with_zeros(sparse["A"], zeros)
        found += [(f"{v.name}.{key}", A) for key, A in sparse.items()]
    return found


def _with_zeros(A: Any, zeros: Any) -> Any:
    """A with the pattern of `zeros` stored as explicit zeros."""
    A, zeros = canonical(A), canonical(zeros)
    rows = np.concatenate([entry_rows(A), entry_rows(zeros)])
    data = np.concatenate([A.data, np.zeros(zeros.nnz, dtype=A.dtype)])
    return sp.coo_array((data, (rows, np.concatenate([A.indices, zeros.indices]))), shape=A.shape)


def _listed(sizes: dict[str, tuple[int, ...]]) -> str:
    shown = [f"{key[:40]!r} of size {' x '.join(map(str, shape[:4]))}" for key, shape in list(sizes.items())[:6]]
    return (", ".join(shown) + (", ..." if len(sizes) > 6 else "")) or "nothing"
