"""How commands end: every exception becomes a sentence on standard error and an exit status."""

from __future__ import annotations

import logging
import os
import re
import sys
import traceback
import warnings
from collections.abc import Iterable, Sequence
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from ..errors import InputError, OutputError, RecoveryError

if TYPE_CHECKING:
    from ..recovery import Recovery


_ARGUMENT = re.compile(r"`(\w+)(?:=([^`]*))?`")


def flags_of(command: click.Command) -> dict[str, str]:
    """Flags of a command by the names of the library's arguments."""
    return {p.name: p.opts[0] for p in command.params if isinstance(p, click.Option) and p.name}


def as_typed(text: str, commands: Iterable[click.Command]) -> str:
    """A message with flags in place of the library's arguments: ```noise=1e-6``` becomes ``--noise 1e-6``.

    The command in use is the first one; an argument that only another one has is said to be that one's. What none of
    them has stays as it is.
    """
    text = text.replace("`report()`", "the `report`").replace("`inspect_matrix`", "'unassemble inspect'")
    known = [(command.name, flags_of(command)) for command in commands]

    def typed(match: re.Match[str]) -> str:
        name, value = match.groups()
        for k, (command, flags) in enumerate(known):
            if name in flags:
                words = f"{flags[name]} {value.strip(chr(39))}" if value not in (None, "True") else flags[name]
                return words if k == 0 else f"{words} (an option of {command})"
        return match[0]

    return _ARGUMENT.sub(typed, text)


class Exit(IntEnum):
    """What a command came to."""

    CERTIFIED = 0
    BUG = 1
    USAGE = 2
    UNCERTIFIED = 3
    NOTHING = 4
    INTERRUPTED = 130


class CommandLine(click.Group):
    """A group of commands that return their exit status."""

    debug = False  # whether tracebacks and details are wanted

    def main(self, args: Sequence[str] | None = None, *more: Any, **named: Any) -> NoReturn:
        """Run a command and leave with its status."""
        given = self.with_command(list(sys.argv[1:] if args is None else args))
        debug = self.debug = "--debug" in given
        if debug:
            logging.basicConfig(level=logging.DEBUG, format="%(name)s: %(message)s")
        try:
            with warnings.catch_warnings():
                if not debug:  # what matters to a user is in the report
                    warnings.simplefilter("ignore")
                status = super().main(given, *more, **{**named, "standalone_mode": False})
        except BaseException as error:
            status, sentence = verdict(error)
            if debug and not isinstance(error, (SystemExit, click.exceptions.ClickException)):
                traceback.print_exception(error)
            if sentence:
                in_use = sorted(self.commands.values(), key=lambda command: command.name != next(iter(given), None))
                click.echo(f"unassemble: {as_typed(sentence, in_use)}", err=True)
        sys.exit(status or Exit.CERTIFIED)

    def with_command(self, words: list[str]) -> list[str]:
        """The words with ``recover`` before them, where they begin with a file instead of a command."""
        first = words[0] if words else ""
        named = first != "" and not first.startswith("-") and (Path(first).suffix or Path(first).exists())
        return ["recover", *words] if (first == "-" or named) and first not in self.commands else words


def verdict(error: BaseException) -> tuple[int, str]:
    """Exit status and sentence for whatever ended a command."""
    status: int = Exit.BUG
    match error:
        case SystemExit():
            return (error.code if isinstance(error.code, int) else Exit.BUG), ""
        case KeyboardInterrupt() | click.exceptions.Abort() if not isinstance(error.__cause__, EOFError):
            status, sentence = Exit.INTERRUPTED, "interrupted"
        case click.exceptions.NoArgsIsHelpError():
            return Exit.USAGE, error.format_message()
        case click.exceptions.ClickException():
            status, sentence = Exit.USAGE, error.format_message()
        case InputError():
            status, sentence = Exit.USAGE, str(error)
        case RecoveryError():
            status, sentence = Exit.NOTHING, str(error)
        case OSError():  # without its number
            sentence = (error.strerror or str(error)).lower()
            named = isinstance(error.filename, (str, bytes))
            status, sentence = Exit.USAGE, f"{os.fsdecode(error.filename)!r}: {sentence}" if named else sentence
        case MemoryError():
            sentence = "there is not enough memory for a matrix of this size"
        case _:
            cause = error.__cause__ if isinstance(error, click.exceptions.Abort) and error.__cause__ else error
            said = " ".join(f"{type(cause).__name__}: {cause}".split())
            sentence = f"internal error, please report it ({said}); --debug shows where"
    return status, " ".join(sentence.split())


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


def say(text: str) -> None:
    """Print a result; a reader that has gone away is no failure of ours, and a full disk an OutputError."""
    try:
        click.echo(text)
        if sys.stdout is not None:  # it may be closed
            sys.stdout.flush()
    except BrokenPipeError:
        # Python would complain once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as error:
        raise OutputError(f"cannot write to standard output: {(error.strerror or str(error)).lower()}") from error
