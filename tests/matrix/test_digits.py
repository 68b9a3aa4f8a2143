"""Whether numbers were rounded, and to what."""

import numpy as np
import pytest

from unassemble.matrix import Digits

RNG = np.random.default_rng(0)
GENERIC = RNG.choice([-1, 1], 200) * np.exp(RNG.uniform(-4, 4, 200))
FORMS = {"%.3g": "3 digits", "%.6g": "6 digits", "%.12g": "12 digits", "%.2f": "2 decimals", "%.6f": "6 decimals"}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("factor", [1.0, -1e6])
def test_decimal(form, factor):
    rounded = np.array([float(form % value) for value in (factor * GENERIC).tolist()])
    found = Digits.of(np.append(rounded, 0.0))
    if form.endswith("f") and factor != 1:  # two more digits than these have are as good as exact
        assert found is None or found.name == FORMS[form]
        return
    assert found.name == FORMS[form]
    assert (np.abs(rounded - factor * GENERIC) <= 0.5001 * found.unit[:-1]).all()
    assert (np.abs(rounded - factor * GENERIC) > 0.25 * found.unit[:-1]).any()
    assert (found.unit[-1] == 0) == form.endswith("g")


def test_regular_meshes_have_exact_numbers_too():
    sides = np.array([0.0, 1 / 3, 0.5, 0.6, 1 / 1.2, 1.0, 1.2, 1.25, 1.8, 1.85, 2.0, 2.66 / 1.2, 3.6, 3.7, 7.4])
    assert Digits.of(np.array([float(f"{x:.6g}") for x in sides])).name == "6 digits"


def test_single_precision():
    rounded = GENERIC.astype(np.float32).astype(float)
    found = Digits.of(np.append(rounded, [0.0, 1e-300]))
    assert found.name == "single precision"
    assert found.unit[:-2] == pytest.approx(np.spacing(np.abs(GENERIC).astype(np.float32)))
    assert found.unit[-2] == 0


@pytest.mark.parametrize(
    "values",
    [
        GENERIC,
        [-1.0, 4.0, -1.0],
        np.arange(1.0, 900.0),
        np.arange(1.0, 90.0) / 16,
        [0.1, 0.2, 0.3],
        1.234567 * np.ones(20),
        np.ones(5) / 3,
        [0.0, 0.0],
        [],
    ],
)
def test_exact_numbers_are_not_rounded_ones(values):
    assert Digits.of(np.array(values, dtype=float)) is None
