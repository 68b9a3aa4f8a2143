"""What a scalar matrix is: the same answer from inspect and recover, on matrices that other packages assembled."""

from __future__ import annotations

from pathlib import Path

import networkx
import numpy as np
import pyamg
import pytest
import scipy.sparse as sp
import skfem as fem
from skfem.helpers import ddot, div, dot, grad
from skfem.models.elasticity import lame_parameters, linear_elasticity
from skfem.models.poisson import laplace, mass

from unassemble import MatrixError, NotPlanarError, RecoveryError, inspect_matrix, recover
from unassemble.matrix import check_matrix


def shuffled(A, seed=3):
    place = np.random.default_rng(seed).permutation(A.shape[0])
    return sp.csr_array(A)[place][:, place]


def moved(mesh, size=0.02):
    points = mesh.p + np.random.default_rng(0).uniform(-size, size, mesh.p.shape)
    return type(mesh)(points, mesh.t)


DISC = moved(fem.MeshTri.init_circle(3), 0.01)
TETS = moved(fem.MeshTet().refined(2))


def stiffness(mesh, element):
    return laplace.assemble(fem.Basis(mesh, element))


def masses(mesh, element):
    return mass.assemble(fem.Basis(mesh, element))


def without_zeros(A):
    """What rounding leaves of zeros is left out."""
    A = sp.csr_array(A)
    A.data[np.abs(A.data) < 1e-13] = 0
    A.eliminate_zeros()
    return A


def outcome(A):
    """A recovery and its advice, or else None and what was said."""
    try:
        found = recover(A)
    except RecoveryError as error:
        return None, str(error)
    return found, found.advice


def weighted(graph):
    draw = np.random.default_rng(0)
    for one in graph.edges.values():
        one["weight"] = draw.uniform(0.2, 3)
    return networkx.laplacian_matrix(graph).astype(float)


UNREAD = {
    "tetrahedra": ("tetrahedra", lambda: stiffness(TETS, fem.ElementTetP1()), "in space"),
    "tetrahedra, K + M": (
        "tetrahedra",
        lambda: stiffness(TETS, fem.ElementTetP1()) + masses(TETS, fem.ElementTetP1()),
        "in space",
    ),
    "hexahedra": ("hexahedra", lambda: stiffness(fem.MeshHex().refined(2), fem.ElementHex1()), "in space"),
    "seven-point stencil": ("grid in space", lambda: pyamg.gallery.poisson((6, 5, 7), format="csr"), "in space"),
    "quadrilaterals": (
        "quadrilaterals",
        lambda: stiffness(moved(fem.MeshQuad().refined(3)), fem.ElementQuad1()),
        "quadrilaterals",
    ),
    "nine-point stencil": (
        "quadrilaterals",
        lambda: pyamg.gallery.stencil_grid(
            pyamg.gallery.diffusion_stencil_2d(0.1, 0.5, type="FE"), (9, 8), format="csr"
        ),
        "quadrilaterals",
    ),
    "quadratic triangles": ("quadratic", lambda: stiffness(DISC, fem.ElementTriP2()), "quadratic"),
    "quadratic tetrahedra": ("tetrahedra", lambda: stiffness(TETS, fem.ElementTetP2()), "quadratic"),
    "cubic triangles": ("cubic", lambda: stiffness(DISC, fem.ElementTriP3()), "cubic"),
    "mass, triangles": ("mass", lambda: masses(DISC, fem.ElementTriP1()), "mass matrix"),
    "mass, tetrahedra": ("mass", lambda: masses(TETS, fem.ElementTetP1()), "mass matrix"),
    "surface": ("surface", lambda: pyamg.gallery.load_example("knot")["A"], "surface"),
    "graph": (
        "graph",
        lambda: networkx.laplacian_matrix(networkx.random_geometric_graph(60, 0.3, seed=1)).astype(float),
        "graph without weights",
    ),
    "weighted graph": ("graph", lambda: weighted(networkx.random_geometric_graph(60, 0.3, seed=1)), "with weights"),
    "weighted graph with few triangles": (
        "graph",
        lambda: weighted(networkx.watts_strogatz_graph(100, 6, 0.1, seed=2)),
        "with weights",
    ),
    "weighted graph with a node held": (
        "graph",
        lambda: weighted(networkx.random_geometric_graph(60, 0.3, seed=1)).tocsr()[1:, 1:],
        "with weights, plus a diagonal",
    ),
    "line": ("segments", lambda: pyamg.gallery.poisson((40,), format="csr"), "on a line"),
}


