"""``unassemble inspect``."""

from __future__ import annotations

import click

from .options import matrix_options
from .status import Exit, say
from .values import OptionalTolerance


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
