"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import click

from .values import DROP_ZEROS

_Command = TypeVar("_Command", bound=Callable[..., Any])


def matrix_options(command: _Command) -> _Command:
    """The matrix, and how it is read."""
    for decorate in (
        click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks and details."),
        click.option("--variable", metavar="NAME", help="Name of the variable in a .mat file."),
        click.option(
            DROP_ZEROS,
            type=float,
            metavar="[TOL]",
            help="Forget stored entries of at most TOL (default 1e-12) times the largest off-diagonal entry of their "
            "row, and of their transpose's.",
        ),
        click.argument("matrix", metavar="MATRIX"),
    ):
        command = decorate(command)
    return command


def nodes_options(command: _Command) -> _Command:
    """How the rows of a vector-valued matrix form nodes, where it is known."""
    for decorate in (
        click.option(
            "--numbering",
            type=click.Choice(["interleaved", "component"]),
            help="Vector-valued matrices: order of the unknowns, node by node or component by component; found "
            "where it is not given.",
        ),
        click.option(
            "--block-size",
            type=click.Choice(["2", "3", "6"]),
            callback=lambda ctx, param, value: value and int(value),
            help="Vector-valued matrices: unknowns per node; found where it is not given.",
        ),
    ):
        command = decorate(command)
    return command


def refuse_shared(names: Mapping[str, str | None]) -> None:
    """Refuse one file in two roles; a matrix named "-" is standard input.

    Raises
    ------
    click.UsageError
    """
    seen: dict[Path, str] = {}
    for role, name in names.items():
        if name is None or (role == "MATRIX" and name == "-"):
            continue
        try:
            path = Path(name).resolve()
        except (OSError, RuntimeError, ValueError):  # whoever opens it will say what is wrong
            continue
        if path in seen:
            raise click.UsageError(f"{seen[path]} and {role} are the same file, {click.format_filename(name)!r}")
        seen[path] = role


def spelled_numbering(word: str | None) -> str | None:
    """The library's name of a numbering."""
    return "by component" if word == "component" else word
