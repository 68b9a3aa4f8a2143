"""Whether coordinates are certified, and why not."""

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from ..certificate import BodyCertificate
from ..nodes.nodal import NodalMatrix, without_trace
from ..nodes.numbering import NodeNumbering
from ..nodes.rounded import Known, Rounding
from ..nodes.shape import SOFT
from ..tolerances import CERTIFIED, SMALL
from ..words import GIVE_NUMBERING, WITHOUT_SUPPORTS, Reason, count_of, sentences
from .materials.cells import RecognisedCells
from .nullspace.placing import Solution

_MAGNIFIED = 2e-7  # residual over gap up to which they do; errors measured are a fiftieth of it at most
NOTHING_CHECKED = Reason(
    "no identities have others to check against, and no elements re-assemble", advice=WITHOUT_SUPPORTS
)
NOTHING_COMPARED = Reason(
    "no row of the matrix could be compared with the elements: next to each node others lack a position, or are gone",
    advice=WITHOUT_SUPPORTS,
)
RESTS_ON_PLANES = Reason(
    "too much is free unless nodes that lack a direction lie in planes across it, and no elements show that they do",
    advice=WITHOUT_SUPPORTS,
)

WEAK_AND_UNKNOWN = Reason(
    "neighbouring nodes differ in stiffness by more than six digits, and no elements were found that explain it",
    advice="write the entries with all their digits, or leave weak elements out",
)


def no_positions(why: object) -> str:
    """Why there are none, and what may be to blame where it was inferred which rows belong to one node."""
    blame = f"which rows belong to one node, and to which direction, was inferred: {GIVE_NUMBERING}"
    return sentences([f"no positions were found: {why}", blame])


def hidden_elements(count: int) -> Reason:
    """That rounding hides whether weak elements are there."""
    weak = count_of(count, "element is", "elements are")
    return Reason(f"{weak} so weak beside others of the same nodes that rounding of the entries hides the material")


def hidden_by_digits(count: int) -> str:
    """That few digits hide weak elements, where there may be none."""
    weak = "so weak that rounding of the entries hides them, or there are holes in their places"
    return f"{count_of(count, 'element')} may be missing, or of another material than is said: {weak}"


def against_body(
    certificate: BodyCertificate, foreign: NDArray[np.int64], allowed: NDArray[np.float64]
) -> Iterator[Reason]:
    """What the certificate says against a body as it is written.

    Errors are `allowed` by row, (N,); `foreign` are entries (k, 2) that elements leave and no others have.
    """
    if not len(certificate.misfits):
        yield NOTHING_CHECKED if certificate.remainder is None else NOTHING_COMPARED
    wrong = np.flatnonzero(~(certificate.misfits <= certificate.bounds(allowed)))
    if len(wrong):
        worst = wrong[np.argmax(certificate.misfits[wrong])]
        rows = count_of(len(np.unique(certificate.pairs[wrong, 0])), "row")
        most = f"row {certificate.pairs[worst, 0]} is off by {certificate.misfits[worst]:.1e} of its largest entry"
        yield Reason(f"the body as it is written does not give {rows} of the matrix back: {most}")
    elif len(foreign):
        row, column = foreign[0]
        at = f"rows {row} and {column}" if row != column else f"row {row}"
        yield Reason(
            f"the elements leave an entry in {at} that no other element or spring has",
            "an entry is wrong there, or an element is missing",
            advice="check the entries of these rows",
        )


def given_back(sure: str, error: float, beside: int, order: int, *, exact: bool) -> tuple[str, ...]:
    """What speaks for a body of which so many rows `beside` supports, of all, were not compared.

    `sure` is what was known before the body was compared with its matrix, which left some `error`.
    """
    if not beside:
        return (sure,)
    rows = f"the elements give back {order - beside:,} of the {order:,} rows of the matrix to {error:.1e}"
    compared = f"{rows}, and nothing is known to be wrong in the others"
    return (compared,) if exact else (sure, compared)


def beside_cells(count: int) -> str:
    """That rows next to supports are not explained by the elements that are listed."""
    rows = count_of(count, "row is", "rows are")
    lost = f"{rows} not compared: they are next to supports, where elements may have lost nodes"
    return f"{lost}. An element all of whose nodes lie there may be missing from the list"


