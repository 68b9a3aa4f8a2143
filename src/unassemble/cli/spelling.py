"""The library names its arguments in backquotes; here they become the flags that a user types."""

from __future__ import annotations

import re
from collections.abc import Iterable

import click

_ARGUMENT = re.compile(r"`(\w+)(?:=([^`]*))?`")


def flags_of(command: click.Command) -> dict[str, str]:
    """Flags of a command by the names of the library's arguments."""
    return {p.name: p.opts[0] for p in command.params if isinstance(p, click.Option) and p.name}


def as_typed(text: str, commands: Iterable[click.Command]) -> str:
    """A message with flags in place of arguments: ```noise=1e-6``` becomes ``--noise 1e-6``.

    Parameters
    ----------
    text : str
    commands : iterable of click.Command
        The one in use first; an argument that only another one has is said to be that one's. What none of them has
        stays as it is.
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
