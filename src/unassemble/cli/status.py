"""How commands end: every exception becomes a sentence on standard error and an exit status."""

from __future__ import annotations

import logging
import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from ..errors import InputError, OutputError, RecoveryError, UnassembleError
from .spelling import as_typed

if TYPE_CHECKING:
    from ..recovery import Recovery


class Exit(IntEnum):
    """What a command came to."""

    CERTIFIED = 0
    BUG = 1
    USAGE = 2
    UNCERTIFIED = 3
    NOTHING = 4
    INTERRUPTED = 130


# From click 8.2 on, a command without arguments raises the help text.
_HELP = getattr(click.exceptions, "NoArgsIsHelpError", ())


class CommandLine(click.Group):
    """A group of commands that return their exit status."""

    debug = False  # whether tracebacks and details are wanted

    def main(
        self,
        args: Sequence[str] | None = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        windows_expand_args: bool = True,
        **extra: Any,
    ) -> NoReturn:
        """Run a command and leave with its status."""
        given = self.with_command(list(sys.argv[1:] if args is None else args))
        debug = self.debug = "--debug" in given
        if debug:
            logging.basicConfig(level=logging.DEBUG, format="%(name)s: %(message)s")
        try:
            with warnings.catch_warnings():
                if not debug:  # what matters to a user is in the report
                    warnings.simplefilter("ignore")
                status = super().main(given, prog_name, complete_var, standalone_mode=False, **extra)
        except BaseException as error:
            status, sentence = verdict(error)
            if debug and not isinstance(error, (SystemExit, click.exceptions.ClickException)):
                traceback.print_exception(error)
            if sentence:
                click.echo(f"unassemble: {as_typed(sentence, self.in_use(given))}", err=True)
        sys.exit(status or Exit.CERTIFIED)

    def with_command(self, words: list[str]) -> list[str]:
        """The words with ``recover`` before them, where they begin with a file instead of a command."""
        first = words[0] if words else ""
        named = first != "" and not first.startswith("-") and (Path(first).suffix or Path(first).exists())
        return ["recover", *words] if (first == "-" or named) and first not in self.commands else words

    def in_use(self, words: Sequence[str]) -> list[click.Command]:
        """All commands, the one that is called first."""
        return sorted(self.commands.values(), key=lambda command: command.name != next(iter(words), None))


def verdict(error: BaseException) -> tuple[int, str]:
    """Exit status and sentence for whatever ended a command."""
    match error:
        case SystemExit():
            return (error.code if isinstance(error.code, int) else Exit.BUG), ""
        case click.exceptions.Abort() if not isinstance(error.__cause__, EOFError):
            return Exit.INTERRUPTED, "interrupted"
        case KeyboardInterrupt():
            return Exit.INTERRUPTED, "interrupted"
        case click.exceptions.ClickException() if isinstance(error, _HELP):
            return Exit.USAGE, error.format_message()
        case click.exceptions.ClickException():
            return Exit.USAGE, _one_line(error.format_message())
        case InputError():
            return Exit.USAGE, _one_line(str(error))
        case RecoveryError():
            return Exit.NOTHING, _one_line(str(error))
        case UnassembleError():
            return Exit.BUG, _one_line(str(error))
        case OSError():
            return Exit.USAGE, _one_line(system_sentence(error))
        case MemoryError():
            return Exit.BUG, "there is not enough memory for a matrix of this size"
        case _:
            cause = error.__cause__ if isinstance(error, click.exceptions.Abort) and error.__cause__ else error
            return Exit.BUG, f"internal error, please report it ({_one_line(f'{type(cause).__name__}: {cause}')}); " + (
                "--debug shows where"
            )


def outcome(recovery: Recovery, written: Sequence[str | None], *, quiet: bool, lacking: str = "") -> int:
    """Say what came of a recovery, and what the files that were written lack; return the exit status."""
    context = click.get_current_context()
    commands = [context.command]
    details = recovery.certified or getattr(context.find_root().command, "debug", False)
    if not quiet:
        from ..summary import summary, three_lines

        files = ", ".join(click.format_filename(name) for name in written if name is not None) + lacking
        text = f"{summary(recovery)}\n  {'written':<15} {files}" if details else three_lines(recovery, files)
        say(as_typed(text, commands))
    elif not recovery.certified:
        click.echo(f"unassemble: {recovery.status}: {as_typed(recovery.reason, commands)}", err=True)
    return Exit.CERTIFIED if recovery.certified else Exit.UNCERTIFIED


def system_sentence(error: OSError) -> str:
    """What the system refused, without its number."""
    why = (error.strerror or str(error)).lower()
    return f"{os.fsdecode(error.filename)!r}: {why}" if isinstance(error.filename, (str, bytes)) else why


def say(text: str) -> None:
    """Print a result; a reader that has gone away is no failure of ours.

    Raises
    ------
    OutputError
        If standard output cannot take it, a full disk for one.
    """
    try:
        click.echo(text)
        if sys.stdout is not None:  # it may be closed
            sys.stdout.flush()
    except BrokenPipeError:
        # Python would complain once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        raise OutputError(f"cannot write to standard output: {(error.strerror or str(error)).lower()}") from error


def _one_line(text: str) -> str:
    return " ".join(text.split())
