"""Where ``unassemble`` and ``python -m unassemble`` begin; Ctrl-C is quiet from here on, while modules load too."""

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
    try:
        run()
    finally:
        # Of a signal that fell into an exec of text (modules that make classes have some) Python keeps a note until
        # the next exec of text, and ``python -m`` would end by that signal instead of with the exit status.
        exec("")
