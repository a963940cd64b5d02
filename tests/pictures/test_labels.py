"""Texts on figures and in tables."""

import numpy as np
import pytest

from warpchain.pictures.labels import cell_text, short_texts


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        (np.array([0.01268, 0.0254]), ["0.01268", "0.0254"]),
        (np.logspace(-3, 0, 3), ["0.001", "0.0316", "1"]),
        (np.array([1.0000001, 1.0000002]), ["1.0000001", "1.0000002"]),
        (np.array([None, 1.0, 10.0]), ["null", "1", "10"]),
    ],
)
def test_short_texts(values: np.ndarray, texts: list[str]) -> None:
    """Values are exact in six digits, or else as short as they can be told apart."""
    assert short_texts(values) == texts


def test_cell_text() -> None:
    """Cells are named by symbols, values and units."""
    text = cell_text({"links": np.int64(60), "frequency": np.float64(7.5), "start": "rest", "self_contact": np.True_})
    assert text == "n = 60, ν = 7.5 Hz, start = rest, self contact = True"
    assert cell_text({"coulomb_friction": 1.1e-4, "tolerance": 1e-9}) == "τ_c = 0.00011 N m, tolerance = 1e-9"
    assert cell_text({}) == ""