@pytest.mark.parametrize("name", UNREAD)
def test_what_is_not_read_yet_is_named(name):
    """With evidence and what to do; two sentences at most, without the drawing of a graph that is not planar."""
    kind, assembled, words = UNREAD[name]
    A = shuffled(assembled())
    facts = inspect_matrix(A)
    assert facts.kind == kind
    assert words in facts.operator + facts.advice
    assert facts.evidence
    found, said = outcome(A)
    if found is not None:  # recovery has learnt to read it
        assert found.certified
        return
    assert facts.advice
    assert facts.name in said
    assert facts.evidence[0] in said
    assert "subdivision" not in said
    assert "unknowns each" not in said
    assert said.count(". ") <= 1
    assert facts.recoverable.startswith("nothing: ") or facts.element or facts.surface


PRODUCTS = {
    "triangles": lambda: stiffness(DISC, fem.ElementTriP1()),
    "tetrahedra": lambda: stiffness(TETS, fem.ElementTetP1()),
    "five-point stencil": lambda: pyamg.gallery.poisson((12, 12), format="csr"),
    "grid": lambda: networkx.laplacian_matrix(networkx.grid_2d_graph(12, 12)).astype(float),
}


@pytest.mark.parametrize("name", PRODUCTS)
def test_products_of_matrices_are_those_of_no_element(name):
    """Second neighbours are coupled: each pair lies in cliques of four, but far more than cells of four would make."""
    A = shuffled(PRODUCTS[name]())
    A = A @ A
    facts = inspect_matrix(A)
    found, said = outcome(A)
    assert (facts.kind, found) == ("unknown", None)
    assert facts.advice.lower() in said.lower()


def copied(A, copies):
    """``kron(A, I)`` with all zeros of its blocks, as scipy makes it of two copies."""
    A = sp.csr_array(A)
    return sp.bsr_array((A.data[:, None, None] * np.eye(copies), A.indices, A.indptr)).tocsr()


@pytest.mark.parametrize("element", [fem.ElementQuad1(), fem.ElementTriP1()], ids=["Q1", "P1"])
@pytest.mark.parametrize("copies", [2, 3])
def test_stored_zeros_that_join_copies_of_a_mesh_are_no_structure(element, copies):
    """Other entries connect all of a mesh: of a Laplacian only constants are a null vector."""
    mesh = QUADS if isinstance(element, fem.ElementQuad1) else DISC
    K = stiffness(mesh, element)
    A = shuffled(copied(K, copies))
    assert A.nnz == copies**2 * K.nnz
    facts, found = inspect_matrix(A), recover(A)
    assert facts.n_pieces == copies
    assert facts.recoverable.startswith(f"{copies * mesh.t.shape[1]:,} ")
    assert found.certified
    assert found.n_components == copies
    assert any("stored zeros" in one for one in found.warnings)


def test_zeros_of_a_connected_mesh_stay():
    """Right angles leave zeros that belong to cells, and Dirichlet conditions zeros that tell what was there."""
    K = stiffness(fem.MeshTri().refined(2), fem.ElementTriP1())
    assert check_matrix(K).without_joining_zeros() is None
    assert check_matrix(boundary_conditions()[2]["both"]).without_joining_zeros() is None


def test_a_graph_in_the_plane_is_one_too():
    A = shuffled(networkx.laplacian_matrix(networkx.grid_2d_graph(6, 6)).astype(float))
    facts, (found, said) = inspect_matrix(A), outcome(A)
    assert facts.kind == "graph"
    assert found is None or found.status == "uncertified"
    assert facts.name in (said if found is None else found.reason)
    assert facts.advice in (said.lower() if found is None else found.advice)


