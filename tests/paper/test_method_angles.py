"""``--method angles`` and ``unassemble paper``: the same input, output and certificate."""

import numpy as np
import pytest
import scipy.sparse as sp
from click.testing import CliRunner

import unassemble_paper as experiments
from unassemble import recover
from unassemble.cli import main
from unassemble.errors import InputError
from unassemble.paper.alignment import distance
from unassemble.planar.conformal import conformal_map
from unassemble_paper.claims import Claim


def matrix_of(case, scale):
    """A = c L + D with zeros stored, in the piece's own order."""
    (i, j), n = case.piece.edges.T, case.piece.n_vertices
    rows, columns, entries = np.r_[i, j, np.arange(n)], np.r_[j, i, np.arange(n)], np.r_[case.weights, case.weights]
    diagonal = np.random.default_rng(0).standard_normal(n)
    return sp.coo_array((np.r_[-scale * entries, diagonal], (rows, columns)), shape=(n, n)).tocsr()


@pytest.mark.parametrize("scale", [1.0, -4.2])
def test_the_same_certificate(paper_case, scale):
    matrix = matrix_of(paper_case, scale)
    found, other = recover(matrix, method="angles"), recover(matrix)
    assert found.certified
    assert found.backward_error < 1e-12
    assert found.scale == pytest.approx([scale])
    assert "angles" in found.timings
    # All three meshes are symmetric, and have several frames.
    assert distance(found.points @ np.array([1, 1j]), other.points @ np.array([1, 1j])) < 1e-11


def test_without_the_polish_it_is_as_good_as_its_residual(paper_case):
    found = recover(matrix_of(paper_case, 2.0), method="angles", refine=False)
    assert 1e-14 < found.backward_error < 1e-8


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
        return experiments.Regenerated((claim,), (), (tmp_path / "figure07.png",))

    monkeypatch.setattr(experiments, "regenerate", regenerate)
    result = CliRunner().invoke(main, ["paper", "-o", str(tmp_path / "figures")])
    assert result.exit_code == 0, result.output
    assert asked == [(str(tmp_path / "figures"), conformal_map)]
    assert "| 4 | four steps | 4 steps | holds | why |" in result.output
    assert "figure07.png" in result.output
