"""Matrix Market: every symmetry, field and layout, and every way to get it wrong."""

from __future__ import annotations

import gzip
import io
import tracemalloc
from contextlib import suppress

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from hypothesis import given, strategies as st

from unassemble.errors import MatrixError, MatrixFileError, UnassembleError
from unassemble.matrix import read_matrix

REAL = "%%MatrixMarket matrix coordinate real general\n"


def read(text: str | bytes) -> sp.csr_array:
    return read_matrix(io.BytesIO(text.encode() if isinstance(text, str) else text))


def stored(A: sp.csr_array) -> dict[tuple[int, int], complex]:
    rows = np.repeat(np.arange(A.shape[0]), np.diff(A.indptr))
    return {(int(i), int(j)): v for i, j, v in zip(rows, A.indices, A.data, strict=True)}


def header(layout: str, field: str, symmetry: str) -> str:
    return f"%%MatrixMarket matrix {layout} {field} {symmetry}\n% made by hand\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (REAL + "2 3 2\n1 2 3.5\n2 3 -1e-3\n", {(0, 1): 3.5, (1, 2): -1e-3}),
        (header("coordinate", "real", "symmetric") + "2 2 2\n2 1 3\n1 1 4\n", {(0, 0): 4, (0, 1): 3, (1, 0): 3}),
        (header("coordinate", "real", "symmetric") + "2 2 2\n1 2 3\n1 1 4\n", {(0, 0): 4, (0, 1): 3, (1, 0): 3}),
        (header("coordinate", "real", "skew-symmetric") + "2 2 1\n2 1 3\n", {(0, 1): -3, (1, 0): 3}),
        (header("coordinate", "complex", "hermitian") + "2 2 1\n2 1 3 4\n", {(0, 1): 3 - 4j, (1, 0): 3 + 4j}),
        (header("coordinate", "complex", "general") + "2 2 1\n2 1 3 4\n", {(1, 0): 3 + 4j}),
        (header("coordinate", "real", "hermitian") + "2 2 1\n2 1 3\n", {(0, 1): 3, (1, 0): 3}),
        (header("coordinate", "integer", "general") + "2 2 1\n2 1 -7\n", {(1, 0): -7}),
        (header("coordinate", "unsigned-integer", "general") + "2 2 1\n2 1 7\n", {(1, 0): 7}),
        (header("coordinate", "double", "general") + "2 2 1\n2 1 7\n", {(1, 0): 7}),
        (REAL + "2 2 3\n1 2 3\n1 2 4\n1 2 -7\n", {(0, 1): 0}),
        (REAL + "2 2 2\n1 2 0\n2 1 -0.0\n", {(0, 1): 0, (1, 0): 0}),
        (REAL + "2 2 0\n", {}),
        (
            header("array", "real", "general") + "2 3\n1\n0\n3\n4\n5\n6\n",
            {(0, 0): 1, (0, 1): 3, (1, 1): 4, (0, 2): 5, (1, 2): 6},
        ),
        (header("array", "real", "symmetric") + "2 2\n1\n2\n0\n", {(0, 0): 1, (0, 1): 2, (1, 0): 2}),
        (
            header("array", "real", "symmetric") + "3 3\n1\n2\n3\n4\n5\n6\n",
            {(0, 0): 1, (1, 0): 2, (2, 0): 3, (1, 1): 4, (2, 1): 5, (2, 2): 6, (0, 1): 2, (0, 2): 3, (1, 2): 5},
        ),
        (
            header("array", "real", "skew-symmetric") + "3 3\n1\n2\n3\n",
            {(1, 0): 1, (2, 0): 2, (2, 1): 3, (0, 1): -1, (0, 2): -2, (1, 2): -3},
        ),
        (header("array", "complex", "hermitian") + "2 2\n1 0\n2 3\n0 0\n", {(0, 0): 1, (1, 0): 2 + 3j, (0, 1): 2 - 3j}),
    ],
)
def test_reads(text: str, expected: dict) -> None:
    A = read(text)
    assert stored(A) == expected
    assert A.has_canonical_format
    assert A.dtype == (np.complex128 if "complex" in text else np.float64)


@pytest.mark.parametrize(
    "body",
    [
        "2 2 2\r\n1 2 3\r\n2 1 4\r\n",
        "2 2 2\n\n1 2 3\n\n% in between\n2 1 4",
        "\n  2\t2 2\n  1  2\t3 \n\t2 1 4\n\n",
        "2 2 2\n1 2 3.0D+00\n2 1 .4d1\n",
        "2 2 2\n1 2 +3\n2 1 40E-1\n",
        "2 2 2\r1 2 3\r2 1 4\r",
    ],
)
def test_layout_of_lines_does_not_matter(body: str) -> None:
    assert stored(read(REAL + body)) == {(0, 1): 3, (1, 0): 4}


