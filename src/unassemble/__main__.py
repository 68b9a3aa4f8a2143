"""``python -m unassemble`` is the command line."""

from .cli import main

main(prog_name="unassemble")