@pytest.mark.parametrize("size", [12, 20])
def test_no_work_is_spent_on_cells_that_no_number_tells(size, caplog):
    """All entries are equal: each cell looks like each other one, and like each hole."""
    caplog.set_level("DEBUG", logger="unassemble.cells")
    outcome(shuffled(networkx.laplacian_matrix(networkx.grid_2d_graph(size, size)).astype(float)))
    assert not [said for said in caplog.messages if "ranked" in said and "0 labellings ranked" not in said]


@pytest.mark.parametrize("seed", range(3))
def test_a_line_whose_pieces_fit_is_one_too(seed):
    """In some orders of rows right triangles have its entries, in pieces of different factors."""
    A = pyamg.gallery.poisson((40,), format="csr")
    A = shuffled(A, seed) if seed else A
    assert inspect_matrix(A).kind == "segments"
    with pytest.raises(RecoveryError, match="on a line"):
        recover(A)


def test_large_matrices_are_diagnosed_from_a_part():
    A = shuffled(stiffness(fem.MeshTet().refined(5), fem.ElementTetP1()))
    assert A.shape[0] > 30_000
    with pytest.raises(NotPlanarError, match="linear elements on tetrahedra"):
        recover(A)


def test_a_mass_matrix_beside_the_stiffness_matrix():
    A = shuffled(stiffness(DISC, fem.ElementTriP1()) + masses(DISC, fem.ElementTriP1()))
    facts, found = inspect_matrix(A), recover(A)
    assert "plus a diagonal or a mass matrix" in facts.operator
    assert found.certified == bool(found.reaction)
    if not found.certified:
        assert "mass matrix" in found.reason


def test_a_strongly_varying_coefficient():
    @fem.BilinearForm
    def varying(u, v, w):
        return (1 + 3 * w.x[0] ** 2) * dot(grad(u), grad(v))

    A = shuffled(varying.assemble(fem.Basis(DISC, fem.ElementTriP1())))
    found = recover(A)
    assert found.status == "uncertified"
    assert inspect_matrix(A).evidence == ("all rows add up to zero",)
    assert "coefficient" in getattr(found, "advice", "") + found.reason
    assert "noise" not in found.advice


QUADS = moved(fem.MeshQuad().refined(3))


def with_terms(element, mesh=QUADS):
    """Matrices of elements whose terms are not read."""
    K = stiffness(mesh, element)
    inside = fem.Basis(mesh, element).complement_dofs(fem.Basis(mesh, element).get_dofs())
    varying = fem.BilinearForm(lambda u, v, w: (1 + 3 * w.x[0] ** 2) * dot(grad(u), grad(v)))
    return {
        "masses": (K + masses(mesh, element), "assemble the stiffness matrix alone"),
        "unknowns gone": (K[inside][:, inside], "keep all rows and columns"),
        "coefficient": (varying.assemble(fem.Basis(mesh, element)), "see whether a coefficient varies"),
    }


@pytest.mark.parametrize("which", with_terms(fem.ElementQuad1()))
@pytest.mark.parametrize("element", [fem.ElementQuad1(), fem.ElementTriP2()], ids=["Q1", "P2"])
def test_what_else_a_matrix_of_other_elements_has(element, which):
    """Neither promised without a condition nor refused as if its elements were not read."""
    A, advice = with_terms(element, QUADS if isinstance(element, fem.ElementQuad1) else DISC)[which]
    A = shuffled(A)
    facts = inspect_matrix(A)
    found, said = outcome(A)
    if found is not None and found.certified:  # recovery has learnt to read them
        return
    assert advice in said.lower()
    assert "for this is" not in said
    assert said.count(". ") <= 1
    if facts.advice:
        assert facts.advice in facts.recoverable
        assert facts.advice in said.lower()
    else:
        assert which == "coefficient"
    if found is not None:
        assert facts.evidence[-1].lower() in found.reason.lower()


def boundary_conditions():
    K, D = stiffness(DISC, fem.ElementTriP1()), DISC.boundary_nodes()
    rows = K.tolil(copy=True)
    rows[D, :] = 0
    rows[D, D] = 1
    both = rows.copy()
    both[:, D] = 0
    both[D, D] = 1
    return K, D, {"rows": rows.tocsr(), "enforced": fem.enforce(K, D=D), "both": both.tocsr()}


