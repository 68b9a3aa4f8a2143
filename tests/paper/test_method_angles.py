"""``--method angles`` and ``unassemble paper``: the same input, output and certificate."""

import functools

import numpy as np
import pytest
import scipy.sparse as sp
from click.testing import CliRunner

import unassemble_paper as experiments
from unassemble import paper, recover
from unassemble.cli import main
from unassemble.errors import InputError
from unassemble.paper import AngleOptions, NewtonOptions, distance
from unassemble.planar import conformal_map
from unassemble_paper.claim import Claim, claims_table


def matrix_of(case, scale):
    """A = c L + D with zeros stored, in the piece's own order."""
    (i, j), n = case.piece.edges.T, case.piece.n_vertices
    rows, columns, entries = np.r_[i, j, np.arange(n)], np.r_[j, i, np.arange(n)], np.r_[case.weights, case.weights]
    diagonal = np.random.default_rng(0).standard_normal(n)
    return sp.coo_array((np.r_[-scale * entries, diagonal], (rows, columns)), shape=(n, n)).tocsr()


@pytest.mark.parametrize("scale", [1.0, -4.2])
def test_the_same_certificate_by_its_own_means(paper_case, scale):
    """The angles' mesh is held against the matrix as it is: without a polish it keeps what their residual leaves."""
    matrix = matrix_of(paper_case, scale)
    found, other = recover(matrix, method="angles"), recover(matrix)
    assert found.certified
    assert 1e-14 < found.backward_error < 1e-9
    assert found.scale == pytest.approx([scale])
    assert "angles" in found.timings
    assert "polish" not in found.timings
    # All three meshes are symmetric, and have several frames.
    assert distance(found.points @ np.array([1, 1j]), other.points @ np.array([1, 1j])) < 1e-9


def test_no_polish_earns_the_certificate(paper_case, monkeypatch):
    """Angles of few digits are not certified, though a polish from there would find the mesh."""
    few = AngleOptions(newton=NewtonOptions(tolerance=1e-4))
    monkeypatch.setattr(paper, "recover_angles", functools.partial(paper.recover_angles, options=few))
    found = recover(matrix_of(paper_case, 2.0), method="angles")
    assert found.status == "uncertified"
    assert found.backward_error > 1e-7


def test_unknown_methods():
    with pytest.raises(InputError, match="angles"):
        recover(sp.eye_array(3).tocsr(), method="sides")


def test_from_the_command_line(paper_case, tmp_path):
    sp.save_npz(tmp_path / "matrix.npz", matrix_of(paper_case, 3.0).tocsr())
    arguments = ["recover", str(tmp_path / "matrix.npz"), "-o", str(tmp_path / "mesh.npz"), "--method", "angles"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.output
    assert np.load(tmp_path / "mesh.npz")["scale"] == pytest.approx([3.0])


def test_the_paper_command(tmp_path, monkeypatch):
    """What it is given and what it prints; the figures themselves are tested with the experiments."""
    claim = Claim("grid", "4", "four steps", "4 steps", "holds", "why", (4.0,))
    asked = []

    def regenerate(folder, direct):
        asked.append((folder, direct))
        return experiments.Regenerated((claim,), (), (claims_table([claim]),), (tmp_path / "figure07.png",))

    monkeypatch.setattr(experiments, "regenerate", regenerate)
    result = CliRunner().invoke(main, ["paper", "-o", str(tmp_path / "figures")])
    assert result.exit_code == 0, result.output
    assert asked == [(str(tmp_path / "figures"), conformal_map)]
    assert "| 4 | four steps | 4 steps | holds | why |" in result.output
    assert "figure07.png" in result.output
