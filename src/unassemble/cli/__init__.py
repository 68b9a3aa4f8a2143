"""The command line. Only click is imported at start; the rest when a command needs it."""

import click

from .._version import __version__
from .commands import demo, inspect, modes, paper, recover
from .options import spelled_out
from .status import CommandLine, as_typed, flags_of

__all__ = ["as_typed", "flags_of", "main", "spelled_out"]


# A backspace keeps click from running the lines together.
_HELP = """Turn a sparse matrix back into the mesh it was assembled on.

'unassemble A.mtx' is short for 'unassemble recover A.mtx'.

\b
Exit status:
  0    recovered and certified
  1    internal error
  2    bad usage, or a file that cannot be read as a matrix
  3    a mesh was written, but is ambiguous or uncertified
  4    no mesh can be recovered, or the format cannot hold it; nothing written
  130  interrupted; nothing written
"""


@click.group(cls=CommandLine, context_settings={"help_option_names": ["-h", "--help"]}, help=_HELP)
@click.version_option(__version__, prog_name="unassemble")
def main() -> None:
    """All commands."""


for command in (recover, inspect, modes, demo, paper):
    main.add_command(command)
