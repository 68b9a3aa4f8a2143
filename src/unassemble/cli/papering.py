"""``unassemble paper``."""

from __future__ import annotations

import click

from .status import Exit, say


@click.command()
@click.option("-o", "--output", "folder", metavar="DIR", default="paper-output", show_default=True)
@click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks and details.")
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
