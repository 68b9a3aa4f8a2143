"""Files of other kinds: dense arrays, MATLAB 4 and 7.3, lines of row, column and entry."""

from __future__ import annotations

import io

import h5py
import numpy as np
import pytest
import scipy.sparse as sp

from meshes import random_mesh, specimen
from unassemble import MatrixFileError, recover
from unassemble.matrix import check_matrix, read_matrix

TRUE = specimen(*random_mesh(60, seed=2), c=2.0)


def same(A) -> None:
    """Whether a matrix that was read is that of the mesh, zeros apart."""
    np.testing.assert_allclose(A.toarray(), TRUE.matrix.toarray(), rtol=1e-15)


def matlab_73(**variables) -> io.BytesIO:
    """As MATLAB lays sparse variables out in HDF5, behind a block of its own of 512 bytes."""
    stream = io.BytesIO()
    with h5py.File(stream, "w", userblock_size=512) as file:
        for name, value in variables.items():
            if not sp.issparse(value):
                file[name] = value
                continue
            csc = sp.csc_array(value)
            group = file.create_group(name)
            group.attrs["MATLAB_sparse"] = np.uint64(csc.shape[0])
            group.attrs["MATLAB_class"] = np.bytes_("double")
            data = csc.data
            if data.dtype.kind == "c":
                data = data.view([("real", "f8"), ("imag", "f8")])
            group["data"], group["ir"] = data, csc.indices.astype(np.uint64)
            group["jc"] = csc.indptr.astype(np.uint64)
    content = bytearray(stream.getvalue())
    content[:128] = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM"
    return io.BytesIO(bytes(content))


def test_dense_array(tmp_path):
    np.save(tmp_path / "A.npy", TRUE.matrix.toarray())
    same(read_matrix(tmp_path / "A.npy"))
    assert recover(tmp_path / "A.npy").certified


@pytest.mark.parametrize("array", [np.arange(3.0), np.zeros((2, 2, 2)), np.array([["a", "b"], ["c", "d"]])])
def test_dense_arrays_that_are_no_matrix(tmp_path, array):
    np.save(tmp_path / "A.npy", array)
    with pytest.raises(MatrixFileError, match="a matrix of numbers has two"):
        read_matrix(tmp_path / "A.npy")


def test_dense_arrays_are_never_unpickled(tmp_path):
    np.save(tmp_path / "A.npy", np.array([[None]]), allow_pickle=True)
    with pytest.raises(MatrixFileError, match="Object arrays"):
        read_matrix(tmp_path / "A.npy")


def test_matlab_73():
    same(read_matrix(matlab_73(A=TRUE.matrix, x=np.ones((3, 1)))))
    two = matlab_73(A=TRUE.matrix, B=2 * TRUE.matrix)
    same(read_matrix(two, variable="A"))
    with pytest.raises(MatrixFileError, match="several sparse variables"):
        read_matrix(io.BytesIO(two.getvalue()))
    with pytest.raises(MatrixFileError, match="no sparse variable"):
        read_matrix(matlab_73(x=np.ones((3, 3))))


def test_matlab_73_of_suitesparse():
    """Explicit zeros are kept in Problem.Zeros."""
    stream = matlab_73(**{"Problem/A": TRUE.matrix, "Problem/Zeros": sp.eye_array(TRUE.matrix.shape[0], k=7)})
    A = read_matrix(stream)
    same(A)
    assert A.nnz > sp.csr_array(TRUE.matrix).nnz


def test_matlab_73_that_is_damaged():
    content = matlab_73(A=TRUE.matrix).getvalue()
    with pytest.raises(MatrixFileError):
        read_matrix(io.BytesIO(content[: len(content) // 2]))
    with pytest.raises(MatrixFileError):
        read_matrix(io.BytesIO(content[:600].ljust(1000, b"\0")))


def test_matlab_73_complex_without_imaginary_parts():
    matrix = check_matrix(read_matrix(matlab_73(A=TRUE.matrix.astype(complex))))
    np.testing.assert_allclose(matrix.csr().toarray(), TRUE.matrix.toarray(), atol=1e-15)


def lines(A, first, separator):
    coo = sp.coo_array(A)
    return "\n".join(
        separator.join((str(i + first), str(j + first), f"{value:.17e}"))
        for i, j, value in zip(*coo.coords, coo.data, strict=True)
    )


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("separator", [" ", "\t", ", ", "  ", ";"])
@pytest.mark.parametrize("half", [False, True])
def test_lines_of_row_column_and_entry(tmp_path, first, separator, half):
    A = sp.tril(TRUE.matrix) if half else TRUE.matrix
    (tmp_path / "A.txt").write_text("% row, column, entry\n" + lines(A, first, separator) + "\n")
    same(read_matrix(tmp_path / "A.txt"))


def test_whole_numbers_may_be_written_as_floats(tmp_path):
    """As MATLAB's save with -ascii writes them, and numpy.savetxt; 20 is 2.0e+01, in the first line too."""
    coo = sp.coo_array(TRUE.matrix)
    order = np.argsort(coo.col < 19, kind="stable")
    table = np.column_stack([coo.row + 1, coo.col + 1, coo.data])[order]
    assert table[0, 1] >= 20
    np.savetxt(tmp_path / "A.txt", table)
    same(read_matrix(tmp_path / "A.txt"))


@pytest.mark.parametrize(
    "text", ["1 1 2.0\n1 2\n", "1 1 2.0\n1 two 3\n", "1 1 2.0\n1.5 2 3\n", "1 1 2.0 5\n", "1 1 2.0\n-1 2 3\n"]
)
def test_lines_of_another_form(tmp_path, text):
    (tmp_path / "A.txt").write_text(text)
    with pytest.raises(MatrixFileError, match=r"A\.txt"):
        read_matrix(tmp_path / "A.txt")
