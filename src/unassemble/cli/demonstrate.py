"""``unassemble demo``."""

from __future__ import annotations

import click

from .status import Exit, say


@click.command()
@click.option("-o", "--output", "folder", metavar="DIR", default="demo-output", show_default=True)
@click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks and details.")
def demo(folder: str) -> int:
    """Recover two matrices that this library did not assemble, and a lattice mast.

    Matrices, meshes, reports and pictures of true and recovered mesh go to a folder.
    """
    from ..demo import run

    recoveries = run(folder, echo=say)
    return Exit.CERTIFIED if all(recovery.certified for recovery in recoveries) else Exit.UNCERTIFIED
