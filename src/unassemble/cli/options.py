"""Options and steps that several commands share."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .values import DROP_ZEROS

if TYPE_CHECKING:
    from ..recovery import Recovery

_MATRICES = (".mtx", ".mat", ".npz", ".npy", ".txt", ".ijv", ".coo")

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
            type=click.Choice(["2", "3", "4", "6"]),
            callback=lambda ctx, param, value: value and int(value),
            help="Vector-valued matrices: unknowns per node; found where it is not given.",
        ),
    ):
        command = decorate(command)
    return command


def target(matrix: str, word: str | None, option: str | None, suffix: str = ".vtu") -> str:
    """The file that the mesh goes to: as named by a word or an option, or else beside the matrix.

    Raises
    ------
    click.UsageError
        If it is named twice, or there is already a file where nobody named one.
    """
    if word is not None and option is not None:
        raise click.UsageError(f"OUT is given twice, as {word!r} and as -o {option!r}")
    named = option if word is None else word
    if named is not None:
        return named
    beside = Path("mesh" if matrix == "-" else matrix)
    while beside.suffix.lower() in (".gz", *_MATRICES):
        beside = beside.with_suffix("")
    beside = beside.with_name(beside.name + suffix)
    if beside.exists():
        name = click.format_filename(beside)
        raise click.UsageError(f"{name!r} is there already, and was not named: replace it by -o {name}")
    return str(beside)


def check_files(matrix: str, files: Mapping[str, tuple[str | None, Callable[[str], Any]]]) -> None:
    """Find out, before the long work, what can be known to fail of the files to be written.

    Parameters
    ----------
    matrix : str
        A file that is not to be overwritten; "-" is standard input.
    files : mapping of role to (name or None, check)

    Raises
    ------
    OutputError, FormatError
        As the checks do.
    click.UsageError
        If one file has two roles.
    """
    seen = {} if matrix == "-" else {_resolved(matrix): "MATRIX"}
    for role, (name, check) in files.items():
        if name is None:
            continue
        check(name)
        other = seen.setdefault(_resolved(name), role)
        if other != role:
            raise click.UsageError(f"{other} and {role} are the same file, {click.format_filename(name)!r}")


def _resolved(name: str) -> Path | str:
    try:
        return Path(name).resolve()
    except (OSError, RuntimeError, ValueError):  # whoever opens it will say what is wrong
        return name


def recovered(matrix: str, report: str | None, **options: Any) -> Recovery:
    """The library's answer; a failure has a report as well, where one is asked for."""
    import unassemble

    try:
        return unassemble.recover(matrix, **options)
    except unassemble.RecoveryError as error:
        if report is not None:
            from ..report import failure_report, write_report

            write_report(failure_report(error), report)
        raise


def spelled_numbering(word: str | None) -> str | None:
    """The library's name of a numbering."""
    return "by component" if word == "component" else word
