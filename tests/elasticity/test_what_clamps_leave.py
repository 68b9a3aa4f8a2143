"""Nodes without coordinates next to clamps: those that the equations leave free, all of them and no others.

The equations are written down again here, from the formula, with the boundary terms p and q as unknowns, in the rows
that are known to be whole.
"""

from itertools import product

import numpy as np
import pytest
from assembled import Assembled, box, heterogeneous, permuted_nodes, recover_elasticity, stiffness
from supported import Given, given, judged

MATERIALS = {"one": {"lam": 1.5}, "varying": {"lam": heterogeneous, "mu": lambda x: 1 + x[1] + x[0] * x[1]}}


def null_fields(body: Assembled, case: Given, nodes: np.ndarray, ratio: float | None) -> np.ndarray:
    """(n, d, k) null space of the identities of complete rows; with p = ratio q, where that is known."""
    n, d = len(nodes), body.dim
    blocks = case.matrix.toarray().reshape(n, d, n, d)
    whole = body.matrix.toarray().reshape(len(body.points), d, len(body.points), d)
    gone = np.setdiff1d(np.arange(len(body.points)), nodes)
    equations = []
    for i in np.flatnonzero(np.abs(whole[nodes][:, :, gone]).max(axis=(1, 2, 3)) < 1e-12):
        for c, b, a in product(range(d), repeat=3):
            one = np.zeros((3, n, d))  # of x, p and q
            one[0, :, a] = blocks[i, c, :, b]
            for k, node_term in ((1, (a == b, c)), (2, (a == c, b)), (2, (c == b, a))):
                one[k, i, node_term[1]] -= node_term[0]
            if ratio is not None:
                one[2] += ratio * one[1]
                one[1] = 0
            equations.append(one.ravel())
    _, size, v = np.linalg.svd(np.array(equations), full_matrices=True)
    free = v[(size > 1e-10 * size[0]).sum() :]
    return free.reshape(-1, 3, n, d)[:, 0].transpose(1, 2, 0)


def rank(fields: np.ndarray) -> int:
    size = np.linalg.svd(fields.reshape(-1, fields.shape[2]), compute_uv=False)
    return int((size > 1e-7 * size[0]).sum())


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize(("kind", "shape"), [("tri-p2", (4, 4)), ("tet-p2", (3, 3, 3)), ("hex-s2", (3, 3, 3))])
def test_clamps_cost_the_nodes_that_no_equation_holds(kind, shape, material):
    """In one material its Poisson's ratio, known from the other nodes, counts as known."""
    body = permuted_nodes(stiffness(kind, box(kind, shape, perturb=0.1), **MATERIALS[material]), seed=1)
    case = given(body, "clamp", "interleaved", "stored")
    found = recover_elasticity(case.matrix)
    truth = judged(found, case)
    assert found.certified
    assert truth.error < 1e-9
    assert truth.missing > 0
    d = body.dim
    nodes = case.node[::d]
    fields = null_fields(body, case, nodes, 1.5 if material == "one" else None)
    placed = np.isfinite(found.points).all(axis=1)[found.node_of_row[::d]]
    assert rank(fields[placed]) == d + 1
    loose = np.flatnonzero(~placed)
    held = [rank(fields[placed | (np.arange(len(nodes)) == node)]) == d + 1 for node in loose]
    unchecked = any("identities that no others check" in warning for warning in found.warnings)
    assert unchecked or not any(held)  # some have as many equations as coordinates, and none of them to spare
    assert not all(held)
