"""Files of scipy and numpy, ``.npz`` and ``.npy``; nothing is ever unpickled."""

from typing import Any, BinaryIO

import numpy as np
import scipy.sparse as sp

from ..errors import MatrixFileError
from .canonical import working_dtype


def read_npz(stream: BinaryIO, name: str) -> Any:
    """Read what ``scipy.sparse.save_npz`` has written, as stored; index arrays are still to be checked.

    `name` is what to call the file in messages.

    Raises MatrixFileError if it holds no sparse matrix; ValueError if arrays do not belong together, or hold objects.
    """
    with np.load(stream, allow_pickle=False) as archive:
        held = archive.files
    if {"points", "node_status"} <= set(held):
        raise MatrixFileError(
            f"{name} is a mesh (as `recover` writes it), and a matrix is asked for: name the matrix's file"
        )
    if "format" not in held:
        what = ", ".join(repr(key[:40]) for key in held[:5]) + ", ..." * (len(held) > 5) or "nothing"
        raise MatrixFileError(f"{name} holds no sparse matrix ({what}): save one with scipy.sparse.save_npz")
    stream.seek(0)
    return sp.load_npz(stream)


def read_npy(stream: BinaryIO, name: str) -> sp.coo_array:
    """Read a dense array of ``numpy.save``, whose zeros are absent entries; MatrixFileError if it is no matrix."""
    dense = np.load(stream)  # which does not unpickle unless told
    if dense.ndim != 2 or dense.dtype.kind not in "biufc":
        what = f"an array of type {dense.dtype} with {dense.ndim} dimensions"
        raise MatrixFileError(f"{name} holds {what}, and a matrix of numbers has two")
    return sp.coo_array(dense.astype(working_dtype(dense.dtype), copy=False))
