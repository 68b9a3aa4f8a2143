"""Is anything ever certified and wrong? Random matrices of every kind, held against their meshes.

    OMP_NUM_THREADS=1 python benchmarks/wrong.py --jobs 2 [--cases 20000] [--first 0] [--kinds ...] [--seconds 20]

The kinds are those of ``benchmarks/wrong_inputs``: scalar matrices, elastic bodies and structures, small ones, with
boundary conditions, contrasts, springs, prestress, rigid floors and links, few elements, damaged entries, few digits.
Number k of a kind is always the same matrix. Each certificate that is wrong is printed at once, with the command that
makes its matrix again; then a table of what came of each kind. Exit status 1 where any certificate was wrong.

    right        certified, and every claim is true
    alias        certified, on another mesh with the very entries, of which a warning speaks
    ambiguous    said to be one of several meshes that fit
    uncertified  an answer without a certificate
    refused      no answer
    slow         none within so many seconds of processor time; so is what ends in an unexpected error, which is printed
    WRONG        certified, and a claim is false
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
import traceback
import warnings
import zlib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import repeat
from types import FrameType

import numpy as np
from wrong_inputs import KINDS, Truth
from wrong_inputs.judge import checked

from unassemble import InputError, RecoveryError

OUTCOMES = ("right", "alias", "ambiguous", "uncertified", "refused", "slow", "WRONG", "ERROR")


@dataclass(frozen=True)
class Outcome:
    """What came of one matrix."""

    kind: str
    number: int
    word: str  # one of OUTCOMES
    said: str
    rows: int
    seconds: float

    @property
    def again(self) -> str:
        """The command that repeats it."""
        return f"python benchmarks/wrong.py --kinds {self.kind} --first {self.number} --cases 1"


class TooSlowError(BaseException):
    """The processor time of a matrix is used up; no handler of exceptions is to swallow it."""


def matrix_of(kind: str, number: int) -> Truth:
    """The matrix of a number, and its truth."""
    return KINDS[kind](np.random.default_rng([number, zlib.crc32(kind.encode())]))


def tried(kind: str, number: int, seconds: float = 20.0) -> Outcome:
    """What comes of one matrix."""
    truth, start = matrix_of(kind, number), time.process_time()
    word, said = "", ""
    try:
        with limited(seconds), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            word, said = checked(truth)
    except (RecoveryError, InputError):
        word = "refused"
    except TooSlowError:
        word = "slow"
    except Exception:
        word, said = "ERROR", traceback.format_exc()
    return Outcome(kind, number, word, said, truth.matrix.shape[0], time.process_time() - start)


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """Raise after so much processor time; where the system has no such alarm, never."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooSlowError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def table_of(outcomes: list[Outcome]) -> str:
    """Counts by kind, and the processor time of a matrix."""
    width = max(map(len, KINDS)) + 2
    lines = [f"{'':{width}}" + "".join(f"{word:>12}" for word in OUTCOMES) + f"{'s each':>9}{'most s':>8}{'rows':>6}"]
    for kind in [*KINDS, "all"]:
        own = [one for one in outcomes if kind in (one.kind, "all")]
        if not own:
            continue
        count, seconds = Counter(one.word for one in own), [one.seconds for one in own]
        lines.append(
            f"{kind:{width}}" + "".join(f"{count[word]:12}" for word in OUTCOMES)
            + f"{np.mean(seconds):9.2f}{max(seconds):8.1f}{np.mean([one.rows for one in own]):6.0f}"
        )  # fmt: skip
    return "\n".join(lines)


def main() -> int:
    """Print every wrong certificate, and the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20_000, help="matrices in all, as many of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first matrix of each kind")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND", help=", ".join(KINDS))
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--seconds", type=float, default=20.0, help="of processor time for each matrix")
    parser.add_argument("--list", action="store_true", help="print a line for each matrix")
    chosen = parser.parse_args()
    places = range(chosen.cases)
    kinds = [chosen.kinds[k % len(chosen.kinds)] for k in places]
    numbers = [chosen.first + k // len(chosen.kinds) for k in places]
    outcomes = []
    for one in results(chosen.jobs, kinds, numbers, chosen.seconds):
        outcomes.append(one)
        if chosen.list or one.word in ("WRONG", "ERROR"):
            print(f"{one.word}: {one.again}  # {one.rows} rows, {one.seconds:.1f} s: {one.said}", flush=True)
    print(table_of(outcomes))
    return int(any(one.word == "WRONG" for one in outcomes))


def results(jobs: int, kinds: list[str], numbers: list[int], seconds: float) -> Iterator[Outcome]:
    """In this order, by so many processes."""
    if jobs == 1:
        yield from map(tried, kinds, numbers, repeat(seconds))
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(tried, kinds, numbers, repeat(seconds), chunksize=4)


if __name__ == "__main__":
    sys.exit(main())
