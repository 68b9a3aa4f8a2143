"""Small hostile inputs: no traceback, no answer that takes long, and never a wrong certificate.

Run ``python benchmarks/hostile.py --minutes 60``, or ``--count 1000``; ``--seed 1`` makes others, ``--jobs 2`` runs as
many side by side, ``--kinds tree mesh`` chooses. Input k of a seed is always the same one, and ``--seed 0 --first k
--count 1`` makes it again. Exit status 1 after a wrong certificate or a crash; each of them is printed with its k, and
so is every answer that takes more than ten seconds of processor time.

What a certificate says is held against the mesh where one is known, each edge-connected piece up to similarity, and
the operator is assembled again by scikit-fem. Where the matrix is given back by another mesh than its own, the answer
counts as ambiguous, unless its uniqueness is said to be proved, which is wrong then; so does a grid of equal cells in
place of another mesh, where its uniqueness is said to be conventional.
"""

from __future__ import annotations

import argparse
import faulthandler
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from itertools import count, islice, repeat
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
import skfem
from click.testing import CliRunner
from hostile_inputs import KINDS, Given, Piece, pieces_of
from numpy.typing import NDArray
from skfem.models import laplace, mass

from unassemble import ConformingMesh, InputError, PlanarMesh, RecoveryError, Surface, recover
from unassemble.cli import main as command_line
from unassemble.matrix import read_matrix

SECONDS = 10.0  # of processor time that any answer may take
HANGS = 60.0  # seconds after which a traceback is printed, and the answer waited for all the same
MISFIT, DISTANCE = 1e-8, 1e-6  # of entries, relative to their rows; of points, relative to the diameter of a piece
ELEMENTS = {
    "triangle": (skfem.MeshTri, skfem.ElementTriP1, 3),
    "triangle6": (skfem.MeshTri, skfem.ElementTriP2, 3),
    "triangle10": (skfem.MeshTri, skfem.ElementTriP3, 3),
    "quad": (skfem.MeshQuad, skfem.ElementQuad1, 4),
    "quad8": (skfem.MeshQuad, skfem.ElementQuadS2, 4),
    "quad9": (skfem.MeshQuad, skfem.ElementQuad2, 4),
}
OUTCOMES = ("right", "ambiguous", "uncertified", "refused", "SLOW", "WRONG", "CRASH")


def positions_agree(found, pieces: list[Piece]) -> bool:
    """Whether the determined points of every piece are right, up to similarity, in every component found.

    Where a component has nothing of a piece but what other pieces share, it is theirs.
    """
    node = np.arange(found.n_points) if found.node_of_row is None else found.node_of_row
    times = np.bincount(np.concatenate([rows for rows, _ in pieces]), minlength=len(node))
    for rows, points in pieces:
        known = rows[found.node_status[node[rows]] == 0]
        place = dict(zip(rows.tolist(), points, strict=True))
        for label in np.unique(found.component[node[known]]):
            own = known[found.component[node[known]] == label]
            if (times[own] > 1).all():
                continue
            x, y = found.points[node[own]], np.array([place[row] for row in own.tolist()])
            if x.shape[1] != y.shape[1] or misplaced(x - x.mean(axis=0), y - y.mean(axis=0)) > DISTANCE:
                return False
    return True


def misplaced(x: NDArray, y: NDArray) -> float:
    """Largest distance after the best rotation, reflection and scaling of centred points, relative to their extent."""
    u, s, v = np.linalg.svd(x.T @ y)
    fit = x @ (u @ v) * (s.sum() / max((x * x).sum(), 1e-300))
    return float(np.linalg.norm(fit - y, axis=1).max() / max(np.linalg.norm(np.ptp(y, axis=0)), 1e-300))


