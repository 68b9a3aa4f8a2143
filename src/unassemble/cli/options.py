"""Options and steps that several commands share, and how values are spelled; what they mean, the library checks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from ..recovery import Recovery

_MATRICES = (".mtx", ".mat", ".npz", ".npy", ".txt", ".ijv", ".coo")

_Command = TypeVar("_Command", bound=Callable[..., Any])

DROP_ZEROS = "--drop-zeros"
_TOLERANCE = "1e-12"


class OptionalTolerance(click.Command):
    """A command whose ``--drop-zeros`` may stand without its value.

    The value is taken only where the next word is a number, so that a file name is never swallowed.
    """

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Spell the default value out before click reads the words."""
        return super().parse_args(ctx, spelled_out(args))


def spelled_out(words: list[str]) -> list[str]:
    """Words of a command line with each bare ``--drop-zeros`` given its value."""
    end = words.index("--") if "--" in words else len(words)
    result = []
    for k, word in enumerate(words):
        bare = word == DROP_ZEROS and k < end and not (k + 1 < end and _is_number(words[k + 1]))
        result.append(f"{word}={_TOLERANCE}" if bare else word)
    return result


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


class Numbers(click.ParamType):
    """Rows, then numbers, separated by commas.

    The form is that of the help text, ``ROW,X,Y[,Z]`` for one: each ROW is a matrix row, counted from 0; what stands
    in brackets may be left out.
    """

    def __init__(self, form: str):
        self.name = self._form = form
        self._parts = form.replace("[", "").replace("]", "").split(",")
        self._least = len(form.split("[")[0].split(","))

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[Any, ...]:
        """Read a word."""
        words = value.split(",")
        try:
            numbers = tuple(int(w) if part == "ROW" else float(w) for part, w in zip(self._parts, words, strict=False))
        except ValueError as error:
            self.fail(f"{value!r} is not of the form {self._form} ({error})", param, ctx)
        if not self._least <= len(words) <= len(self._parts):
            self.fail(f"{value!r} is not of the form {self._form}", param, ctx)
        return numbers


def _with(*options: Callable[[_Command], _Command]) -> Callable[[_Command], _Command]:
    """All of some decorators, the first one outside."""
    return lambda command: reduce(lambda inner, option: option(inner), reversed(options), command)


_DEBUG = click.option("--debug", is_flag=True, expose_value=False, help="Show tracebacks and details.")
OPERATORS = ["auto", "laplacian", "elasticity", "surface"]

matrix_options = _with(
    click.argument("matrix", metavar="MATRIX"),
    click.option(
        DROP_ZEROS,
        type=float,
        metavar="[TOL]",
        help="Forget stored entries of at most TOL (default 1e-12) times the largest off-diagonal entry of their row, "
        "and of their transpose's.",
    ),
    click.option("--variable", metavar="NAME", help="Name of the variable in a .mat file."),
    _DEBUG,
)

recovery_options = _with(
    click.option(
        "--block-size",
        type=click.Choice(["2", "3", "4", "6"]),
        callback=lambda ctx, param, value: value and int(value),
        help="Vector-valued matrices: unknowns per node; found where it is not given.",
    ),
    click.option(
        "--numbering",
        type=click.Choice(["interleaved", "component"]),
        callback=lambda ctx, param, value: "by component" if value == "component" else value,
        help="Vector-valued matrices: order of the unknowns, node by node or component by component; found where it is "
        "not given.",
    ),
    click.option("--report", metavar="FILE", help="Write a report: .json."),
    click.option("--threads", type=click.IntRange(min=1), metavar="N", help="Threads of the linear algebra libraries."),
    click.option("--quiet", is_flag=True, help="Print nothing but errors."),
)


def folder_options(default: str) -> Callable[[_Command], _Command]:
    """The folder that results go to."""
    return _with(click.option("-o", "--output", "folder", metavar="DIR", default=default, show_default=True), _DEBUG)


def target(matrix: str, word: str | None, option: str | None, suffix: str = ".vtu") -> str:
    """The file that the mesh goes to: as named by a word or an option, or else beside the matrix, if none is there."""
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
    """Find out, before the long work, what can be known to fail of the files to be written, by their roles.

    None of them may be the matrix, or have two roles.
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