def examined(
    nodal: NodalMatrix,
    solution: Solution,
    error: float,
    found: RecognisedCells,
    numbering: NodeNumbering,
    rounding: Rounding | None,
    known: Known | None,
) -> tuple[str, list[Reason]]:
    """What speaks for positions, in a sentence, and what against them.

    By the largest residual of a valid identity and the cells that were found. `rounding` of entries is an error bar:
    how well positions are `known` with it, None where that was not asked.
    """
    holds = f"the valid identities hold to {error:.1e} (relative)"
    shown = known is None and found.certified and found.backward_error <= CERTIFIED
    objections = list(_to_positions(nodal, solution, numbering, exact=known is None))
    if not shown:
        objections += _to_identities(nodal, solution, error, numbering)
    if shown:
        count = count_of(sum(map(len, found.blocks.values())), "element")
        sure = f"the matrix re-assembled on the {count} is the given one"
        soft = error > _MAGNIFIED * _softest(solution) and contrast(nodal) > 1 / SMALL
        objections += [_soft(solution)] if soft else []
    elif rounding and known:
        sure = holds + known.within(rounding)
        objections += known.objections(error, rounding, holds)
    else:
        sure = "the valid identities hold to rounding, and only translations and scale satisfy them"
        objections += [Reason(holds)] if error > CERTIFIED else []
        objections += [_soft(solution)] if error > _MAGNIFIED * _softest(solution) else []
    if objections and rounding:
        more = f"write more digits of the entries: they are rounded to {rounding.name}, which may hide what rows lack"
        objections[0] = objections[0].but(advice=more)
    return sure, objections


def contrast(nodal: NodalMatrix) -> float:
    """How many times the rows of one node are larger than those of another to which it is coupled, at most."""
    i, j = nodal.node, nodal.indices
    live = (nodal.data != 0).any(axis=(1, 2)) & (nodal.size[i] > 0) & (nodal.size[j] > 0)
    return float((nodal.size[i[live]] / nodal.size[j[live]]).max(initial=1.0))


def _softest(solution: Solution) -> float:
    """Least singular value of a field that is no translation or scale."""
    return min((one.gap for one in solution.evidence if one.gap > 0), default=1.0)


def _soft(solution: Solution) -> Reason:
    """That such a field is next to nothing."""
    free = (
        f"a field that is no translation or scale satisfies the identities up to {_softest(solution):.1e}, and nodes "
    )
    return Reason(free + "that it moves may be wrong", "slender bodies have such fields, and nodes that few rows hold")


def _to_positions(nodal: NodalMatrix, solution: Solution, numbering: NodeNumbering, *, exact: bool) -> Iterator[Reason]:
    """Why positions may be wrong whatever elements say; entries that are rounded have no `exact` null vector."""
    if any(solution.freedoms):
        unless = "or rows belong to other nodes than was inferred" if numbering.inferred else ""
        larger = "an affine map stays free, since the material around every valid row is homogeneous"
        yield Reason(larger, unless, advice=GIVE_NUMBERING if unless else WITHOUT_SUPPORTS)
    if exact and not solution.exact:
        worst = max(solution.evidence, key=lambda one: one.residual)
        yield Reason(
            f"no exact null vector exists (singular value {worst.residual:.1e}, of the next field {worst.gap:.1e})",
            "the points are the best fit, as of materials that are not isotropic, or nodes that are tied together",
        )
    if _softest(solution) < SOFT:
        yield _soft(solution)
    if _torn(nodal, solution):
        torn = "coupled nodes came out as separate pieces, and how these lie to each other is not known"
        yield Reason(torn, "rows between them lack entries, or belong to other axes or nodes", advice=GIVE_NUMBERING)


def _to_identities(nodal: NodalMatrix, solution: Solution, error: float, numbering: NodeNumbering) -> Iterator[Reason]:
    """Why identities alone, without elements that re-assemble, certify nothing."""
    if solution.straight:
        yield Reason("elements told the axes of a homogeneous body, but re-assembled the matrix is not the given one")
    if numbering.likely:
        likely = "which rows belong to one node was inferred, and no elements that re-assemble show that it is right"
        yield Reason(likely, advice=GIVE_NUMBERING)
    # Without a trace, doubtful ones aside, which get no coordinates.
    odd = int(np.count_nonzero(without_trace(nodal).any(axis=1) & ~nodal.doubtful))
    if odd:
        nodes = count_of(odd, "node lacks", "nodes lack")
        lacking = f"{nodes} directions although no row next to it misses anything: its rows belong to other nodes"
        yield Reason(lacking, advice=GIVE_NUMBERING)
    if np.isnan(error):
        yield NOTHING_CHECKED


def _torn(nodal: NodalMatrix, solution: Solution) -> bool:
    """Whether nodes of different pieces are connected through the matrix."""
    live = (nodal.data != 0).any(axis=(1, 2))
    link = sp.csr_array((np.ones(live.sum()), (nodal.node[live], nodal.indices[live])), shape=(nodal.n, nodal.n))
    label = sp.csgraph.connected_components(link, directed=False)[1]
    known = solution.component >= 0
    pairs = np.unique(np.column_stack([label, solution.component])[known], axis=0)
    return len(np.unique(pairs[:, 0])) < len(pairs)