def gives_back(found, matrix: Any, misfit: float = MISFIT) -> bool:
    """Whether elements on the cells, one factor in each piece or region, give the entries of determined rows."""
    linear = not isinstance(found, ConformingMesh)
    cells = {"triangle": found.divided()[0]} if linear else found.cells
    if not any(map(len, cells.values())) or not all(np.isfinite(found.points[some]).all() for some in cells.values()):
        return False
    given = sp.csr_array(matrix, dtype=np.float64)
    off = given / max(np.abs(given).max(), 1e-300)
    off = sp.csr_array(off - sp.diags_array(off.diagonal()))
    total = sp.csr_array(off.shape)
    parts = pieces_of_linear(found, cells["triangle"]) if linear else pieces_of_elements(found, cells)
    for k, part in enumerate(parts):
        part = sp.csr_array(part - sp.diags_array(part.diagonal()))
        shared = found.region is not None  # entries of two regions have a part of each
        total = total + part * (found.scale[k] / max(np.abs(given).max(), 1e-300) if shared else ratio(part, off))
    size = np.maximum(np.abs(given).max(axis=1).toarray().ravel(), 1e-300)
    lost = (np.abs(given.sum(axis=1)) > MISFIT * size) & (getattr(found, "n_entries", 1) == 0)  # else all are claimed
    return agree(off, total, found.node_status == 0, cells, lost, misfit)


def ratio(part: sp.csr_array, off: sp.csr_array) -> float:
    """What most of the larger entries of a piece have to be multiplied by."""
    row, column = part.nonzero()
    own = part[row, column]
    large = np.abs(own) >= np.median(np.abs(own))
    return float(np.median(off[row, column][large] / own[large]))


def agree(
    off: sp.csr_array,
    total: sp.csr_array,
    known: NDArray[np.bool_],
    cells: dict[str, NDArray],
    lost: NDArray[np.bool_],
    misfit: float = MISFIT,
) -> bool:
    """Whether entries between rows that are claimed are the same, relative to their rows.

    Cells may be gone next to rows in `lost` and to rows with a neighbour without a position: between two of them
    nothing is claimed but of pairs that two cells share.
    """
    largest = np.maximum(np.abs(off).max(axis=1).toarray().ravel(), 1e-300)
    difference = sp.coo_array(off - total)
    row, column = difference.coords
    wrong = np.abs(difference.data) > misfit * np.minimum(largest[row], largest[column])
    lost = lost | ((off != 0) @ (~known).astype(int) > 0)
    shared = cells_of_pairs(cells, off.shape)
    if any(some.shape[1] > 4 for some in cells.values()):  # nodes on sides need not be coupled to those that are gone
        bare = (off != 0).astype(int) - ((off != 0).multiply(shared > 0)).astype(int)
        lost = lost | (bare @ lost.astype(int) > 0)
    lost = lost[row] & lost[column] & (shared[row, column] < 2)
    return not (wrong & known[row] & known[column] & ~lost).any()


def cells_of_pairs(cells: dict[str, NDArray], shape: tuple[int, int]) -> sp.csr_array:
    """How many cells two rows share."""
    pairs = [some[:, [a, b]] for some in cells.values() for a in range(some.shape[1]) for b in range(some.shape[1])]
    ends = np.concatenate(pairs)
    return sp.coo_array((np.ones(len(ends)), ends.T), shape=shape).tocsr()


def lengths_give_back(found: Surface, matrix: sp.csr_array, misfit: float = MISFIT) -> bool:
    """Whether triangles with these sides, each laid flat by itself, give the entries of claimed rows."""
    length = sp.coo_array((found.edge_lengths, found.edges.T), shape=matrix.shape).tocsr()
    length = length + length.T
    a, b, c = (length[found.triangles[:, (k + 1) % 3], found.triangles[:, (k + 2) % 3]] for k in range(3))
    x = (b * b + c * c - a * a) / (2 * c)
    corners = np.stack([0 * c, 0 * c, c, 0 * c, x, np.sqrt(np.maximum(b * b - x * x, 0))], axis=1)
    flat = skfem.MeshTri(corners.reshape(-1, 2).T.copy(), np.arange(3 * len(c)).reshape(-1, 3).T.copy())
    part = sp.coo_array(laplace.assemble(skfem.Basis(flat, skfem.ElementTriP1())))
    rows = found.triangles.ravel()
    factor = np.repeat(found.scale[found.component[found.triangles].max(axis=1)], 3)[part.row]
    total = sp.coo_array((part.data * factor, (rows[part.row], rows[part.col])), shape=matrix.shape).tocsr()
    off, total = (sp.csr_array(one - sp.diags_array(one.diagonal())) for one in (matrix, total))
    nothing = np.zeros(len(off.indptr) - 1, dtype=bool)
    return agree(off, total, found.node_status == 0, {"triangle": found.triangles}, nothing, misfit)


