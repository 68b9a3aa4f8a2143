"""Regenerate Figures 3 to 12 of the paper and the tables beside them.

    python experiments/paper.py FOLDER

The same as ``unassemble paper -o FOLDER``. The tables are printed as well.
"""

from __future__ import annotations

import argparse

from unassemble.paper.experiments import claims_table, comparison_table, regenerate
from unassemble.planar.conformal import conformal_map


def main() -> None:
    """Parse, run, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", default="paper-output")
    made = regenerate(parser.parse_args().folder, conformal_map)
    files = "\n".join(str(path) for path in made.files)
    print(claims_table(made.claims), comparison_table(made.comparisons), files, sep="\n")  # noqa: T201


if __name__ == "__main__":
    main()
