"""A plan's columns on disk: what comes back is what was written, row by row."""

from pathlib import Path

import numpy as np

from ars_web.datasets.plan_columns import NUMBERS, TEXTS, Texts, read_columns, text_arrays, write_columns


def test_texts_are_a_sequence() -> None:
    given = ["a", "", "Bär 🐻.jpg", "odd\udcff", "x" * 300]
    texts = Texts(*text_arrays(given))
    assert list(texts) == given
    assert [texts[i] for i in range(-5, 5)] == given + given
    assert (texts[1:4], texts[::2], texts[7:]) == (tuple(given[1:4]), tuple(given[::2]), ())
    assert len(texts) == 5


def test_columns_come_back_as_plain_writable_arrays(tmp_path: Path) -> None:
    """Compiled functions would be compiled once more for a read-only array, or for one of a file."""
    random = np.random.default_rng(0)
    numbers = {name: random.random((7, 4, 4)) for name in NUMBERS}
    columns = dict(numbers)
    for name in TEXTS:
        columns[name], columns[f"{name}_ends"] = text_arrays([f"{name} {i}" for i in range(7)])
    write_columns(columns, tmp_path)
    read, texts = read_columns(tmp_path)
    for name, column in numbers.items():
        assert np.array_equal(read[name], column)
        assert type(read[name]) is np.ndarray
        assert read[name].flags.writeable
        assert read[name][2:5].flags.c_contiguous
    assert {name: list(column) for name, column in texts.items()} == {
        name: [f"{name} {i}" for i in range(7)] for name in TEXTS
    }
