"""Whether coordinates are certified, and why not."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..nodes.nodal import NodalMatrix, without_trace
from ..nodes.numbering import Numbering
from ..nodes.rounded import Known, Rounding
from ..nodes.shape import SOFT
from ..tolerances import CERTIFIED
from ..words import GIVE_NUMBERING, WITHOUT_SUPPORTS, Reason, count_of, sentences
from .materials.cells import Cells
from .nullspace.placing import Solution

_MAGNIFIED = 2e-7  # residual over gap up to which they do; errors measured are a fiftieth of it at most
NOTHING_SHOWN = Reason(
    "no node is left whose rows are shown to be its own and whose coordinates hang on no assumption", GIVE_NUMBERING
)
NOTHING_LEFT = Reason(
    "each row that is whole touches nodes that are not determined, so that no identity is left to certify the others, "
    "and no elements do",
    WITHOUT_SUPPORTS,
)
NOTHING_CHECKED = Reason(
    "identities have no others to check against, so that wrong entries would go unnoticed, and no elements were found "
    "that re-assemble to the matrix",
    WITHOUT_SUPPORTS,
)
RESTS_ON_PLANES = Reason(
    "more than translation and scale is free unless nodes that lack a direction lie in planes across it, and no "
    "elements show that they do",
    WITHOUT_SUPPORTS,
)


def about_open_rows(numbering: Numbering) -> str:
    """What is not known of rows that may belong to one node with others; empty where there are none."""
    rows = 0 if numbering.open_row is None else int(numbering.open_row.sum())
    if not rows:
        return ""
    return (
        f"{count_of(rows, 'row couples', 'rows couple')} to the same unknowns as rows of other nodes, and neither "
        "order nor positions tell which of them belong together"
    )


def no_positions(why: object) -> str:
    """Why there are none, and what may be to blame where it was inferred which rows belong to one node."""
    blame = f"which rows belong to one node, and to which direction, was inferred: {GIVE_NUMBERING}"
    return sentences([f"no positions were found: {why}", blame])


def about_made_up_nodes(nodal: NodalMatrix, numbering: Numbering, solution: Solution, rounding: Rounding | None) -> str:
    """Why positions say nothing where it was inferred which rows are one node's; empty where they do.

    Fields that are left then move rows of one direction only, as if there were more nodes; and the points that belong
    to rows of several nodes are none of the body's.
    """
    lacking = _lacking(nodal) if any(solution.freedoms) and numbering.open_row is None else ""
    if lacking:
        return f"{lacking}, so that rows were not joined to nodes as they should be"
    if not solution.exact and rounding is None and numbering.incomplete and (numbering.odd or numbering.common < 1):
        return "none fit the matrix exactly, as where constraints tie unknowns together"
    return ""


def of_few_digits(
    nodal: NodalMatrix, solution: Solution, error: float, numbering: Numbering, rounding: Rounding, known: Known
) -> tuple[str, Reason]:
    """Status and reason where the entries are rounded, which is an error bar: how well positions are known."""
    objection = _to_positions(nodal, solution, numbering, exact=False) or _to_identities(nodal, solution, numbering)
    if objection:
        return "uncertified", hidden(objection, rounding)
    if np.isnan(error):
        return "uncertified", NOTHING_LEFT
    holds = f"the entries are rounded to {rounding.name}, and the identities hold to {error:.1e} (relative)"
    if not (error <= max(rounding.spread, CERTIFIED) and known.explained):
        return "uncertified", Reason(
            f"{holds}, which is more than that leaves, so that positions may be off by more than it moves them"
        )
    said = f"{holds}, which is what that leaves, so that positions are known to {known.error:.0e} of the size"
    return (
        ("certified", Reason(said)) if known.error <= rounding.needed else ("uncertified", Reason(said, _MORE_DIGITS))
    )


def hidden(reason: Reason, rounding: Rounding) -> Reason:
    """A reason not to certify rounded entries, with what may be behind it."""
    return replace(reason, advice=f"{_MORE_DIGITS}: they are rounded to {rounding.name}, which may hide what rows lack")


_MORE_DIGITS = "write the entries with more digits"
_FREEDOMS = {
    "axes": "each axis keeps a scale of its own",
    "affine": "an affine map stays free, since the material around every valid row is homogeneous",
}


def verdict(
    nodal: NodalMatrix, solution: Solution, error: float, found: Cells, numbering: Numbering
) -> tuple[str, Reason]:
    """Status and reason, by the largest residual of a valid identity and the cells that were found."""
    objection = _to_positions(nodal, solution, numbering)
    if objection:
        return "uncertified", objection
    if found.certified and found.backward_error <= CERTIFIED:
        count = count_of(sum(map(len, found.blocks.values())), "element")
        return "certified", Reason(f"the matrix re-assembled on the {count} is the given one")
    nearly = _softest(solution)
    objection = _to_identities(nodal, solution, numbering)
    if objection:
        return "uncertified", objection
    if np.isnan(error):
        return "uncertified", NOTHING_LEFT
    if error > CERTIFIED:
        return "uncertified", Reason(f"the largest residual of a valid identity is {error:.1e} (relative)")
    if error > _MAGNIFIED * nearly:
        return "uncertified", Reason(
            f"the valid identities hold to {error:.1e} (relative), but a field that is no translation or scale "
            f"satisfies them up to {nearly:.1e}: nodes that it moves may be wrong by more than 1e-8"
        )
    return "certified", Reason("the valid identities hold to rounding, and only translations and scale satisfy them")


def _softest(solution: Solution) -> float:
    """Least singular value of a field that is no translation or scale."""
    return min((one.gap for one in solution.evidence if one.gap > 0), default=1.0)


def _to_positions(nodal: NodalMatrix, solution: Solution, numbering: Numbering, *, exact: bool = True) -> Reason | None:
    """Why positions may be wrong whatever elements say; None where nothing is to be said.

    Entries that are rounded have no `exact` null vector.
    """
    remaining = [_FREEDOMS[name] for name in solution.freedoms if name]
    if remaining:
        unless = "or rows belong to other nodes than was inferred" if numbering.inferred else ""
        larger = f"the null space is larger than it should be: {remaining[0]}"
        return Reason.of(larger, unless, advice=GIVE_NUMBERING if unless else WITHOUT_SUPPORTS)
    if exact and not solution.exact:
        worst = max(solution.evidence, key=lambda one: one.residual)
        return Reason.of(
            f"no exact null vector exists (singular value {worst.residual:.1e}, that of the next field "
            f"{worst.gap:.1e})",
            "the points are the best fit, as for materials that are not isotropic, elements that do not reproduce "
            "linear functions, or nodes that constraints tie together",
        )
    if _softest(solution) < SOFT:
        return Reason.of(
            f"a field that is no translation or scale satisfies the identities up to {_softest(solution):.1e}, and "
            "nodes that it moves may be wrong by more than 1e-8",
            "slender bodies have such fields, and nodes that few rows hold",
        )
    if _torn(nodal, solution):
        return Reason.of(
            "coupled nodes came out as separate pieces, and how these lie to each other is not known",
            "rows between them lack entries, or belong to other axes, as at inclined supports, or to other nodes",
            advice=GIVE_NUMBERING,
        )
    return None


def _to_identities(nodal: NodalMatrix, solution: Solution, numbering: Numbering) -> Reason | None:
    """Why identities alone, without elements that re-assemble, certify nothing; None where they do."""
    if solution.straight:
        return Reason(
            "elements told the axes of a homogeneous body, but re-assembled on them the matrix is not the given one"
        )
    if numbering.likely:
        return Reason.of(
            "which rows belong to one node was inferred, where some nodes lack rows and others do not store entries "
            "that vanished",
            "only elements that re-assemble to the matrix would show that it is right",
            advice=GIVE_NUMBERING,
        )
    lacking = _lacking(nodal)
    return Reason(f"{lacking}: its rows belong to other nodes", GIVE_NUMBERING) if lacking else None


def _lacking(nodal: NodalMatrix) -> str:
    """How many nodes lack directions without a trace, doubtful ones aside, which get no coordinates; empty for none."""
    odd = int(np.count_nonzero(without_trace(nodal).any(axis=1) & ~nodal.doubtful))
    nodes = count_of(odd, "node lacks", "nodes lack")
    return f"{nodes} directions although no row next to it misses anything" if odd else ""


def _torn(nodal: NodalMatrix, solution: Solution) -> bool:
    """Whether nodes of different pieces are connected through the matrix."""
    live = (nodal.data != 0).any(axis=(1, 2))
    link = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    label = sp.csgraph.connected_components(link, directed=False)[1]
    known = solution.component >= 0
    pairs = np.unique(np.column_stack([label, solution.component])[known], axis=0)
    return len(np.unique(pairs[:, 0])) < len(pairs)