def pieces_of_linear(found, triangles: NDArray) -> Iterator[sp.csr_array]:
    """The matrix of each piece, or of each region, of a mesh of linear triangles."""
    label = pieces_of(triangles) if found.region is None else found.region
    for k in range(label.max() + 1):
        yield assembled_on("triangle", triangles[label == k], found, laplace)


def pieces_of_elements(found, cells: dict[str, NDArray], form=laplace) -> Iterator[sp.csr_array]:
    """The matrix of each piece of a mesh of other, straight elements; a hinge has the lowest label of its pieces."""
    for k in range(found.n_components):
        total = sp.csr_array((found.n_points, found.n_points))
        for name, some in cells.items():
            own = some[found.component[some].max(axis=1) == k]
            if len(own):
                total = total + assembled_on(name, own, found, form)
        yield total


def assembled_on(name: str, cells: NDArray, found, form) -> sp.csr_array:
    """The matrix of a form on straight elements, whose nodes are told cell by cell: in slits two lie in one place."""
    kind, element, corners = ELEMENTS[name]
    vertices, local = np.unique(cells[:, :corners], return_inverse=True)
    mesh = kind(found.points[vertices].T.copy(), local.reshape(-1, corners).T.copy())
    basis = skfem.Basis(mesh, element())
    off = basis.doflocs[:, basis.element_dofs].transpose(2, 1, 0)[:, :, None] - found.points[cells][:, None]
    place = np.empty(basis.N, dtype=np.int64)
    place[basis.element_dofs.T] = np.take_along_axis(cells, np.linalg.norm(off, axis=3).argmin(axis=2), axis=1)
    part = sp.coo_array(form.assemble(basis))
    return sp.coo_array((part.data, (place[part.row], place[part.col])), shape=2 * (found.n_points,)).tocsr()


def areas_give_back(found, matrix: sp.csr_array) -> bool:
    """Whether triangles of these areas add up to a mass matrix, off the diagonal."""
    i, j = np.concatenate([found.triangles[:, [a, b]] for a in range(3) for b in range(3) if a != b]).T
    total = sp.csr_array((np.tile(found.areas / 12, 6), (i, j)), shape=matrix.shape)
    difference = abs(matrix - sp.diags_array(matrix.diagonal()) - total)
    return bool(difference.max() <= MISFIT * abs(matrix).max())


def masses(found) -> sp.csr_array:
    """The mass matrix, from scikit-fem; other elements are straight."""
    if found.element != "P1":
        return sum(pieces_of_elements(found, found.cells, mass))
    return assembled_on("triangle", found.divided()[0], found, mass)


def judged(given: Given) -> str:
    """What comes of one input."""
    if given.name:
        return judged_file(given)
    try:
        found = recover(given.matrix)
    except (RecoveryError, InputError):
        return "refused"
    found.report()
    if found.status != "certified":
        return "ambiguous" if found.status == "ambiguous" else "uncertified"
    if isinstance(found, Surface):
        return "right" if lengths_give_back(found, sp.csr_array(given.matrix, dtype=np.float64)) else "WRONG"
    right = given.pieces is not None and positions_agree(found, given.pieces)
    if not isinstance(found, PlanarMesh):  # bodies and structures
        return "right" if right else "WRONG"
    matrix = sp.csr_array(given.matrix)
    if found.areas is not None:
        return "right" if areas_give_back(found, matrix) else "WRONG"
    if len(found.eliminated_points):  # the triangles beyond are not in the answer, so that nothing can be assembled
        return "right" if right else "ambiguous" if found.uniqueness == "conventional" else "WRONG"
    if found.row_scaling is not None:
        back = sp.diags_array(1 / found.row_scaling)
        matrix = sp.csr_array(back @ matrix @ back)
    if (found.node_status == 2).any():  # plausible points are not claimed, and entries beside them are not whole
        return "right" if right or given.pieces is None else "WRONG"
    if found.reaction and not gives_back(found, matrix):  # else it is lumped
        matrix = sp.csr_array(matrix - found.reaction * masses(found))
    if not gives_back(found, matrix):
        return "WRONG"
    if right or given.pieces is None or not given.intact:
        return "right"
    return "ambiguous" if found.uniqueness == "searched" else "WRONG"


