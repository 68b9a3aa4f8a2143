"""The house stays small: few numbers that somebody chose, and files that one reads in one go."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

import unassemble

ROOT = Path(unassemble.__file__).parent
MOST_NUMBERS = 120
MOST_LINES = 350
WITHOUT = "paper"  # the paper of 2002 as it is, with its own numbers


def is_number(value: ast.expr) -> bool:
    """Whether nothing but numbers stand in an expression: tuples, sums and options made of them included."""
    match value:
        case ast.Constant(value=bool() | str() | bytes() | None):
            return False
        case ast.Constant() | ast.Attribute(value=ast.Name(id="np"), attr="pi"):
            return True
        case ast.UnaryOp(operand=one):
            return is_number(one)
        case ast.BinOp(left=one, right=other):
            return is_number(one) and is_number(other)
        case ast.Tuple(elts=parts) | ast.List(elts=parts):
            return bool(parts) and all(map(is_number, parts))
        case ast.Dict(values=parts):
            return bool(parts) and all(map(is_number, parts))
        case ast.Call(args=parts, keywords=named):
            parts = [*parts, *(one.value for one in named)]
            return bool(parts) and all(map(is_number, parts))
    return False


def is_table(value: ast.expr) -> bool:
    """Whether tuples of whole numbers stand in a tuple, or matrix: which corners make a side, which steps a cell."""
    rows = value.args[0] if isinstance(value, ast.Call) and value.args else value
    return isinstance(rows, ast.Tuple | ast.List) and all(
        isinstance(row, ast.Tuple | ast.List) and all(type(ast.literal_eval(one)) is int for one in row.elts)
        for row in rows.elts
    )


def numbers(source: str) -> Iterator[str]:
    """Names of a module to which numbers are assigned."""
    for statement in ast.parse(source).body:
        match statement:
            case ast.Assign(targets=targets, value=value):
                pass
            case ast.AnnAssign(target=one, value=ast.expr() as value):
                targets = [one]
            case _:
                continue
        if is_number(value) and not is_table(value):
            yield from (node.id for one in targets for node in ast.walk(one) if isinstance(node, ast.Name))


def files() -> list[Path]:
    return [path for path in sorted(ROOT.rglob("*.py")) if path.relative_to(ROOT).parts[0] != WITHOUT]


@pytest.mark.parametrize(
    ("source", "names"),
    [
        ("A = 1e-3", ["A"]),
        ("A: float = -2 * np.pi", ["A"]),
        ("A, B = 1, (2, 3)", ["A", "B"]),
        ("A = {2: 6000, 3: 1900}", ["A"]),
        ("A = Options(steps=8)", ["A"]),
        ("A = ((0, 1), (1, 2))", []),
        ("A = ((0.5, 1), (1, 2))", ["A"]),
        ("A = 'one'; B = other; C = Kind('quad', 4); D = True", []),
        ("def f():\n    a = 1", []),
    ],
)
def test_what_counts_as_a_number(source, names):
    assert list(numbers(source)) == names


def test_few_numbers_were_chosen():
    """They belong to `tolerances` or `budget`, where one value serves all that have the same reason."""
    count = Counter({str(path.relative_to(ROOT)): len(list(numbers(path.read_text("utf-8")))) for path in files()})
    assert 0 < count.total() <= MOST_NUMBERS, count.most_common(12)


def test_files_are_read_in_one_go():
    lines = Counter({str(path.relative_to(ROOT)): len(path.read_text("utf-8").splitlines()) for path in files()})
    assert {name: n for name, n in lines.items() if n > MOST_LINES} == {}


def test_no_two_classes_have_one_name():
    homes: dict[str, list[str]] = {}
    for path in sorted(ROOT.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                homes.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    assert {name: files for name, files in homes.items() if len(files) > 1} == {}


def test_tests_go_through_doors():
    """Top-level modules and packages: what a room is made of may change without a test that breaks."""
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("unassemble.") and not node.level:
                inner = node.module.split(".")[1:]
                assert len(inner) == 1 or (ROOT / Path(*inner)).is_dir(), f"{path.name}: {node.module}"
