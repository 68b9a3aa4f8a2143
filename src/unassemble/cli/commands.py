"""The commands: ``unassemble recover``, ``inspect``, ``modes``, ``demo`` and ``paper``."""

from typing import Any

import click

from .options import (
    OPERATORS,
    Numbers,
    OptionalTolerance,
    check_files,
    folder_options,
    matrix_options,
    recovered,
    recovery_options,
    target,
)
from .status import Exit, outcome, say


@click.command(cls=OptionalTolerance)
@matrix_options
@recovery_options
@click.argument("out", metavar="[OUT]", required=False)
@click.option("-o", "--output", metavar="OUT", help="The mesh: .npz, or any format of meshio.")
@click.option("--operator", type=click.Choice(OPERATORS), default="auto", show_default=True)
@click.option("--method", type=click.Choice(["conformal", "angles"]), help="The default picks the best.")
@click.option("--no-refine", is_flag=True, help="Leave out the polish.")
@click.option("--scale", type=float, metavar="C", help="The factor c is known.")
@click.option("--noise", type=float, metavar="SIGMA", help="Standard deviation of the entries, for a chi-square test.")
@click.option(
    "--anchor",
    "anchors",
    type=Numbers("ROW,X,Y[,Z]"),
    multiple=True,
    help="A known position, repeatable: two fix a similarity, a third, not in line, the mirror image.",
)
@click.option(
    "--tensor",
    type=Numbers("KXX,KXY,KYY"),
    help="Constant anisotropy to undo; needs an orientation: three anchors, or --direction with --handed.",
)
@click.option(
    "--direction", type=Numbers("ROW,ROW,DEGREES"), help="Angle from the x axis of the line between two rows."
)
@click.option("--handed", type=click.Choice(["left", "right"]), help="Side of that line on which the centroid lies.")
@click.option("--realise", is_flag=True, help="Surfaces: coordinates in space.")
@click.option(
    "--mass", metavar="FILE", help="The mass matrix of the same mesh: it tells the size, or with anchors the density."
)
@click.option("--triangulate", is_flag=True, help="Divide cells that the matrix leaves undivided.")
@click.option("--standard-deviations", is_flag=True, help="Error bars of the coordinates.")
@click.option("--plot", metavar="FILE", help="Write a picture: .png, .svg or .pdf.")
def recover(
    matrix: str, out: str | None, output: str | None, report: str | None, plot: str | None, quiet: bool, **options: Any
) -> int:
    """Recover the mesh of MATRIX and write it to OUT.

    MATRIX belongs to a scalar operator on a mesh of the plane or on a surface, to elasticity in the plane or in space,
    or to a structure of bars, beams and shells.

    MATRIX is Matrix Market (also .gz), scipy's .npz, NumPy's .npy, MATLAB's .mat, or lines of row, column and entry; -
    reads Matrix Market from standard input. Rows count from 0. Without OUT the mesh goes to a .vtu beside MATRIX, if
    there is none yet; lengths or areas without positions to a .mesh.npz.
    """
    unnamed = out is None and output is None
    out = target(matrix, out, output)
    options["refine"] = not options.pop("no_refine")
    from ..export import check_output
    from ..files import check_plot
    from ..formats import lacks_worth
    from ..progress import StageDisplay
    from ..report import check_report, write_report

    check_files(matrix, {"OUT": (out, check_output), "--report": (report, check_report), "--plot": (plot, check_plot)})
    with StageDisplay(enabled=not quiet) as display:
        recovery = recovered(matrix, report, progress=display, **options)
        if unnamed and recovery.shapeless:
            out = target(matrix, None, None, ".mesh.npz")
        display("write")
        recovery.save(out)
        if report is not None:
            write_report(recovery, report)
        if plot is not None:
            display("plot")
            recovery.plot(plot)
    return outcome(recovery, [out, report, plot], quiet=quiet, lacking=lacks_worth(out))


@click.command(cls=OptionalTolerance)
@matrix_options
@click.option("--json", "as_json", is_flag=True, help="For programs.")
def inspect(matrix: str, variable: str | None, drop_zeros: float | None, as_json: bool) -> int:
    """Say what MATRIX is and what can be recovered from it.

    The exit status is 0 whenever the matrix could be described, even if nothing can be recovered.
    """
    import json

    from ..inspection import inspect_matrix
    from ..progress import StageDisplay

    with StageDisplay() as display:
        display("read")
        facts = inspect_matrix(matrix, variable=variable, drop_zeros=drop_zeros)
    say(json.dumps(facts.to_dict(), indent=2, allow_nan=False) if as_json else str(facts))
    return Exit.CERTIFIED


@click.command(cls=OptionalTolerance)
@matrix_options
@recovery_options
@click.option("-o", "--output", "out", metavar="OUT", required=True, help="The modes: .npy, or dense Matrix Market.")
@click.option("--petsc", metavar="FILE", help="Write the coordinates too, as a PETSc Vec in binary format.")
@click.option("--amgcl", metavar="FILE", help="Write the coordinates too, as AMGCL reads them: Matrix Market.")
def modes(
    matrix: str, out: str, petsc: str | None, amgcl: str | None, report: str | None, quiet: bool, **options: Any
) -> int:
    """Write the rigid-body modes of an elasticity matrix, for algebraic multigrid.

    One row per row of MATRIX, in its order; translations, then rotations: 3 columns in the plane, 6 in space.
    """
    from ..files import check_target
    from ..modes import check_modes, save_amgcl_coordinates, save_modes, save_petsc_vec
    from ..progress import StageDisplay
    from ..report import check_report, write_report

    files = {"OUT": (out, check_modes), "--petsc": (petsc, check_target), "--amgcl": (amgcl, check_target)}
    check_files(matrix, {**files, "--report": (report, check_report)})
    with StageDisplay(enabled=not quiet) as display:
        recovery = recovered(matrix, report, operator="elasticity", cells=False, progress=display, **options)
        display("write")
        found = recovery.rigid_body_modes()
        if petsc is not None:
            save_petsc_vec(petsc, recovery.points)
        if amgcl is not None:
            save_amgcl_coordinates(amgcl, recovery.points)
        if report is not None:
            write_report(recovery, report)
        save_modes(out, found)  # last: what cannot be written spoils nothing
    return outcome(recovery, [out, petsc, amgcl, report], quiet=quiet)


@click.command()
@folder_options("demo-output")
def demo(folder: str) -> int:
    """Recover two matrices that this library did not assemble, and a lattice mast.

    Matrices, meshes, reports and pictures of true and recovered mesh go to a folder.
    """
    from unassemble_demo import run

    recoveries = run(folder, echo=say)
    return Exit.CERTIFIED if all(recovery.certified for recovery in recoveries) else Exit.UNCERTIFIED


@click.command()
@folder_options("paper-output")
def paper(folder: str) -> int:
    """Regenerate Figures 2 to 12 of the 2002 paper.

    With them go a table of its claims beside what is measured, a comparison with the direct method, and the tables of
    further experiments; it takes some minutes.
    """
    from unassemble_paper import regenerate

    from ..planar.conformal import conformal_map

    made = regenerate(folder, conformal_map)
    for table in made.tables:
        say(table.markdown())
    say("\n".join(click.format_filename(path) for path in made.files))
    return Exit.CERTIFIED