@pytest.mark.parametrize("which", ["rows", "enforced"])
def test_rows_of_the_identity_are_no_noise(which):
    A = shuffled(boundary_conditions()[2][which])
    found, said = outcome(A)
    assert found is not None
    assert "noise" not in said


def test_rows_and_columns_of_the_identity():
    A = shuffled(boundary_conditions()[2]["both"])
    facts = inspect_matrix(A)
    assert "32 rows are those of the identity" in facts.evidence[0]
    assert any("eliminated" in one for one in facts.evidence)


def test_penalties():
    K, D, _ = boundary_conditions()
    A = shuffled(fem.penalize(K, D=D))
    facts = inspect_matrix(A)
    assert facts.evidence[0].startswith("32 diagonal entries are a penalty")
    assert recover(A).certified


def test_unknowns_that_are_gone():
    K, D, _ = boundary_conditions()
    inside = np.setdiff1d(np.arange(K.shape[0]), D)
    facts = inspect_matrix(shuffled(K[inside][:, inside]))
    assert "28 of 113 rows do not add up to zero" in facts.evidence[0]
    assert "without some unknowns" in facts.operator


def test_convection_is_named():
    @fem.BilinearForm
    def convection(u, v, w):
        return dot(grad(u), grad(v)) + 3 * grad(u)[0] * v

    A = shuffled(convection.assemble(fem.Basis(DISC, fem.ElementTriP1())))
    with pytest.raises(MatrixError, match=r"not symmetric: .* as where convection .* was added"):
        recover(A)


def vector_masses(mesh, element):
    form = fem.BilinearForm(lambda u, v, w: (1 + w.x[0] ** 2) * dot(u, v))  # a density that varies
    return form.assemble(fem.Basis(mesh, fem.ElementVector(element)))


def beams(n=12, length=0.7):
    """Masses of bending members in a row, with displacements and rotations: Przemieniecki (1968), chapter 11."""
    a = length
    member = np.array(
        [[156, 22 * a, 54, -13 * a], [22 * a, 4 * a**2, 13 * a, -3 * a**2], [54, 13 * a, 156, -22 * a],
         [-13 * a, -3 * a**2, -22 * a, 4 * a**2]]
    )  # fmt: skip
    M = np.zeros((2 * n + 2, 2 * n + 2))
    for k in range(n):
        M[2 * k : 2 * k + 4, 2 * k : 2 * k + 4] += member * a / 420
    return sp.csr_array(M)


MASSES = {
    "cubic triangles": (lambda: masses(DISC, fem.ElementTriP3()), "cubic elements on triangles"),
    "quadratic tetrahedra": (lambda: masses(TETS, fem.ElementTetP2()), "quadratic elements on tetrahedra"),
    "quadratic triangles": (lambda: masses(DISC, fem.ElementTriP2()), "quadratic elements on triangles"),
    "quadrilaterals": (lambda: masses(moved(fem.MeshQuad().refined(3)), fem.ElementQuad1()), "bilinear elements"),
    "biquadratic quadrilaterals": (lambda: masses(QUADS, fem.ElementQuad2()), "biquadratic elements"),
    "hexahedra": (lambda: masses(fem.MeshHex().refined(2), fem.ElementHex1()), "trilinear elements on hexahedra"),
    "triquadratic hexahedra": (lambda: masses(fem.MeshHex().refined(1), fem.ElementHex2()), "triquadratic elements"),
    "Crouzeix-Raviart": (lambda: masses(DISC, fem.ElementTriCR()), "a lumped mass matrix"),  # beside it only rounding
    "vectors": (lambda: vector_masses(TETS, fem.ElementTetP1()), "of several unknowns per node"),
    "vectors on quadrilaterals": (lambda: vector_masses(moved(fem.MeshQuad().refined(3)), fem.ElementQuad1()), "of"),
    "beams": (beams, "a consistent mass matrix"),
    "negative": (lambda: -masses(moved(fem.MeshQuad().refined(3)), fem.ElementQuad1()), "bilinear elements"),
}


