"""MATLAB files up to version 7, SuiteSparse's ``Problem.A`` included."""

from __future__ import annotations

import warnings
from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import canonical, entry_rows


def read_mat(stream: BinaryIO, name: str, variable: str | None = None) -> Any:
    """Read the sparse variable of a MATLAB file.

    The SuiteSparse collection keeps explicit zeros, which MATLAB cannot store, as the pattern
    ``Problem.Zeros``; they are put back into ``Problem.A``.

    Parameters
    ----------
    stream : binary file
        Seekable, at its beginning.
    name : str
        What to call it in messages.
    variable : str, optional
        Which one, such as ``"A"`` or ``"Problem.A"``; needed where several are sparse and square.

    Returns
    -------
    scipy sparse matrix

    Raises
    ------
    MatrixFileError
        If there is no sparse variable, or the choice is open.
    """
    contents, sizes = _load(stream, name)
    found = dict(_sparse_variables(contents))
    held = _listed({key: A.shape for key, A in found.items()} or sizes)
    if variable is not None:
        if variable not in found:
            raise MatrixFileError(f"{name} has no sparse variable {variable!r}: it holds {held}")
        return found[variable]
    square = [A for A in found.values() if A.shape[0] == A.shape[1]]
    candidates = square or list(found.values())
    if not candidates:
        raise MatrixFileError(f"{name} holds no sparse variable (it holds {held}): make one by sparse(A) and save it")
    if len(candidates) > 1:
        raise MatrixFileError(f"{name} holds several sparse variables ({held}): choose one by the option `variable`")
    return candidates[0]


def _load(stream: BinaryIO, name: str) -> tuple[dict[str, Any], dict[str, tuple[int, ...]]]:
    """What may hold a sparse matrix, by name, and the shapes of all variables."""
    from scipy.io import loadmat, whosmat  # not needed for the other formats

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # scipy warns of duplicate and unreadable variables; the latter are found below
        variables = whosmat(stream)
        stream.seek(0)
        wanted = [key for key, _, kind in variables if kind in ("sparse", "logical", "struct")]
        contents = loadmat(stream, variable_names=wanted) if wanted else {}
    for key, value in contents.items():
        if isinstance(value, str) and value.startswith("Read error"):
            raise MatrixFileError(f"{name} is truncated or damaged: its variable {key!r} cannot be read")
    for key, _, kind in variables:  # scipy forgets that a sparse variable is logical
        if kind == "logical" and sp.issparse(contents.get(key)):
            contents[key] = contents[key].astype(bool)
    return contents, {key: shape for key, shape, _ in variables}


def _sparse_variables(contents: dict[str, Any]) -> list[tuple[str, Any]]:
    found = []
    for key, value in contents.items():
        if sp.issparse(value):
            found.append((key, value))
        elif isinstance(value, np.ndarray) and value.dtype.names and value.size == 1:
            fields = {field: value[field].item() for field in value.dtype.names}
            sparse = {field: A for field, A in fields.items() if sp.issparse(A)}
            zeros = sparse.pop("Zeros", None) if "A" in sparse else None
            if zeros is not None and zeros.shape == sparse["A"].shape:
                sparse["A"] = _with_zeros(sparse["A"], zeros)
            found += [(f"{key}.{field}", A) for field, A in sparse.items()]
    return found


def _with_zeros(A: Any, zeros: Any) -> Any:
    """A with the pattern of `zeros` stored as explicit zeros."""
    A, zeros = canonical(A), canonical(zeros)
    rows = np.concatenate([entry_rows(A), entry_rows(zeros)])
    data = np.concatenate([A.data, np.zeros(zeros.nnz, dtype=A.dtype)])
    return sp.coo_array((data, (rows, np.concatenate([A.indices, zeros.indices]))), shape=A.shape)


def _listed(sizes: dict[str, tuple[int, ...]]) -> str:
    shown = [f"{key!r} of size {' x '.join(map(str, shape))}" for key, shape in list(sizes.items())[:6]]
    return (", ".join(shown) + (", ..." if len(sizes) > 6 else "")) or "nothing"
