"""``unassemble modes``."""

from __future__ import annotations

from typing import Any

import click

from .options import check_files, matrix_options, nodes_options, recovered, spelled_numbering
from .status import outcome
from .values import OptionalTolerance


@click.command(cls=OptionalTolerance)
@matrix_options
@nodes_options
@click.option("-o", "--output", "out", metavar="OUT", required=True, help="The modes: .npy, or dense Matrix Market.")
@click.option("--petsc", metavar="FILE", help="Write the coordinates too, as a PETSc Vec in binary format.")
@click.option("--amgcl", metavar="FILE", help="Write the coordinates too, as AMGCL reads them: Matrix Market.")
@click.option("--report", metavar="FILE", help="Write a report: .json.")
@click.option("--threads", type=click.IntRange(min=1), metavar="N", help="Threads of the linear algebra libraries.")
@click.option("--quiet", is_flag=True, help="Print nothing but errors.")
def modes(
    matrix: str, out: str, petsc: str | None, amgcl: str | None, report: str | None, quiet: bool, **options: Any
) -> int:
    """Write the rigid-body modes of an elasticity matrix, for algebraic multigrid.

    One row per row of MATRIX, in its order; translations, then rotations: 3 columns in the plane, 6 in space.
    """
    options["numbering"] = spelled_numbering(options["numbering"])
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
