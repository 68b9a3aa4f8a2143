"""Axial forces in all members, and springs between all nodes: no wrong size is certified, and the reason says why."""

import numpy as np
import pytest
import scipy.sparse as sp
from built import curved, flat, rows_per_node, shell, sound
from spoiled import prestressed, tied

from unassemble import recover


def without_forces(counts=(3, 2, 2), seed=0, **how):
    return prestressed(counts, seed, share=0.0, **how)


@pytest.mark.parametrize("forces", ["alike", "direction", "random"])
def test_a_rotation_of_a_structure_under_load_leaves_the_loads_behind(forces):
    """Node i needs the force w x f_i under a rotation w, and no moment: the skew part is all that loads change."""
    given = prestressed((3, 2, 2), 1, forces=forces, equal=False, off=0.3, braces="all")
    centred = given.points - given.points.mean(axis=0)
    size = abs(given.matrix).max()
    part = np.zeros((len(centred), 3, 3))
    for k, w in enumerate(np.eye(3)):
        motion = np.concatenate([np.cross(w, centred), np.tile(w, (len(centred), 1))], axis=1)
        answer = (given.matrix @ motion.ravel()).reshape(-1, 6)
        assert np.abs(answer[:, 3:]).max() < 1e-12 * size
        part[:, :, k] = answer[:, :3]
    assert np.abs(part + part.transpose(0, 2, 1)).max() < 1e-12 * size
    assert np.abs(part).max() > 1e-6 * size


@pytest.mark.parametrize("braces", ["none", "all"])
@pytest.mark.parametrize("equal", [True, False])
@pytest.mark.parametrize("counts", [(2, 2, 2), (3, 2, 2), (4, 2, 2)])
def test_axial_forces_in_a_lattice(counts, equal, braces):
    """Forces of all rows fit another size exactly, or, along braces, nearly so."""
    given = prestressed(counts, 1, forces="alike", equal=equal, braces=braces).permuted(1)
    found = recover(given.matrix)
    assert found.status == "uncertified"
    assert "axial forces" in found.reason
    assert "geometric stiffness" in found.advice


@pytest.mark.parametrize("share", [1e-4, 1e-2, 0.1])
@pytest.mark.parametrize("counts", [(3, 2, 2), (2, 3, 1)])
def test_equal_springs_in_a_lattice(counts, share):
    given = without_forces(counts)
    assert sound(given.matrix, rows_per_node(given))
    found = recover(tied(given, share=share).permuted(2).matrix)
    assert found.status == "uncertified"


@pytest.mark.parametrize("seed", range(60))
def test_never_certified_in_a_wrong_size(seed):
    rng = np.random.default_rng(seed)
    counts = tuple(int(k) for k in rng.choice([2, 3, 4], 3, p=[0.5, 0.35, 0.15]))
    share = 10 ** rng.uniform(-4, -0.3)
    how = {
        "step": (2.0, 2.0, 2.0) if rng.random() < 0.5 else rng.uniform(1, 3, 3),
        "forces": str(rng.choice(["alike", "direction", "random"], p=[0.4, 0.5, 0.1])),
        "equal": rng.random() < 0.5,
        "round_section": rng.random() < 0.8,
        "braces": "all" if rng.random() < 0.3 else "none",
    }
    if seed % 2:
        given = prestressed(counts, seed, share=share, **how)
    else:
        given = tied(without_forces(counts, seed, **how), seed, share=share, alike=rng.random() < 0.7)
    if seed % 4 > 1:
        held = given.points[:, 2] < 0.1 if seed % 8 > 3 else rng.random(len(given.points)) < 0.15
        given = given.clamped(held)
    sound(given.permuted(seed).matrix, rows_per_node(given.permuted(seed)))


@pytest.mark.parametrize("shape", [curved, flat])
@pytest.mark.parametrize("alike", [True, False])
def test_shells_next_to_supports(shape, alike):
    """Hardly a row is whole, and all rotations have springs against drilling; with springs between nodes besides."""
    for counts in ((4, 3), (5, 3), (6, 4), (5, 2)):
        whole = shell(shape, counts)
        for seed in range(3):
            held = np.random.default_rng(seed).random(len(whole.points)) < 0.25
            given = tied(whole, seed, share=0.1, alike=alike).clamped(held).permuted(seed)
            sound(given.matrix, rows_per_node(given))


def test_springs_against_drilling_are_none_between_nodes():
    """Forces alone tell the size of a shell, whatever loads it bears."""
    given = shell(curved, (7, 5)).clamped(np.arange(35) < 5).permuted(1)
    assert sound(given.matrix, rows_per_node(given))
    drilled = given.matrix + sp.diags_array(
        np.where(np.arange(given.matrix.shape[0]) % 6 > 2, 0.1 * given.matrix.diagonal(), 0.0)
    )
    assert sound(drilled, rows_per_node(given))
