"""What users read: flags as they typed them, numbers that agree with their nouns, short lists."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp

from unassemble.cli import as_typed, flags_of, main
from unassemble.formats import FORMATS
from unassemble.words import count_of

SOURCE = Path(__file__).parents[2] / "src" / "unassemble"
DOCS = Path(__file__).parents[2] / "docs"


def test_arguments_become_flags():
    recover, inspect = main.commands["recover"], main.commands["inspect"]
    said = "give `noise`, `noise=1e-6` or `operator='laplacian'`, `drop_zeros`, `realise=True`, `not_one_of_ours`"
    assert as_typed(said, [recover]) == (
        "give --noise, --noise 1e-6 or --operator laplacian, --drop-zeros, --realise, `not_one_of_ours`"
    )
    assert as_typed("give `noise`", [inspect, recover]) == "give --noise (an option of recover)"
    assert {"anchors", "variable", "tensor", "block_size"} <= set(flags_of(recover))


def test_messages_of_the_library_name_arguments_in_backquotes():
    """Flags belong to the command line alone."""
    flags = [flag for flag in flags_of(main.commands["recover"]).values() if flag.startswith("--")]
    for path in SOURCE.rglob("*.py"):
        if "cli" in path.parts:
            continue
        for text in re.findall(r'f?"[^"\n]*"', path.read_text(encoding="utf-8")):
            assert not [flag for flag in flags if flag in text], (path, text)


def test_several_variables(work, one_sentence):
    scipy.io.savemat("two.mat", {"A": work.true.matrix.tocsc(), "B": work.true.matrix.tocsc()})
    result = work.recover(matrix="two.mat")
    assert result.exit_code == 2
    assert "choose one by --variable NAME" in one_sentence(result)
    result = work.recover("--variable", "A")
    assert result.exit_code == 2
    assert "leave out --variable" in one_sentence(result)


def test_an_anchor_in_space_for_a_planar_matrix(work, one_sentence):
    result = work.recover("--anchor", "0,0,0,0", "--anchor", "7,1,0,0")
    assert result.exit_code == 2
    assert "the anchor of row 0 has three coordinates" in one_sentence(result)


@pytest.mark.parametrize(
    ("out", "why"),
    [("mesh.vtuu", "did you mean .vtu"), ("mesh", "no extension"), ("mesh.qqqqq", "use .npz, .vtu")],
)
def test_unknown_extensions(work, one_sentence, out, why):
    result = work.recover(out=out)
    assert result.exit_code == 2
    sentence = one_sentence(result)
    assert why in sentence
    assert len(sentence) < 200


def test_the_page_on_files_lists_every_extension():
    page = (DOCS / "formats.md").read_text(encoding="utf-8")
    writable = {suffix for suffix, known in FORMATS.items() if not known.cannot}
    missing = [suffix for suffix in writable if f"`{suffix}`" not in page]
    assert not missing


@pytest.mark.parametrize("command", ["demo", "paper"])
def test_folders_that_cannot_be_made(work, one_sentence, command):
    (work.folder / "file").write_text("old")
    for folder in ("file", "file/in", "/proc/none"):
        if folder.startswith("/proc") and not sys.platform.startswith("linux"):
            continue
        result = work.run(command, "-o", folder)
        assert result.exit_code == 2
        sentence = one_sentence(result)
        assert folder in sentence
        assert "Errno" not in sentence
    assert (work.folder / "file").read_text() == "old"


@pytest.mark.parametrize("n", [5, 6])
def test_a_graph_is_not_planar(work, one_sentence, n):
    """K5; K3,3 with even and odd rows."""
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    full = np.where((i != j) & ((n == 5) | ((i + j) % 2 == 1)), -1.0, 0.0)
    work.write("K.mtx", sp.coo_array(full + 9 * np.eye(n)))
    for words in (["--operator", "laplacian"], []):
        result = work.recover(*words, matrix="K.mtx")
        assert result.exit_code == 4
        assert one_sentence(result).startswith("the graph of the matrix is not planar")


def test_numbers_agree_with_their_nouns():
    assert [count_of(k, "vertex", "vertices") for k in (0, 1, 1200)] == ["0 vertices", "1 vertex", "1,200 vertices"]


def test_an_interrupt_while_modules_load_is_quiet():
    code = (
        "import sys\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'click':\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "from unassemble.__main__ import run\n"
        "run()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "unassemble: interrupted\n")
