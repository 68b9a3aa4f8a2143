"""A few of the inputs of ``benchmarks/hostile.py``, always the same."""

import time
import warnings
from contextlib import suppress
from functools import partial

import hostile
import networkx as nx
import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from hostile import KINDS, SECONDS, tried
from skfem.models import laplace, mass

from families import HOPELESS
from meshes import random_mesh
from unassemble import MatrixError, RecoveryError, SolverError, TopologyError, recover
from unassemble.linalg import UpperTriangle, factorisation


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("damaged", "glued", "hopeless")])
def test_no_traceback_and_no_wrong_certificate(kind):
    for k in range(7):
        _, _, outcome, _, said = tried(0, k, (kind,))
        assert outcome not in ("WRONG", "CRASH", "SLOW"), f"--kinds {kind} --first {k}\n{said}"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["damaged", "glued", "hopeless"])
def test_the_same_of_what_takes_longer(kind):
    _, _, outcome, _, said = tried(0, 0, (kind,))
    assert outcome not in ("WRONG", "CRASH", "SLOW"), f"--kinds {kind} --first 0\n{said}"


@pytest.mark.parametrize(
    "found", [(601, 1363), (601, 1385), (602, 151), (5001, 4876), (6001, 1687), (9001, 1650), (9001, 18772)]
)
def test_what_went_wrong_before(found):
    """Entries that nothing checks; cells held together by an assumption, of 1e-200 the others, flat; no area."""
    _, _, outcome, _, said = tried(*found)
    assert outcome not in ("WRONG", "CRASH", "SLOW"), said


@pytest.mark.parametrize("k", [714, 5321, 6291])
def test_the_judge_lets_right_answers_pass(k):
    """A slit; signs changed along a boundary; a quadrilateral that is gone, with a zero for its diagonal."""
    assert tried(5001, k)[2] == "right"


def test_nor_where_no_elements_are_asked_for(monkeypatch):
    monkeypatch.setattr(hostile, "recover", partial(recover, cells=False))
    assert tried(601, 1363)[2] == "uncertified"


def test_rows_that_vanish_beside_others_are_refused():
    """PARDISO ends in a segmentation fault on many of them."""
    part = sp.block_diag([np.array([[1.0, 1], [1, 2]])] * 150 + [np.array([[1e-203]])])  # small ones are dense
    upper = UpperTriangle.of(sp.csr_array(part))
    with pytest.raises(SolverError, match=r"vanishes|zero|singular"):
        factorisation(upper).factorise(upper)


def _mass_matrix():
    points, triangles = random_mesh(500, 0, holes=False)
    mesh = skfem.MeshTri(np.ascontiguousarray(points.T), np.ascontiguousarray(triangles.T))
    return mass.assemble(skfem.Basis(mesh, skfem.ElementTriP1()))


def _quadrilaterals():
    mesh = skfem.MeshQuad.init_tensor(*[np.linspace(0, 1, 31)] * 2)
    return laplace.assemble(skfem.Basis(mesh, skfem.ElementQuad1()))


SMALL = {
    "grid": lambda: nx.laplacian_matrix(nx.grid_2d_graph(12, 12)),
    "large grid": lambda: nx.laplacian_matrix(nx.grid_2d_graph(32, 31)),
    "many components": lambda: nx.laplacian_matrix(nx.random_geometric_graph(1000, 0.03, seed=1)),
    "triangular lattice": lambda: nx.laplacian_matrix(nx.triangular_lattice_graph(20, 40)),
    "mass": _mass_matrix,
    "quadrilaterals": _quadrilaterals,
    "planar graph": lambda: HOPELESS["planar_graph"](200, 0),
    "tree": lambda: HOPELESS["tree"](1000, 0),
}


@pytest.mark.parametrize("name", SMALL)
def test_small_matrices_of_no_mesh_are_answered_soon(name):
    matrix = sp.csr_array(SMALL[name](), dtype=float)
    order = np.random.default_rng(0).permutation(matrix.shape[0])
    start = time.process_time()
    with suppress(RecoveryError):
        assert recover(matrix[order][:, order]).certified == (name in ("mass", "quadrilaterals"))  # as what they are
    assert time.process_time() - start < SECONDS


