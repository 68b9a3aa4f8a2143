"""What small changes of labels leave is told by updates of one factorisation, as if each had been solved for."""

import numpy as np
import pytest

from families import FAMILIES
from meshes import random_mesh, specimen
from unassemble.cells.candidates.candidates import Candidates
from unassemble.cells.labels import updates as module
from unassemble.cells.labels.low_rank import ChangedMaps
from unassemble.cells.labels.sheet import Sheet
from unassemble.cells.labels.updates import Updates
from unassemble.cells.maps import best_map
from unassemble.cells.reading import Reading
from unassemble.cells.search import read_cells
from unassemble.matrix import check_matrix
from unassemble.planar.conformal import conformal_map
from vanishing import area, forgotten, half_jittered, triangular_holes

C = 2.0
MESHES = {
    "triangles": random_mesh(150, seed=2),
    "squares and triangles": half_jittered(9),
    "triangular holes": triangular_holes(150, 4, 3),
}


def fitting(known) -> Reading[Candidates]:
    """The right cells."""
    checked = check_matrix(known.matrix)
    reading = read_cells(checked.n, checked.edges, -checked.entries)
    assert reading.fits
    return reading


def without(reading: Reading[Candidates], cell: int) -> Reading[Candidates]:
    """One label turned over."""
    labels = reading.labels.copy()
    labels[cell] ^= True
    return Reading.of(reading.candidates, labels)


@pytest.mark.parametrize("name", MESHES)
def test_one_wrong_label_is_named_first(name):
    right = fitting(forgotten(specimen(*MESHES[name], c=C, seed=1)))
    updates = Updates(Sheet(right.candidates, C))
    inside = right.candidates.size <= 4
    rng = np.random.default_rng(0)
    wrong = rng.choice(np.flatnonzero(inside & (right.labels | ~right.candidates.corner)), 12, replace=False)
    first = sum(next(updates.ranked(without(right, cell))) == (cell,) for cell in wrong.tolist())
    assert first >= 10  # all of them here


def test_two_wrong_labels_are_named_together():
    right = fitting(forgotten(specimen(*MESHES["squares and triangles"], c=C, seed=1)))
    updates = Updates(Sheet(right.candidates, C))
    cells = right.candidates.cells
    full = np.flatnonzero(right.labels & (right.candidates.size <= 4))
    vertices = [set(cells.vertices[cells.offsets[k] : cells.offsets[k + 1]].tolist()) for k in full]
    named = tried = 0
    for k in range(0, len(full), len(full) // 8):
        other = next(j for j in range(len(full)) if j != k and vertices[j] & vertices[k])
        labels = right.labels.copy()
        labels[full[[k, other]]] = False
        spoilt = Reading.of(right.candidates, labels)
        if spoilt.pieces:
            tried += 1
            named += next(updates.ranked(spoilt)) == tuple(sorted((int(full[k]), int(full[other]))))
    assert tried >= 6
    assert named >= tried - 2  # all of them here


def test_corners_that_hardly_matter_are_named():
    """The sides of a tiny missing corner show little of the misfit: displacements take nearly all of it up."""
    known = forgotten(specimen(*FAMILIES["cut_cells"](np.random.default_rng(2)), c=-2.5, seed=2))
    right = fitting(known)
    updates = Updates(Sheet(right.candidates, -2.5))
    cells = right.candidates.cells
    corner = np.flatnonzero(right.labels & right.candidates.corner)
    tiny = [k for k in corner.tolist() if area(known.points, cells.vertices[cells.offsets[k] :][:3][None]) < 0.02]
    assert len(tiny) >= 4
    assert sum(next(updates.ranked(without(right, k))) == (k,) for k in tiny) >= 0.75 * len(tiny)  # all of them here


def test_a_singular_pencil_spoils_no_other_change():
    right = fitting(forgotten(specimen(*MESHES["triangles"], c=C, seed=1)))
    sheet = Sheet(right.candidates, C)
    changed = ChangedMaps(sheet, right.labels, 1e-3)
    inside = np.flatnonzero(right.labels & (right.candidates.size == 3))
    vertices = right.candidates.cells.vertices[right.candidates.cells.offsets[inside][:, None] + np.arange(3)]
    far = next(k for k in range(len(inside)) if not np.isin(vertices[k], vertices[0]).any())
    moves = [(int(inside[0]),), (int(inside[far]),)]
    before = changed.after(right.labels, moves)
    assert np.isfinite(before).all()
    # 1 - s T_f G_f is made singular for the first: its entries are powers of two, and so exact.
    changed._shift = 4.0
    changed._columns[changed._place[vertices[0]]] = 0
    changed._columns[changed._place[vertices[0, 0]], vertices[0, 1]] = -1j
    after = changed.after(right.labels, moves)
    assert np.isnan(after[:, 0]).any()
    assert np.isfinite(after[:, 1]).all()


@pytest.mark.parametrize("seed", range(3))
def test_which_pairs_are_told_does_not_depend_on_the_order_of_rows(seed, monkeypatch):
    """Where there are too many, the most promising are."""
    points, triangles = triangular_holes(150, 4, 3)
    monkeypatch.setattr(module, "_WORK", 40 * len(points))  # so many moves of each kind
    missing = {frozenset(map(tuple, np.round(points - points.mean(axis=0), 6)[t].tolist())) for t in triangles[:90:40]}
    named = []
    for rows in (0, 1 + seed):
        known = specimen(points, triangles, c=C, seed=rows)
        right = fitting(known)
        cells = right.candidates.cells
        at = np.round(known.points, 6)
        names = [
            frozenset(map(tuple, at[cells.vertices[cells.offsets[k] : cells.offsets[k + 1]]].tolist()))
            for k in range(right.candidates.count)
        ]
        labels = right.labels & ~np.array([name in missing for name in names])
        assert labels.sum() == right.labels.sum() - 3
        moves = Updates(Sheet(right.candidates, C)).ranked(Reading.of(right.candidates, labels), levels=2)
        named.append([{names[k] for k in move} for move in moves if len(move) > 1])
    first, other = named
    assert len(first) == len(other) > 20
    assert all(move in other for move in first[:20])


def test_labels_of_the_same_surface_have_the_same_outline():
    right = fitting(forgotten(specimen(*MESHES["squares and triangles"], c=C, seed=1)))
    updates = Updates(Sheet(right.candidates, C))
    other = right.labels.copy()
    other[np.flatnonzero(right.labels)[0]] = False
    assert updates.outline(right.labels) == updates.outline(right.labels.copy())
    assert updates.outline(right.labels) != updates.outline(other)


@pytest.mark.parametrize("name", ["triangles", "triangular holes"])
def test_a_cell_too_many_does_not_hide_the_map(name):
    """A hole that is taken for a cell brings a map of a lesser c, that of the mesh being the second then."""
    right = fitting(forgotten(specimen(*MESHES[name], c=C, seed=1)))
    candidates = right.candidates
    hidden = found = 0
    for cell in np.flatnonzero(~right.labels & ~candidates.outer)[:30].tolist():
        reading = Reading.unsolved(candidates, right.labels | (np.arange(candidates.count) == cell))
        if len(reading.pieces) != 1:
            continue
        weights = reading.weights[reading.pieces[0].edge_rows]
        if conformal_map(reading.pieces[0], weights, sharp=False).scale < 0.95 * C:
            hidden += 1
            found += abs(best_map(reading.pieces[0], weights).scale / C - 1) < 0.02
    assert hidden >= 3
    assert found >= 0.75 * hidden  # 4 of 5, and 6 of 6, here