def judged_file(given: Given) -> str:
    """What comes of a file: its matrix as any other, and the same exit status from the command line."""
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / given.name, Path(folder) / "out.npz"
        path.write_bytes(given.matrix)
        try:
            outcome = judged(replace(given, matrix=read_matrix(path), name=""))
        except (RecoveryError, InputError):
            outcome = "refused"
        ran = CliRunner().invoke(command_line, ["recover", str(path), "-o", str(out), "--quiet"])
        expected = {"right": (0,), "refused": (2, 4)}.get(outcome, (0, 3))
        if ran.exit_code not in expected or "Traceback" in ran.output or out.exists() != (ran.exit_code in (0, 3)):
            raise RuntimeError(f"{outcome}, and exit status {ran.exit_code}: {ran.output}") from ran.exception
        return outcome


def tried(seed: int, k: int, kinds: tuple[str, ...] = tuple(KINDS)) -> tuple[int, str, str, float, str]:
    """Input k of a seed: its number, kind, outcome, seconds of processor time, and what there is to say."""
    rng = np.random.default_rng([seed, k])
    kind = str(rng.choice(kinds))
    given, said, start = KINDS[kind](rng), "", time.process_time()
    faulthandler.dump_traceback_later(HANGS, exit=False)  # only says where it hangs
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            outcome = judged(given)
    except Exception:
        outcome, said = "CRASH", traceback.format_exc()
    finally:
        faulthandler.cancel_dump_traceback_later()
    seconds = time.process_time() - start
    slow = seconds > SECONDS and outcome not in ("WRONG", "CRASH")
    return k, kind, "SLOW" if slow else outcome, seconds, said


def main() -> int:
    parser = argparse.ArgumentParser(description="Throw small hostile inputs at unassemble.")
    parser.add_argument("--minutes", type=float, default=float("inf"))
    parser.add_argument("--count", type=int, help="how many inputs; 1000 where no minutes are given")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    chosen = parser.parse_args()
    number = chosen.count if chosen.count or chosen.minutes < float("inf") else 1000
    end = time.monotonic() + 60 * chosen.minutes
    inputs = islice(count(chosen.first), number)
    table: Counter[tuple[str, str]] = Counter()
    with ProcessPoolExecutor(chosen.jobs) as pool:
        while time.monotonic() < end and (some := list(islice(inputs, 4 * chosen.jobs))):
            kinds = tuple(chosen.kinds)
            for k, kind, outcome, seconds, said in pool.map(tried, repeat(chosen.seed), some, repeat(kinds)):
                table[kind, outcome] += 1
                if outcome in ("SLOW", "WRONG", "CRASH"):
                    print(f"{outcome}: {kind}, --seed {chosen.seed} --first {k}, {seconds:.1f} s\n{said}", flush=True)
    print("".join(f"{word:>12}" for word in ("", *OUTCOMES)))
    for kind in chosen.kinds:
        print(f"{kind:>12}" + "".join(f"{table[kind, outcome]:12}" for outcome in OUTCOMES))
    return int(any(table[kind, outcome] for kind in chosen.kinds for outcome in ("WRONG", "CRASH")))


if __name__ == "__main__":
    raise SystemExit(main())
