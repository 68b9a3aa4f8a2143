"""Read the classic test matrices of a folder: the gallery page, its small pictures, and the first one of the README.

python docs/make_classics.py [FOLDER]

FOLDER has files NAME.mtx.gz, as the SuiteSparse Matrix Collection and Matrix Market give them (gzipped); by default it
is shared/classics beside the checkout. The matrices are not part of this project.
"""

import re
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from unassemble import Recovery, UnassembleError, inspect_matrix, recover

HERE = Path(__file__).parent
FOLDER = HERE.parents[1] / "shared" / "classics"
PICTURES = HERE / "_static" / "classics"
FIRST = "nos5"
INK = "#16324f"

# What collections say, in our words.
SAID = {
    "LF10": "linearised beam, a model-reduction benchmark (Oberwolfach)",
    "LFAT5": "linearised beam, a model-reduction benchmark (Oberwolfach)",
    "bcsstk01": "small test structure (Boeing)",
    "bcsstk02": "small oil rig, statically condensed (Boeing)",
    "bcsstk03": "small test structure (Boeing)",
    "bcsstk04": "oil rig, not condensed (Boeing)",
    "bcsstk05": "transmission tower (Boeing)",
    "bcsstk06": "medium test structure (Boeing)",
    "bcsstk08": "television studio (Boeing)",
    "bcsstk09": "square plate, clamped (Boeing)",
    "bcsstk10": "buckling of a hot washer (Boeing)",
    "bcsstk11": "ore car (Boeing)",
    "bcsstk14": "roof of the Omni Coliseum, Atlanta (Boeing)",
    "bcsstk19": "part of a suspension bridge (Boeing)",
    "bcsstk20": "frame within a suspension bridge (Boeing)",
    "bcsstk22": "textile loom frame (Boeing)",
    "bcsstk26": "seismic analysis of a nuclear power station, containment floor (Boeing)",
    "bcsstk34": "buckling of a square plate (Boeing)",
    "bcsstm07": "mass matrix, medium test structure (Boeing)",
    "bcsstm08": "mass matrix, television studio (Boeing)",
    "bcsstm10": "mass matrix, buckling of a hot washer (Boeing)",
    "bcsstm12": "mass matrix, ore car (Boeing)",
    "bcsstm13": "mass matrix, fluid flow (Boeing)",
    "ex1": "flow, FIDAP",
    "ex3": "flow, FIDAP",
    "ex5": "flow, FIDAP",
    "ex13": "flow, FIDAP",
    "fv2": "finite volumes, nine points (Norris)",
    "gr_30_30": "nine-point star on a grid of 30 by 30 (Grimes)",
    "lund_a": "eigenvalue problem (Lund)",
    "nasa1824": "structure (NASA Langley)",
    "nos1": "beam, biharmonic operator (Lanczos)",
    "nos2": "beam, biharmonic operator (Lanczos)",
    "nos3": "plate, biharmonic operator (Lanczos)",
    "nos4": "beam structure (Lanczos)",
    "nos5": "building of three storeys with a tower (Lanczos)",
    "nos6": "Poisson's equation, L-shape, mixed boundary (Lanczos)",
    "nos7": "Poisson's equation in a cube, coefficients vary (Lanczos)",
    "plat362": "oceanographic model (Platzman)",
    "rail_109_M": "steel rail, heat equation, mass matrix (Oberwolfach)",
    "rail_109_S": "steel rail, heat equation, stiffness matrix (Oberwolfach)",
    "rail_371_A": "steel rail, refined, with Robin terms (Oberwolfach)",
    "rail_371_E": "steel rail, refined, mass matrix (Oberwolfach)",
    "rail_371_M": "steel rail, refined, mass matrix (Oberwolfach)",
    "rail_371_S": "steel rail, refined, stiffness matrix (Oberwolfach)",
    "s1rmq4m1": "cylindrical shell, quadrilaterals, R/t = 10 (Kouhia)",
    "s1rmt3m1": "cylindrical shell, triangles, R/t = 10 (Kouhia)",
    "s3rmt3m3": "cylindrical shell, triangles, R/t = 1000 (Kouhia)",
    "wathen_30_30": "random consistent mass matrix of serendipity quadrilaterals (Wathen, Higham)",
}
# What came back beside what the collections say, where both can be compared.
AGREES = {
    "bcsstk02": "yes: condensed",
    "bcsstk08": "yes: a building of several floors",
    "bcsstk09": "yes: a grid of 19 by 19 nodes",
    "bcsstk10": "yes: half a washer",
    "bcsstk22": "in part: two beams of eight nodes each",
    "bcsstk26": "yes: a sector of a floor; all coordinates are whole hundredths, to 1e-7 of these",
    "bcsstk34": "no: a cylinder",
    "ex1": "in part: a saddle point",
    "ex3": "in part: two velocities in each node",
    "ex13": "in part: two velocities in each node",
    "lund_a": "a plate",
    "LF10": "yes: a straight beam",
    "LFAT5": "yes: a straight beam",
    "bcsstk04": "yes: a frame in space, narrower at the top",
    "bcsstk05": "yes: bars in space, a lattice mast",
    "bcsstk11": "yes: a trough with ribs, in four bays",
    "bcsstk19": "yes: cables from pylons to a deck",
    "bcsstm10": "no: it has negative eigenvalues, as no mass matrix has, and rows that add up to zero; of a buckling "
    "problem it is more likely the matrix of initial stresses",
    "ex5": "in doubt: the elements named are those that its graph shows",
    "gr_30_30": "yes, and it is that of bilinear elements on squares, times 3, without its boundary",
    "nos1": "yes: a straight beam",
    "nos2": "yes: a straight beam",
    "nos3": "yes: a grid of 24 by 20 nodes",
    "nos4": "yes: bars in the plane",
    "nos5": "yes: storeys, and a tower on one side",
    "rail_109_S": "yes: the profile of half a rail",
    "rail_371_S": "yes: the profile of half a rail",
    "rail_371_A": "yes: the same profile, of which points whose rows have Robin terms are plausible only",
    **dict.fromkeys(("s1rmq4m1", "s1rmt3m1"), "yes: part of a cylinder"),
    **dict.fromkeys(("rail_109_M", "rail_371_E", "rail_371_M"), "yes: areas of triangles"),
    **dict.fromkeys(("bcsstm07", "bcsstm12", "bcsstm13", "wathen_30_30"), "yes: named, and refused"),
    "bcsstm08": "yes: lumped, so that it has no couplings",
}