@pytest.mark.parametrize("name", MASSES)
def test_masses_of_every_element_are_named(name):
    assembled, words = MASSES[name]
    A = shuffled(assembled())
    facts = inspect_matrix(A)
    assert facts.kind == "mass"
    assert words in facts.operator
    for operator in ("auto", "laplacian", "elasticity"):
        with pytest.raises(RecoveryError, match="mass matrix") as caught:
            recover(A, operator=operator)
        assert facts.name in str(caught.value)
        assert facts.advice.split(":")[0] in str(caught.value).lower()


def test_a_matrix_without_its_diagonal_is_no_saddle_point():
    A = networkx.adjacency_matrix(networkx.random_geometric_graph(60, 0.3, seed=1)).astype(float)
    assert "saddle point" not in str(inspect_matrix(A)) + outcome(A)[1]


def test_inner_products_that_are_of_no_element():
    """Those of sparse columns are as far from singular as masses, and no cells show."""
    columns = sp.random_array((150, 150), density=0.02, rng=np.random.default_rng(4))
    A = sp.csr_array(columns @ columns.T + sp.eye_array(150))
    facts, (found, said) = inspect_matrix(A), outcome(A)
    assert "or another matrix of inner products" in facts.name
    assert found is None
    assert facts.name in said


def test_a_small_body_held_all_around_may_pass_for_masses_and_is_read():
    basis = fem.Basis(fem.MeshTri.init_tensor(*2 * [np.linspace(0, 1, 7)]), fem.ElementVector(fem.ElementTriP1()))
    K = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis)
    inside = basis.complement_dofs(basis.get_dofs())
    A = sp.csr_array(K[inside][:, inside])
    assert "or the stiffness matrix of a body" in inspect_matrix(A).name
    assert recover(A).certified


def test_masses_of_a_boundary_are_those_of_segments():
    A = shuffled(mass.assemble(fem.FacetBasis(DISC, fem.ElementTriP1())))
    facts = inspect_matrix(A)
    assert (facts.kind, "segments" in facts.operator, "113 rows are zero") == ("mass", True, facts.evidence[1])
    with pytest.raises(RecoveryError, match="six times its entry"):
        recover(A)


def test_areas_of_a_mass_matrix_are_promised_and_given():
    A = shuffled(masses(DISC, fem.ElementTriP1()))
    facts, found = inspect_matrix(A), recover(A)
    assert facts.recoverable.startswith("areas of 256 triangles")
    assert found.certified
    assert np.isclose(
        np.sort(found.areas), np.sort(np.abs(np.linalg.det(DISC.mapping().A.transpose(2, 0, 1))) / 2)
    ).all()


def test_lumped_masses():
    A = sp.diags_array(np.arange(1.0, 20))
    for ask in (inspect_matrix, recover):
        with pytest.raises(MatrixError, match="as a lumped mass matrix is"):
            ask(A)


@pytest.mark.parametrize("much", [0.1, 1.0])
def test_stiffness_beside_masses_is_no_mass_matrix(much):
    mesh = moved(fem.MeshQuad().refined(3))
    K, M = stiffness(mesh, fem.ElementQuad1()), masses(mesh, fem.ElementQuad1())
    both = sp.kron(K + much * K.diagonal().mean() / M.diagonal().mean() * M, sp.eye_array(2)).tocsr()
    scaled = K + much * K.diagonal().mean() * sp.eye_array(K.shape[0])
    for A in (both, scaled):
        assert inspect_matrix(shuffled(A)).kind != "mass"


CLASSICS = Path(__file__).resolve().parents[2] / "shared" / "classics"


@pytest.mark.parametrize("name", sorted(path.name for path in CLASSICS.glob("*.mtx.gz")) if CLASSICS.exists() else [])
def test_masses_among_classics(name):
    """Their collections call all of these mass matrices; bcsstm10 is indefinite, and none."""
    matrices = ("bcsstm07", "bcsstm12", "bcsstm13", "rail_109_M", "rail_371_E", "rail_371_M", "wathen_30_30")
    if name.startswith("bcsstm08"):
        with pytest.raises(MatrixError, match="as a lumped mass matrix is"):
            inspect_matrix(CLASSICS / name)
        return
    facts = inspect_matrix(CLASSICS / name)
    assert (facts.kind == "mass") == name.startswith(matrices)
    if facts.kind == "mass" and facts.advice:
        with pytest.raises(RecoveryError, match=facts.name):
            recover(CLASSICS / name)


