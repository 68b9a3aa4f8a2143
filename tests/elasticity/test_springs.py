"""Springs between nodes: a node that belongs to no element has no position, and those of the body keep theirs."""

import numpy as np
import pytest
import scipy.sparse as sp
from assembled import Assembled, box, error, on_plane, permuted_nodes, recover_elasticity, stiffness
from supported import Given, judged

from unassemble import recover
from unassemble.errors import RecoveryError
from unassemble.recovery import Body

KINDS = {"tri-p1": (6, 7), "quad-q1": (6, 5), "tri-p2": (5, 4), "tet-p1": (4, 5, 4), "hex-q1": (4, 4, 3)}


def spring(length: np.ndarray, kind: str, rng: np.random.Generator) -> np.ndarray:
    """The block of a spring that acts along its length, in all directions alike, or along one axis."""
    d = len(length)
    axis = length / np.linalg.norm(length)
    blocks = {"axial": np.outer(axis, axis), "scalar": np.eye(d), "one axis": np.diag(np.arange(d) == 0)}
    return rng.uniform(0.1, 2.0) * blocks[kind]


def with_springs(case: Assembled, pairs, kind: str, rng: np.random.Generator, grounded=()) -> Assembled:
    """A body and four nodes more around it; pairs of nodes joined by springs, and nodes held by one."""
    d, n = case.dim, len(case.points)
    points = np.vstack([case.points, rng.uniform(-1, 2, (4, d))])
    total = np.zeros((len(points), d) * 2)
    for i, j in pairs:
        block = spring(points[i] - points[j], kind, rng)
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            total[a, :, b] += sign * block
    for i in grounded:
        total[i, :, i] += rng.uniform(0.1, 2.0) * np.eye(d)
    body = sp.block_diag([case.matrix, sp.csr_array((4 * d, 4 * d))], format="csr")
    added = sp.csr_array(total.reshape(len(points) * d, -1))
    assert len(points) == n + 4
    return Assembled(sp.csr_array(body + added), points, case.cells)