# What keeps matrices from being certified, where the program does not say it all; most of it is measured again in
# tests/structures/test_not_certified.py.
PENALTY = (
    "Cells have 18 unknowns and neighbours share 6, as nine-node quadrilaterals with two velocities each; "
    "eigenvalues range over ten orders of magnitude and more, as with a penalty for incompressibility, behind "
    "which the rows that tell positions are lost."
)
WHY = {
    "bcsstk02": "A platform above the sea, of which 22 nodes were kept: the supports of all legs are in every row.",
    "bcsstk08": "Seven floors are rigid, with three unknowns each (rows 3 to 5, 180 to 182, ...), which couple to up "
    "to 338 others. Two thirds of the rows that couple to several floors annihilate equal displacements "
    "of all of them; but the nodes have lost their own horizontal displacements, and with these the "
    "equations of rotations.",
    "bcsstk09": "All nodes of its boundary are held, and its cells are alike: a spring against rotations that is the "
    "same everywhere would look as another size does.",
    "bcsstk10": "Half a washer, 37 rays of six nodes, in polar axes: with axes turned by 5 degrees from ray to ray "
    "half of the rows inside annihilate translations to 4e-13; along common axes they do not, and the "
    "program knows no others.",
    "bcsstk22": "Two beams are seen, of eight nodes each at equal distances; nodes of what holds them lack unknowns.",
    "bcsstk34": "A closed cylinder of rings of ten nodes, in cylindrical axes: with axes turned by 36 degrees from "
    "node to node rows annihilate translations to 4e-8, along common axes they do not, and the program "
    "knows no others. Nodes that are alike have diagonals that differ by 1e-6.",
    "ex3": PENALTY,
    "ex13": PENALTY,
    "lund_a": "Computed in single precision: equal diagonals of 7.5e7 differ by 16, one unit of the last of 24 "
    "bits, and what should be zero are multiples of a power of two. Rows annihilate translations to 1e-7 "
    "only.",
    "nasa1824": "Damaged: the diagonals of rows 196 to 215 are below 1e-5 and grow with their place like numbers of "
    "rows; twenty eigenvalues are negative.",
}


@dataclass(frozen=True)
class Read:
    """A matrix, and what the program made of it."""

    name: str
    rows: int
    kind: str
    found: Recovery | None
    said: str