def stokes():
    """Flow on triangles, velocities and pressures at random places in one matrix."""
    mesh = fem.MeshTri().refined(2)
    velocity = fem.Basis(mesh, fem.ElementVector(fem.ElementTriP2()))
    pressure = velocity.with_element(fem.ElementTriP1())
    K = fem.BilinearForm(lambda u, v, w: ddot(grad(u), grad(v))).assemble(velocity)
    B = -fem.BilinearForm(lambda u, q, w: div(u) * q).assemble(velocity, pressure)
    return shuffled(sp.block_array([[K, B.T], [B, None]]))


def condensed():
    """A body that is held below, of which the upper side is left."""
    basis = fem.Basis(moved(fem.MeshHex().refined(2)), fem.ElementVector(fem.ElementHex1()))
    held = basis.get_dofs(lambda x: x[2] < 0.1).all()
    A = linear_elasticity(*lame_parameters(1.0, 0.3)).assemble(basis)
    kept = basis.get_dofs(lambda x: x[2] > 0.9).all()
    rest = np.setdiff1d(np.arange(A.shape[0]), np.union1d(held, kept))
    A = A.toarray()
    return A[np.ix_(kept, kept)] - A[np.ix_(kept, rest)] @ np.linalg.solve(A[np.ix_(rest, rest)], A[np.ix_(rest, kept)])


@pytest.mark.parametrize(
    ("assembled", "said"),
    [
        (stokes, "zero .*: a saddle point"),
        (lambda: shuffled((condensed() + condensed().T) / 2), "Every row is coupled to every other"),
    ],
    ids=["Taylor-Hood", "condensed"],
)
def test_what_other_matrices_seem_to_be(assembled, said):
    with pytest.raises(RecoveryError, match=said):
        recover(assembled())


@pytest.mark.parametrize(("name", "said"), [("bcsstk02", "annihilate translations"), ("bcsstk22", "plane frame")])
def test_nodes_among_classics_that_only_a_second_look_shows(name, said):
    if not (path := CLASSICS / f"{name}.mtx.gz").exists():
        pytest.skip("no classics")
    facts = inspect_matrix(path)
    found, why = outcome(path)
    assert said in str(facts)
    assert said in (why if found is None else found.operator)


@pytest.mark.parametrize("name", ["bcsstk34", "ex3", "ex13", pytest.param("nasa1824", marks=pytest.mark.slow)])
def test_inspect_and_recover_read_classics_alike(name):
    """What no positions come of is of the same name for both, and 1,824 rows are no 1,509 nodes of two unknowns."""
    if not (path := CLASSICS / f"{name}.mtx.gz").exists():
        pytest.skip("no classics")
    facts = inspect_matrix(path)
    found, said = outcome(path)
    assert found is None
    if facts.kind == "unknown":
        assert name == "nasa1824"
        assert facts.advice.lower() in said.lower()
        assert facts.recoverable.startswith("nothing")
    else:
        assert facts.name in said
        assert "whose sums by direction vanish in" in facts.evidence[0]
        assert "if enough rows are whole" in facts.recoverable


def test_a_row_that_is_coupled_to_all_others():
    """A band beside one full row, whose graph is planar and full of separating triangles: an answer in seconds."""
    n = 2001
    rng, i = np.random.default_rng(0), np.arange(n - 1)
    rows, columns = np.concatenate([i[:-1], i[:-2], i]), np.concatenate([i[1:], i[2:], np.full(n - 1, n - 1)])
    half = sp.csr_array((rng.uniform(-1, 1, len(rows)), (rows, columns)), shape=(n, n))
    with pytest.raises(RecoveryError, match="none has its entries"):
        recover(half + half.T + sp.diags_array(np.append(rng.uniform(3, 4, n - 1), 0.0)))