@pytest.mark.parametrize("element", [skfem.ElementTriP2(), skfem.ElementQuad1()], ids=["P2", "Q1"])
def test_a_thousand_rows_with_changed_entries_are_answered_soon(element):
    mesh = skfem.MeshTri().refined(4) if isinstance(element, skfem.ElementTriP2) else skfem.MeshQuad().refined(5)
    rng = np.random.default_rng(0)
    inner = np.setdiff1d(np.arange(mesh.p.shape[1]), mesh.boundary_nodes())
    points = mesh.p.copy()
    points[:, inner] += rng.uniform(-0.005, 0.005, (2, len(inner)))
    matrix = laplace.assemble(skfem.Basis(type(mesh)(points, mesh.t), element)).tolil()
    row, column = matrix.nonzero()
    for k in rng.choice(np.flatnonzero(row < column), 20, replace=False):
        matrix[row[k], column[k]] = matrix[column[k], row[k]] = 1.3 * matrix[row[k], column[k]]
    order = rng.permutation(matrix.shape[0])
    start = time.process_time()
    with suppress(RecoveryError):
        assert not recover(sp.csr_array(matrix)[order][:, order]).certified
    assert time.process_time() - start < SECONDS


def test_connected_rows_out_of_all_proportion_are_refused():
    """Quotients of their entries would overflow."""
    entries = sp.diags_array([[-1.0, -1e40, -1e40]] * 2, offsets=[-1, 1], shape=(4, 4))
    with pytest.raises(RecoveryError, match=r"rows 1 and 0 .* 1e\+40 and 1"):
        recover(entries)


def _random(n, share, seed=0):
    rng = np.random.default_rng(seed)
    half = rng.standard_normal((n, n)) * (rng.random((n, n)) < share)
    return sp.csr_array(half + half.T)


def test_dense_matrices_are_refused_at_once():
    start = time.process_time()
    with pytest.raises(MatrixError, match="dense: a row has 999"):
        recover(_random(1000, 1.0))
    assert time.process_time() - start < 1


@pytest.mark.slow
@pytest.mark.parametrize(("n", "share"), [(370, 1.0), (1000, 0.15), (1000, 0.005)])
def test_random_matrices_of_many_entries_are_refused_soon(n, share):
    """As many entries as elements may have, and far more 3-cycles."""
    start = time.process_time()
    with pytest.raises(RecoveryError):
        recover(_random(n, share))
    assert time.process_time() - start < SECONDS


def test_a_surface_needs_few_handles():
    with pytest.raises(TopologyError, match="more handles than a sixth of its rows"):
        recover(_random(60, 0.5), operator="surface")


@pytest.mark.parametrize("size", [1e-250, 1e200])
def test_entries_whose_products_overflow_are_refused(size):
    chain = sp.diags_array([[1.0, -2.0, 3.0, -1.0]] * 2, offsets=[-1, 1], shape=(5, 5)) + 4 * sp.eye_array(5)
    with pytest.raises(MatrixError, match=r"too far from 1 .* multiply the matrix by a number"):
        recover(sp.csr_array(size * chain))
    with pytest.raises(MatrixError, match="too far from 1"):
        recover(sp.csr_array(chain + sp.diags_array([1e200, 0, 0, 0, 0])))


@pytest.mark.parametrize("size", [1e-60, 1.0, 1e60])
def test_products_of_large_entries_do_not_overflow(size):
    """Blocks of beams are told by products of entries."""
    chain = sp.diags_array([[1.0, -2.0, 3.0, -1.0]] * 2, offsets=[-1, 1], shape=(5, 5)) + 4 * sp.eye_array(5)
    with warnings.catch_warnings(), suppress(RecoveryError):
        warnings.simplefilter("error")
        assert not recover(sp.csr_array(size * chain)).certified


def test_changes_that_leave_no_map_are_passed_over():
    """Products of what is left of positions overflow."""
    kinds = ("mesh", "glued", "damaged", "scalar", "hopeless", "symmetric", "strange", "file")
    _, _, outcome, _, said = tried(101, 56, kinds)
    assert outcome == "refused", said
