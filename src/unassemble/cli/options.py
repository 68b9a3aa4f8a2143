"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import click

from .values import DROP_ZEROS, Number

_Command = TypeVar("_Command", bound=Callable[..., Any])


def matrix_options(command: _Command) -> _Command:
    """The matrix, and how it is read."""
    for decorate in (
        click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks and details."),
        click.option("--variable", metavar="NAME", help="Name of the variable in a .mat file."),
        click.option(
            DROP_ZEROS,
            type=Number("a tolerance, at least 0 and below 1", lambda value: 0 <= value < 1),
            metavar="[TOL]",
            help="Forget stored entries of at most TOL (default 1e-12) times the largest off-diagonal entry of their "
            "row, and of their transpose's.",
        ),
        click.argument("matrix", metavar="MATRIX"),
    ):
        command = decorate(command)
    return command