@pytest.mark.parametrize(
    "banner",
    [
        "%%matrixmarket MATRIX Coordinate Real GENERAL\n",
        "%%MatrixMarket\tmatrix  coordinate real general \n",
        "\ufeff" + REAL,
    ],
)
def test_banner_in_any_case_and_after_a_byte_order_mark(banner: str) -> None:
    assert stored(read(banner + "% Größe\n1 1 1\n1 1 2\n")) == {(0, 0): 2}


def test_values_are_read_to_the_last_bit() -> None:
    values = np.random.default_rng(0).normal(size=50) * 10.0 ** np.arange(-150, 150, 6)
    lines = "".join(f"1 {k + 1} {v!r}\n" for k, v in enumerate(values.tolist()))
    assert (read(f"{REAL}1 50 50\n{lines}").data == values).all()


def test_not_a_number_and_infinity_are_left_to_the_checks() -> None:
    A = read(REAL + "1 3 3\n1 1 nan\n1 2 inf\n1 3 -Infinity\n")
    assert np.isnan(A.data[0])
    assert A.data[1:].tolist() == [np.inf, -np.inf]


def test_more_than_one_block(refused) -> None:
    count = 60_000
    lines = [f"{k % 300 + 1} {k // 300 + 1} {k}" for k in range(count)]
    text = f"{REAL}300 300 {count}\n" + "\n".join(lines)
    assert read(text).sum() == count * (count - 1) // 2
    lines[54_321] = "1 1 x"
    broken = f"{REAL}300 300 {count}\n" + "\n".join(lines)
    refused(MatrixFileError, ("'1 1 x'", "line 54324"), read, broken)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (REAL, "truncated"),
        (REAL + "% only a comment\n\n", "truncated"),
        (REAL + "2 2 3\n1 2 3\n2 1 0\n", ("announces 3", "holds 2", "truncated")),
        (REAL + "2 2 3\n", ("announces 3", "holds 0")),
        (REAL + "2 2 2\n1 2 3\n2 ", ("'2'", "line 4")),
        (REAL + "2 2 1\n1 2 3\n2 1 0\n", ("announces 1", "more")),
        (REAL + "2 2 1\n3 1 1\n", ("row 3", "column 1", "2 rows", "from 1")),
        (REAL + "2 2 1\n0 1 1\n", ("row 0", "from 1")),
        (REAL + "2 2 2\n1 1 1\n1 -4 1\n", ("number 2", "column -4")),
        (REAL + "2 2 1\n1.5 1 1\n", "row 1.5"),
        (REAL + "2 2 1\nnan 1 1\n", "row nan"),
        (REAL + "2 2 1\n99999999999999999999 1 1\n", "row 1e+20"),
        (REAL + "2 2 1\n1 1 abc\n", ("'1 1 abc'", "line 3")),
        (REAL + "2 2 1\n1 x 1\n", "'1 x 1'"),
        (REAL + "2 2 1\n" + 9 * "\n" + "1 y 1\n\n\n", ("'1 y 1'", "line 12")),
        (REAL + "2 2 1\n1 1 3,5\n", "'1 1 3,5'"),
        (REAL + "2 2 1\n1 1 0x10\n", "0x10"),
        (REAL + "2 2 1\n1 1 3\0\n", r"\x00"),
        (REAL + "2 2 1\n1 1\n", "'1 1'"),
        (REAL + "2 2 2\n1 1 1\n2 2\n", ("'2 2'", "line 4")),
        (REAL + "2 2 2\n1 1 1\n2 2 1 5\n", ("'2 2 1 5'", "line 4")),
        (REAL + "2 2 1\n1 1 3 4\n", "'1 1 3 4'"),
        (REAL + "2 2 1\n1 1 3\n</html>\n", "</html>"),
        (REAL + "2 2\n1 1 3\n", ("'2 2'", "rows, columns and entries")),
        (REAL + "2 2 1 5\n1 1 3\n", "'2 2 1 5'"),
        (REAL + "-2 2 1\n1 1 3\n", "'-2 2 1'"),
        (REAL + "2.0 2 1\n1 1 3\n", "'2.0 2 1'"),
        (REAL + "1 1 1\n1 1 3\n".replace("1 1 1", "1" * 9000 + " 1 1"), "..."),
        (header("coordinate", "complex", "general") + "1 1 1\n1 1 3\n", "imaginary"),
        (header("array", "real", "general") + "2 2\n1\n2\n3\n", ("announces 4", "holds 3")),
        (header("array", "real", "general") + "2 2\n1\n2\n3\n4\n5\n", ("announces 4", "more")),
        (header("array", "real", "general") + "2 2\n1 2\n3 4\n", "'1 2'"),
        (header("array", "real", "general") + "2 2 4\n1\n2\n3\n4\n", "rows and columns"),
        (header("array", "real", "symmetric") + "2 3\n1\n2\n3\n", ("symmetric", "2 rows", "3 columns")),
        (header("coordinate", "real", "symmetric") + "2 3 1\n1 3 2\n", ("symmetric", "3 columns")),
        (header("coordinate", "real", "symmetric") + "3 3 3\n2 1 1\n3 2 5\n2 3 5\n", ("row 2, column 3", "general")),
        ("%%MatrixMarket matrix coordinate real\n1 1 1\n1 1 3\n", "first line"),
        ("%%MatrixMarket vector coordinate real general\n3 1\n1 1.5\n", "vector"),
        ("%%MatrixMarket matrix coordinate quaternion general\n1 1 1\n1 1 3\n", "quaternion"),
        ("%%MatrixMarket matrix coordinate real lopsided\n1 1 1\n1 1 3\n", "lopsided"),
        ("%%MatrixMarket", "first line"),
    ],
)
def test_wrong_files(text: str, words: tuple[str, ...] | str, refused) -> None:
    refused(MatrixFileError, words, read, text)


