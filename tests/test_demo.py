"""The demonstration's picture of the true mesh beside the recovered one."""

import numpy as np
import pytest

from handmade import lake, two_pieces
from unassemble.plot import style
from unassemble_demo.comparison import aligned, largest_error, plot_comparison


@pytest.mark.parametrize("mirror", [1, -1])
def test_comparison_finds_the_similarity(mirror, tmp_path):
    recovery = lake()
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    truth = 3 * recovery.points * [1, mirror] @ turn + [10, -4]
    np.testing.assert_allclose(aligned(recovery.points, truth, recovery.component), truth, atol=1e-13)
    truth[7, 0] += 0.01
    figure = plot_comparison(truth, recovery, tmp_path / "both.png")
    error = largest_error(aligned(recovery.points, truth, recovery.component), truth)
    assert f"largest error {error:.1e} of the diameter" in figure.get_suptitle()
    assert [ax.get_title() for ax in figure.axes] == ["true", "recovered"]
    for ax in figure.axes:
        assert {style.OUTER, style.HOLE} <= {colour for line in ax.collections for colour in _colours(line)}
    assert 0.9 * 0.01 < error * np.linalg.norm(np.ptp(truth, axis=0)) < 1.1 * 0.01
    assert (tmp_path / "both.png").stat().st_size > 1000


def _colours(lines):
    from matplotlib.colors import to_hex

    return {to_hex(colour) for colour in lines.get_edgecolor()}


def test_comparison_moves_each_piece_by_itself():
    recovery = two_pieces()
    truth = recovery.points.copy()
    truth[recovery.component == 1] = truth[recovery.component == 1] @ [[0, 2], [-2, 0]] + 5
    assert largest_error(aligned(recovery.points, truth, recovery.component), truth) < 1e-14