def as_given(case: Assembled, gone: np.ndarray) -> Given:
    """Node by node, without rows that are held or empty."""
    rows = np.flatnonzero(~gone.ravel() & (abs(case.matrix).sum(axis=1) > 0))
    return Given(sp.csr_array(case.matrix[rows][:, rows]), rows // case.dim, rows % case.dim, case.points)


def assert_body_alone_is_placed(case: Given, n: int) -> None:
    """Certified and right, with no coordinates for nodes from n on."""
    found = recover_elasticity(case.matrix)
    assert found.certified
    assert judged(found, case).error < 1e-10
    extra = np.unique(found.node_of_row[case.node >= n])
    assert (found.node_status[extra] == 1).all()
    assert np.isnan(found.points[extra]).all()


@pytest.mark.parametrize(
    ("spring_kind", "clamped"),
    [("axial", False), ("scalar", False), ("one axis", False), ("axial", True), ("scalar", True)],
)
@pytest.mark.parametrize("kind", KINDS)
def test_nodes_that_hang_on_one_spring_have_no_position(kind, spring_kind, clamped):
    rng = np.random.default_rng(1)
    body = permuted_nodes(stiffness(kind, box(kind, KINDS[kind], perturb=0.2), lam=1.5), seed=1)
    n = len(body.points)
    case = with_springs(body, [(n + k, int(rng.integers(n))) for k in range(4)], spring_kind, rng)
    assert_body_alone_is_placed(as_given(case, (on_plane(case, 0) & clamped)[:, None] & np.ones(case.dim, bool)), n)


@pytest.mark.parametrize("spring_kind", ["axial", "scalar"])
@pytest.mark.parametrize("grounded", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_a_ring_of_springs_has_no_position_and_leaves_the_body_its_own(kind, grounded, spring_kind):
    """The ring would be drawn together, and hold two nodes of the body in one place."""
    rng = np.random.default_rng(2)
    body = permuted_nodes(stiffness(kind, box(kind, KINDS[kind], perturb=0.2), lam=1.5), seed=2)
    n = len(body.points)
    first, second = rng.choice(n, 2, replace=False).tolist()
    pairs = [(n, first), (n + 1, second), *((n + k, n + (k + 1) % 4) for k in range(4))]
    case = with_springs(body, pairs, spring_kind, rng, grounded=(n + 2,) if grounded else ())
    case = as_given(case, np.zeros(case.points.shape, dtype=bool))
    assert_body_alone_is_placed(case, n)
    assert any("4 nodes: on springs" in warning for warning in recover_elasticity(case.matrix).warnings)


def test_springs_from_node_to_node_of_a_body_leave_it_as_it_is():
    body = permuted_nodes(stiffness("quad-q1", box("quad-q1", (7, 6), perturb=0.2), lam=1.5), seed=3)
    left, right = (np.flatnonzero(on_plane(body, 0, x)) for x in (0.0, 1.0))
    case = with_springs(body, list(zip(left, right, strict=True)), "axial", np.random.default_rng(3))
    case = as_given(case, np.zeros(case.points.shape, dtype=bool))
    found = recover_elasticity(case.matrix)
    assert found.n_cells == len(body.cells)
    assert judged(found, case).error < 1e-10


def test_two_bodies_joined_by_springs_are_two_pieces():
    """Whatever lies between them is not in the matrix."""
    one = stiffness("quad-q1", box("quad-q1", (5, 5), perturb=0.2), lam=1.5)
    other = stiffness("tri-p1", box("tri-p1", (5, 6), perturb=0.2), lam=2.0)
    n = len(one.points)
    top, bottom = np.flatnonzero(on_plane(one, 1, 1.0)), np.flatnonzero(on_plane(other, 1))
    matrix = sp.block_diag([one.matrix, other.matrix], format="csr")
    both = Assembled(matrix, np.vstack([one.points, other.points + [0.0, 1.3]]), one.cells)
    case = with_springs(both, list(zip(top, n + bottom, strict=True)), "axial", np.random.default_rng(0))
    found = recover_elasticity(case.matrix[: -4 * 2, : -4 * 2])
    assert found.certified
    assert len(found.evidence) == 2
    for piece, truth in enumerate((one.points, other.points)):
        assert error(found.points[found.component == piece], truth) < 1e-10


@pytest.mark.parametrize("kind", ["tri-p2", "quad-q2", "quad-q1"])
def test_springs_between_nodes_whose_rows_lack_entries_place_none_wrong(kind):
    """Next to a clamp cells do not show, so that only other identities can tell that a spring moved a node."""
    certified = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        body = stiffness(kind, box(kind, (3, 3 + seed % 2), perturb=0.2, seed=seed), lam=1.5)
        clamped = on_plane(body, 0)
        next_to_clamp = np.flatnonzero(~clamped & (body.points[:, 0] < 0.6))
        pairs = [tuple(rng.choice(next_to_clamp, 2, replace=False).tolist()) for _ in range(2)]
        case = with_springs(body, pairs, ("axial", "scalar")[seed % 2], rng)
        gone = np.zeros(case.points.shape, dtype=bool)
        gone[: len(clamped)] = clamped[:, None]
        given = as_given(case, gone)
        found = recover_or_none(given.matrix)
        if found is not None:
            certified += 1
            assert judged(found, given).error < 1e-8, seed
            known = found.points[found.node_status == 0]
            away = np.linalg.norm(known[:, None] - known, axis=2) + np.eye(len(known))
            assert away.min() > 1e-6
    assert certified >= 3


def recover_or_none(matrix):
    """A certified body; None for anything else."""
    try:
        found = recover(matrix)
    except RecoveryError:
        return None
    return found if found.certified and isinstance(found, Body) else None


def test_random_springs_are_never_certified_and_wrong():
    """Positive and negative, to the ground and to each other, of every kind, clamped bodies and rollers."""
    kinds = list(KINDS)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        kind = kinds[seed % len(kinds)]
        body = stiffness(kind, box(kind, KINDS[kind], perturb=0.2 * (seed % 2)), lam=1.5)
        n = len(body.points)
        ends = [rng.choice(n + 4 if rng.random() < 0.5 else n, 2, replace=False) for _ in range(6)]
        pairs = [(i, j) for i, j in np.sort(ends, axis=1).tolist() if j >= n] + [(0, n)]
        case = with_springs(body, pairs, ("axial", "scalar", "one axis")[seed // 5 % 3], rng, grounded=(n + 1,))
        gone = np.zeros(case.points.shape, dtype=bool)
        gone[on_plane(case, 0)] = [[False] * case.dim, np.arange(case.dim) == 0, [True] * case.dim][seed % 3]
        gone[n:] = False
        given = as_given(case, gone)
        found = recover_elasticity(given.matrix)
        assert not found.certified or judged(found, given).error < 1e-8, seed