@pytest.mark.parametrize("layout", ["coordinate", "array"])
def test_pattern_has_no_numbers(layout: str, refused) -> None:
    text = header(layout, "pattern", "symmetric") + "2 2 1\n2 1\n"
    refused(MatrixError, ("pattern", "numbers"), read, text)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (REAL + "1000000000 1000000000 5\n" + "".join(f"{k} {k + 1} 1\n" for k in range(1, 6)), MatrixError),
        (REAL + f"{10**17} {10**17} 1\n{10**15} 7 1\n", MatrixError),
        (REAL + "2 2 1000000000000000\n1 1 1\n", MatrixFileError),
        (header("array", "real", "general") + "100000000 2000000\n1\n", MatrixFileError),
        (header("array", "real", "symmetric") + "1000000000 1000000000\n1\n", MatrixFileError),
    ],
)
def test_announced_sizes_are_not_allocated(text: str, error: type[Exception], refused) -> None:
    tracemalloc.start()
    try:
        refused(error, (), read, text)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


def test_rows_without_entries_are_counted(refused) -> None:
    text = REAL + "1000000000 1000000000 2\n1 2 1\n2 1 1\n"
    refused(MatrixError, ("999999998", "1000000000 rows"), read, text)


@pytest.mark.parametrize("symmetry", ["general", "symmetric", "skew-symmetric", "hermitian"])
@pytest.mark.parametrize("dense", [False, True])
@pytest.mark.parametrize("packed", [False, True])
def test_what_scipy_writes(symmetry: str, dense: bool, packed: bool) -> None:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(5, 5)) + 1j * rng.normal(size=(5, 5)) * (symmetry == "hermitian")
    A = {"skew-symmetric": A - A.T, "symmetric": A + A.T, "hermitian": A + A.conj().T}.get(symmetry, A)
    A = A if symmetry == "hermitian" else A.real
    A[0, 3] = A[3, 0] = 0
    content = io.BytesIO()
    scipy.io.mmwrite(content, A if dense else sp.coo_array(A), symmetry=symmetry, precision=17)
    text = content.getvalue()
    B = read(gzip.compress(text) if packed else text)
    assert (B.toarray() == A).all()
    assert B.nnz == np.count_nonzero(A)


ENTRIES = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4), st.integers(-8, 8)), max_size=25)


@given(ENTRIES, st.sampled_from(["general", "symmetric"]))
def test_round_trip_keeps_zeros_and_sums(entries: list[tuple[int, int, int]], symmetry: str) -> None:
    if symmetry == "symmetric":
        entries = [(max(i, j), min(i, j), v) for i, j, v in entries]
    text = header("coordinate", "real", symmetry) + f"5 5 {len(entries)}\n"
    A = read(text + "".join(f"{i + 1} {j + 1} {v / 2}\n" for i, j, v in entries))
    expected: dict[tuple[int, int], float] = {}
    for i, j, v in entries:
        for place in {(i, j), (j, i)} if symmetry == "symmetric" else {(i, j)}:
            expected[place] = expected.get(place, 0.0) + v / 2
    assert stored(A) == expected


@given(st.binary(max_size=200))
def test_any_body_is_read_or_refused(body: bytes) -> None:
    with suppress(UnassembleError):
        read(REAL.encode() + b"3 3 2\n" + body)


@given(st.text(alphabet="0123456789 .-+eEdDnaif%\n\t", max_size=80))
def test_any_numbers_are_read_or_refused(body: str) -> None:
    with suppress(UnassembleError):
        read(REAL + body)
