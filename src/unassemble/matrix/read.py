"""Files with a sparse matrix: open, see what they are, hand them to their reader."""

import gzip
import io
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any, BinaryIO

import scipy.sparse as sp

from ..errors import InputError, MatrixFileError, UnassembleError
from ..formats import FORMATS
from .arrays import read_npy, read_npz
from .canonical import canonical, inconsistency
from .check import check_matrix
from .market import read_market
from .mat import read_mat, read_mat73
from .operator import OperatorMatrix
from .signatures import HEAD, foreign, kind_of
from .triplets import read_triplets

_READERS: dict[str, tuple[str, Callable[[BinaryIO, str], Any]]] = {
    "market": ("Matrix Market", read_market),
    "npz": (".npz", read_npz),
    "npy": (".npy", read_npy),
    "triplets": ("lines of row, column and entry", read_triplets),
}
_MATLAB: dict[str, Callable[[BinaryIO, str, str | None], Any]] = {
    "mat": read_mat,
    "hdf5": read_mat73,
}


def read_matrix(source: str | os.PathLike[str] | IO[Any], *, variable: str | None = None) -> sp.csr_array:
    """Read a matrix from Matrix Market, scipy's ``.npz``, ``.npy``, ``.mat`` or triplets, as its first bytes tell.

    Explicit zeros of the file are kept as structure; zeros of dense arrays and of scipy's diagonal storage, which
    cannot be told from padding, are not. Duplicates are summed. Pickles are never loaded.

    `source` is a path, ``"-"`` for standard input, or an open file; text may be compressed by gzip. `variable` is the
    name of one in a ``.mat`` file, such as ``"A"`` or ``"Problem.A"``. The result is of dtype float64, or complex128 or
    bool where the file says so, and neither square nor finite of necessity: see :func:`unassemble.matrix.check_matrix`.

    Raises MatrixFileError if the file cannot be read as a matrix; MatrixError if it holds a pattern without numbers, or
    far more rows than entries.
    """
    with _opened(source) as (stream, name):
        try:
            A = _read(stream, name, variable)
            problem = inconsistency(A)
            if problem:
                raise MatrixFileError(f"{name} holds a damaged matrix: {problem}")
            return canonical(A)
        except UnassembleError:
            raise
        except MemoryError as error:
            raise MatrixFileError(f"{name} asks for more memory than there is: it is too large, or damaged") from error
        except Exception as error:  # readers of binary formats fail in any way on damaged bytes
            if isinstance(error, OSError) and error.strerror:
                raise _unreadable(name, "read", error) from error
            why = re.split(r"[;\n]", str(error))[0][:120] or type(error).__name__
            raise MatrixFileError(f"{name} is truncated or damaged ({why}): write or download it again") from error


def _read(stream: Any, name: str, variable: str | None) -> Any:
    head = stream.read(HEAD)
    stream.seek(0)
    kind = kind_of(head)
    if kind == "gzip":
        with gzip.GzipFile(fileobj=stream, mode="rb") as unpacked:
            return _read(unpacked, name, variable)
    suffix = next((one for one, held in FORMATS.items() if held.name and name.lower().endswith(one)), "")
    if kind is None or (kind == "hdf5" and suffix):
        raise MatrixFileError(f"{name} {foreign(head, suffix)}")
    if kind in _MATLAB:
        return _MATLAB[kind](stream, name, variable)
    what, reader = _READERS[kind]
    if variable is not None:
        raise InputError(f"{name} is {what}, and only .mat files have variables: leave out `variable`")
    return reader(stream, name)


@contextmanager
def _opened(source: Any) -> Iterator[tuple[BinaryIO, str]]:
    """A binary stream that can be rewound, and its name for messages."""
    with ExitStack() as stack:
        if isinstance(source, str) and source == "-":
            if sys.stdin is None or sys.stdin.closed:
                raise MatrixFileError("standard input is closed: pipe a Matrix Market file into it")
            stream, name = getattr(sys.stdin, "buffer", sys.stdin), "standard input"
        elif hasattr(source, "read"):
            name = getattr(source, "name", "the file")
            stream, name = source, name if isinstance(name, str) else "the file"  # a pipe has a number
        elif isinstance(source, (str, bytes, os.PathLike)):
            name = os.fsdecode(source)
            try:
                stream = stack.enter_context(Path(name).open("rb"))
            except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
                raise _unreadable(repr(name), "opened", error) from error
        else:
            raise InputError(f"a matrix file is given by its path, '-' or an open file, not by {type(source).__name__}")
        yield _rewindable(stream, name), name


def _unreadable(name: str, what: str, error: Exception) -> MatrixFileError:
    """A refusal of the system, in its words."""
    return MatrixFileError(f"{name} cannot be {what}: {str(getattr(error, 'strerror', None) or error).lower()}")


def _rewindable(stream: Any, name: str) -> BinaryIO:
    """The stream itself, or a copy in memory of a pipe, of text, or of a file that was read from before."""
    try:
        if not isinstance(stream, io.TextIOBase) and stream.seekable() and stream.tell() == 0:
            return stream
        content = stream.read()
        return io.BytesIO(content.encode("utf-8", "replace") if isinstance(content, str) else content or b"")
    except (OSError, ValueError) as error:
        raise _unreadable(name, "read", error) from error


def load(source: Any, *, variable: str | None = None, drop_zeros: float | None = None) -> OperatorMatrix:
    """Read a matrix where `source` names a file, and check it.

    Options and errors are those of :func:`read_matrix` and :func:`check_matrix`.
    """
    return check_matrix(read_matrix(source, variable=variable) if is_file(source) else source, drop_zeros=drop_zeros)


def is_file(source: Any) -> bool:
    """Whether `source` names a file, or is an open one."""
    return isinstance(source, (str, bytes, os.PathLike)) or hasattr(source, "read")
