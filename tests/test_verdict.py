"""The verdict: what each status means, and that one place decides on it."""

import ast
from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from pyamg.gallery import poisson
from skfem import Basis, ElementQuad1, ElementVector, MeshQuad, asm
from skfem.models.elasticity import linear_elasticity

import unassemble
from meshes import random_mesh, specimen
from unassemble import recover
from unassemble.certificate import UNJUDGED, Findings, Verdict, judge
from unassemble.words import Reason

ROOT = Path(unassemble.__file__).parent
FITS = Findings(("it fits",), error=1e-15)
OBJECTION = Reason("a cell is turned over", advice="check the cells")
ANOTHER = Reason("so does another mesh", advice="choose")


def with_(**changes):
    return Findings(**{"fits": FITS.fits, "error": FITS.error} | changes)


def test_a_mesh_that_fits_is_certified_for_that_reason():
    verdict = judge(FITS)
    assert (verdict.status, verdict.uniqueness, verdict.reasons) == ("certified", "searched", ("it fits",))
    assert verdict.objections == ()


@pytest.mark.parametrize("unique", ["proved", "searched", "conventional"])
def test_what_is_known_of_other_meshes_leaves_it_certified(unique):
    verdict = judge(with_(unique=unique))
    assert (verdict.status, verdict.uniqueness) == ("certified", unique)


def test_another_mesh_makes_it_ambiguous():
    verdict = judge(with_(another=ANOTHER))
    assert (verdict.status, verdict.uniqueness) == ("ambiguous", "ambiguous")
    assert (verdict.reasons, verdict.advice) == (ANOTHER.sentences, "choose")


def test_an_objection_outweighs_all_else():
    verdict = judge(with_(objections=(OBJECTION, Reason("it is small")), another=ANOTHER, unique="proved"))
    assert (verdict.status, verdict.uniqueness) == ("uncertified", None)
    assert verdict.reasons == ("a cell is turned over", "it is small")
    assert verdict.advice == "check the cells"


@pytest.mark.parametrize(
    ("error", "words"), [(2e-9, "2.0e-09"), (np.inf, "a cell is flat"), (np.nan, "could be compared")]
)
def test_entries_that_are_not_given_back_are_an_objection_though_nobody_made_one(error, words):
    verdict = judge(with_(error=error))
    assert verdict.status == "uncertified"
    assert words in verdict.reasons[0]


def test_errors_of_known_size_are_tested_elsewhere():
    assert judge(with_(error=1e-3, allowed=np.inf)).status == "certified"


@pytest.mark.parametrize("uniqueness", ["proved", "searched", "conventional", "ambiguous"])
def test_a_verdict_cannot_contradict_itself(uniqueness):
    with pytest.raises(ValueError, match="either objections or a uniqueness"):
        Verdict(uniqueness, ("why",), objections=(OBJECTION,))
    with pytest.raises(ValueError, match="either objections or a uniqueness"):
        Verdict(None, ("why",))
    with pytest.raises(FrozenInstanceError):
        judge(FITS).status = "uncertified"


def test_what_turns_up_later_is_judged_as_well():
    assert judge(FITS).despite(OBJECTION).status == "uncertified"
    assert judge(FITS).beside(ANOTHER).status == "ambiguous"
    assert judge(with_(objections=(OBJECTION,))).beside(ANOTHER).status == "uncertified"
    assert judge(FITS).beside(ANOTHER).reasons == ("so does another mesh", "it fits")


def test_better_reasons_stay_reasons_of_the_same_verdict():
    better = judge(with_(objections=(OBJECTION,))).explained("it is a network", advice="draw it")
    assert (better.status, better.reasons[0], better.advice) == ("uncertified", "it is a network", "draw it")
    assert better.reasons == tuple(said for one in better.objections for said in one.sentences)
    assert judge(FITS).explained("it is flat", "it fits").reasons == ("it is flat", "it fits")


def test_nothing_is_certified_before_it_is_judged():
    assert UNJUDGED.status == "uncertified"


def assigned(tree):
    """Names of fields of results that are set: keywords of calls, keys of dictionaries, and attributes."""
    for node in ast.walk(tree):
        match node:
            case ast.keyword(arg=str(name)):
                yield name
            case ast.Dict(keys=keys):
                yield from (key.value for key in keys if isinstance(key, ast.Constant))
            case ast.Assign(targets=targets):
                yield from (target.attr for target in targets if isinstance(target, ast.Attribute))


#: They learn something of a finished mesh that speaks against it, or explains it better, and say so by methods of its
#: verdict: that another model has its entries, or what the matrix is.
SAY_MORE = {
    "boundaries/terms.py",
    "conforming/recover.py",
    "diagnosis/scalar.py",
    "masses/beside.py",
    "masses/recover.py",
    "metric/flat.py",
    "recovery/finish.py",
}


def test_one_place_decides_on_a_status():
    """No other module sets one, or makes a verdict but by `judge`; reports tell that of a matrix without a mesh."""
    for path in sorted(ROOT.rglob("*.py")):
        name = str(path.relative_to(ROOT))
        if name.startswith("paper") or name == "certificate/verdict.py":
            continue
        tree = ast.parse(path.read_text("utf-8"))
        fields = {"status", "uniqueness", "reason"} & set(assigned(tree))
        assert "verdict" not in assigned(tree) or name in SAY_MORE, name
        assert not fields or name in ("report.py", "export.py", "exchange.py"), (name, fields)
        made = [
            node
            for node in ast.walk(tree)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Verdict"
        ]
        assert not made, name


def shuffled(matrix):
    order = np.random.default_rng(5).permutation(matrix.shape[0])
    return sp.csr_array(sp.csr_array(matrix)[order][:, order])


def planar():
    return shuffled(specimen(*random_mesh(60, seed=1)).matrix)


def stencil():
    return shuffled(poisson((6, 7), format="csr"))


def one_element():
    return asm(linear_elasticity(1.0, 1.0), Basis(MeshQuad(), ElementVector(ElementQuad1())))


def damaged():
    matrix = planar().tolil()
    i, j = (int(index[0]) for index in matrix.nonzero())
    j = j if i != j else int(matrix.nonzero()[1][1])
    matrix[i, j] = matrix[j, i] = 1.5 * matrix[i, j] + 0.1
    return matrix.tocsr()


@pytest.mark.parametrize(
    ("matrix", "status", "uniqueness"),
    [
        (planar, "certified", "proved"),
        (stencil, "certified", "conventional"),
        (one_element, "ambiguous", "ambiguous"),
        (damaged, "uncertified", None),
    ],
)
def test_results_of_each_status(matrix, status, uniqueness):
    found = recover(matrix())
    assert (found.status, found.uniqueness) == (status, uniqueness)
    assert found.reason.startswith(found.verdict.reasons[0])
    assert bool(found.verdict.objections) == (status == "uncertified")
    assert found.report()["status"] == status
    if uniqueness == "conventional":
        assert any("others" in warning and "may fit as well" in warning for warning in found.warnings)
