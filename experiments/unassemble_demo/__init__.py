"""The main job on two matrices that the library did not assemble, and on a small structure."""

from collections.abc import Callable
from pathlib import Path

import scipy.io

from unassemble import PlanarMesh, Recovery, recover
from unassemble.files import whole_file
from unassemble.report import write_report
from unassemble.summary import summary

from .comparison import plot_comparison
from .specimens import lake, mast, unit_square

__all__ = ["lake", "mast", "run", "unit_square"]


def run(folder: str | Path = "demo-output", *, echo: Callable[[str], None] = lambda line: None) -> list[Recovery]:
    """Write, read and recover the matrices; meshes, reports and pictures go to `folder`.

    It is made where it does not exist. What there is to say goes to `echo`, line by line or in blocks.

    Raises InputError if a package that meshes or assembles is not installed; OSError if the folder cannot be made.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    recoveries = []
    for specimen in (unit_square(), lake(), mast()):
        file = folder / f"{specimen.name}.mtx"
        with whole_file(file, ".mtx") as draft, draft.open("wb") as stream:  # given a name, scipy misses a full disk
            scipy.io.mmwrite(stream, specimen.matrix, symmetry="symmetric", precision=17)
        echo(f"{specimen.name}: {specimen.origin}\n")
        recovery = recover(file, anchors=specimen.anchors)
        recovery.save(folder / f"{specimen.name}.vtu")
        write_report(recovery, folder / f"{specimen.name}.json")
        picture = folder / f"{specimen.name}.png"
        if isinstance(recovery, PlanarMesh):
            plot_comparison(specimen.points, recovery, picture)
        else:
            recovery.plot(picture)
        echo(summary(recovery))
        drawn = "recovered structure" if recovery.vector_valued else "true and recovered mesh"
        echo(f"\nin {folder}: {specimen.name}.mtx, .vtu, .json and .png ({drawn})\n")
        recoveries.append(recovery)
    return recoveries
