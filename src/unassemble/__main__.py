"""Where ``unassemble`` and ``python -m unassemble`` begin; Ctrl-C is quiet from here on, while modules load too."""

from __future__ import annotations

import sys


def run() -> None:
    """The command line."""
    try:
        from .cli import main
    except KeyboardInterrupt:
        sys.stderr.write("unassemble: interrupted\n")
        sys.exit(130)
    main(prog_name="unassemble")


if __name__ == "__main__":
    run()