def read(path: Path) -> Read:
    name = path.name.removesuffix(".mtx.gz")
    rows = scipy.io.mminfo(path)[0]
    try:
        kind = inspect_matrix(path).operator
    except UnassembleError:
        kind = ""
    try:
        found = recover(path)
    except UnassembleError as error:
        return Read(name, rows, kind, None, str(error))
    return Read(name, rows, found.operator, found, found.reason)


def placed(found: Recovery) -> int:
    return int(np.isfinite(found.points).all(axis=1).sum())


def outcome(one: Read) -> str:
    if one.found is None:
        return "refused"
    share = re.search(r"\d+% of the rows(?= say so)", one.said)
    sizes = [f"{placed(one.found):,} of {one.found.n_points:,} nodes"]
    sizes += [f"{len(cells):,} {kind}s" for kind, cells in one.found.cells.items()]
    return f"{one.found.status}: {one.kind}; {', '.join(sizes)}" + (f"; {share[0]}" if share else "")


def drawn(found: Recovery, ax: Axes) -> None:
    found.plot(ax=ax)
    legend = ax.get_legend()
    if legend is not None:
        legend.remove()
    ax.set_title("")
    ax.axis("off")


def picture(one: Read) -> str:
    """The name of a small picture; empty where there is nothing to see."""
    if one.found is None or not placed(one.found):
        return ""
    figure = Figure(figsize=(3, 2.2), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    drawn(one.found, figure.subplots())
    PICTURES.mkdir(exist_ok=True)
    figure.savefig(PICTURES / f"{one.name}.png", pil_kwargs={"optimize": True})
    return f"![{one.name}](_static/classics/{one.name}.png)"


def first_picture(one: Read, matrix: Path) -> None:
    """Spy plot on the left, what it is on the right."""
    assert one.found is not None
    A = scipy.io.mmread(matrix).tocoo()
    figure = Figure(figsize=(10, 3.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2, width_ratios=[1, 2])
    left.scatter(A.col, A.row, s=0.3, c=INK, linewidths=0)
    left.set(aspect="equal", xlim=(0, A.shape[0]), ylim=(A.shape[0], 0), xticks=[], yticks=[])
    left.set_title(f"in: {one.name}, {A.shape[0]:,} rows", fontsize=11)
    drawn(one.found, right)
    right.set_title(f"out: {SAID[one.name].split(' (')[0]}, {one.found.status}", fontsize=11)
    figure.savefig(HERE / "_static" / "classic.png", pil_kwargs={"optimize": True})


def cell(text: str) -> str:
    return text.replace("|", r"\|").replace("\n", " ")


def page(results: list[Read]) -> str:
    certified = sum(one.found is not None and one.found.certified for one in results)
    lines = [
        "# Classic matrices",
        "",
        "Test matrices of the Harwell-Boeing, Matrix Market, SuiteSparse and Oberwolfach collections: solvers have "
        f"been measured on them for up to forty years, and no collection has their meshes. Of these {len(results)}, "
        f"{certified} are certified. The page is written by `docs/make_classics.py`, from copies of the matrices "
        "that are not part of this project; descriptions are those of the collections, shortened, some from memory.",
        "",
        "A certificate covers the share of the rows that it names: other rows may be right, and are not claimed. "
        "What is not certified has its reason, in the program's own words; what that says of a matrix is what its "
        "entries show, and the collections' descriptions were not known to it. In italics is what else was "
        "found out by hand; tests measure most of that again. The last column compares with the collection.",
        "",
        "| matrix | rows | what it is, by its collection | what came back | agrees |",
        "|---|---|---|---|---|",
    ]
    reasons = ["", "## Why not certified", ""]
    for one in results:
        shown = picture(one)
        lines.append(
            f"| **{one.name}** {shown} | {one.rows:,} | {SAID.get(one.name, '')} | {cell(outcome(one))} "
            f"| {AGREES.get(one.name, '')} |"
        )
        if one.found is None or not one.found.certified:
            more = f" *{WHY[one.name]}*" if one.name in WHY else ""
            reasons.append(f"- **{one.name}**: {cell(one.said)}.{more}")
    return "\n".join([*lines, *reasons]) + "\n"


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    for old in PICTURES.glob("*.png"):
        old.unlink()
    results = [read(path) for path in sorted(folder.glob("*.mtx.gz"))]
    (HERE / "gallery.md").write_text(page(results), encoding="utf-8")
    for one in results:
        if one.name == FIRST:
            first_picture(one, folder / f"{one.name}.mtx.gz")


if __name__ == "__main__":
    main()
