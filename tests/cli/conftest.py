from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from click.testing import CliRunner, Result

from meshes import Specimen, random_mesh, specimen
from unassemble.cli import main


@dataclass
class Workplace:
    """A folder with matrices, and the command line run in it."""

    folder: Path
    true: Specimen

    def run(self, *words: str, stdin: bytes | None = None) -> Result:
        return CliRunner().invoke(main, list(words), input=stdin, prog_name="unassemble")

    def recover(self, *words: str, matrix: str = "A.mtx", out: str = "mesh.npz") -> Result:
        return self.run("recover", matrix, "-o", out, *words)

    def write(self, name: str, matrix: sp.sparray | np.ndarray) -> None:
        # Entry by entry, since zeros that are stored are structure.
        scipy.io.mmwrite(name, sp.coo_array(matrix), symmetry="general", precision=17)

    def mesh(self, name: str = "mesh.npz") -> dict[str, np.ndarray]:
        with np.load(name) as content:
            return dict(content)

    def files(self) -> set[str]:
        return {path.name for path in self.folder.iterdir()}


@pytest.fixture
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workplace:
    monkeypatch.chdir(tmp_path)
    place = Workplace(tmp_path, specimen(*random_mesh(220, seed=11), c=-3.0, diagonal=True))
    place.write("A.mtx", place.true.matrix)
    return place


@pytest.fixture
def one_sentence() -> Callable[[Result], str]:
    """What was said on standard error, checked to be one sentence and no traceback."""

    def said(result: Result) -> str:
        assert "Traceback" not in result.stderr
        lines = result.stderr.strip().splitlines()
        assert len(lines) == 1, result.stderr
        assert lines[0].startswith("unassemble: ")
        return lines[0].removeprefix("unassemble: ")

    return said
