"""``unassemble modes``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from .options import matrix_options, nodes_options, refuse_shared, spelled_numbering
from .status import outcome
from .values import OptionalTolerance

if TYPE_CHECKING:
    from ..recovery import Recovery


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
    files = {"OUT": out, "--petsc": petsc, "--amgcl": amgcl, "--report": report}
    _check_files(matrix, files)

    import unassemble

    from ..progress import StageDisplay
    from ..report import failure_report, write_report

    with StageDisplay(enabled=not quiet) as display:
        try:
            recovery = unassemble.recover(matrix, operator="elasticity", cells=False, progress=display, **options)
        except unassemble.RecoveryError as error:
            if report is not None:
                write_report(failure_report(error), report)
            raise
        display("write")
        _write(recovery, files)
    return outcome(recovery, [name for name in files.values() if name is not None], quiet=quiet)


def _check_files(matrix: str, files: dict[str, str | None]) -> None:
    """Everything that can be known to fail, before the long work."""
    from ..elasticity.modes import check_modes
    from ..files import check_target
    from ..report import check_report

    checks = {"OUT": check_modes, "--petsc": check_target, "--amgcl": check_target, "--report": check_report}
    for role, name in files.items():
        if name is not None:
            checks[role](name)
    refuse_shared({"MATRIX": matrix, **files})


def _write(recovery: Recovery, files: dict[str, str | None]) -> None:
    """Modes last: what cannot be written spoils nothing."""
    from ..elasticity.modes import save_amgcl_coordinates, save_modes, save_petsc_vec
    from ..report import write_report

    found = recovery.rigid_body_modes()
    if files["--petsc"] is not None:
        save_petsc_vec(files["--petsc"], recovery.points)
    if files["--amgcl"] is not None:
        save_amgcl_coordinates(files["--amgcl"], recovery.points)
    if files["--report"] is not None:
        write_report(recovery, files["--report"])
    if files["OUT"] is not None:
        save_modes(files["OUT"], found)
