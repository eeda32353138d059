from pathlib import Path

import numpy as np
import pytest

from ars_web.errors import BadFile
from ars_web.recordings.number_rows import count_numbers, read_rows

COLUMNS = {3: "x y z"}


def written(tmp_path: Path, data: bytes) -> Path:
    path = tmp_path / "rows.txt"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(
    "data",
    [
        b"1 2 3\n4 5 6\n",
        b"1 2 3\n4 5 6",
        b"\xef\xbb\xbf1 2 3\r\n4 5 6\r\n",
        b"1,2,3\n4, 5 ,6\n",
        b"# a comment\n\n1\t2 3  # x_y\n   \n 4 5 6\n# the end",
        b"1 2 3\r4 5 6\r",
        b"1e0 +2 3.\n4 5.0E0 6\n",
    ],
)
def test_the_same_rows_in_many_hands(tmp_path: Path, data: bytes) -> None:
    np.testing.assert_array_equal(read_rows(written(tmp_path, data), columns=COLUMNS).values, [[1, 2, 3], [4, 5, 6]])


def test_rows_know_their_lines(tmp_path: Path) -> None:
    rows = read_rows(written(tmp_path, b"# a\n1 2 3\n\n# b\n4 5 6\n"), columns=COLUMNS)
    assert rows.lines.tolist() == [2, 5]
    assert rows.where(1) == f"{tmp_path / 'rows.txt'}:5"


def test_nan_and_infinity_are_numbers_here(tmp_path: Path) -> None:
    values = read_rows(written(tmp_path, b"nan -inf 1e999\n"), columns=COLUMNS).values
    assert np.isnan(values[0, 0])
    assert np.isinf(values[0, 1:]).all()


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"# only\n", r"rows\.txt: holds no line of numbers; each line has 3 numbers \(x y z\)"),
        (b"", r"rows\.txt: holds no line of numbers"),
        (b"1 2 3\n4 5\n", r"rows\.txt:2: has 2 values; a line has 3 numbers \(x y z\)"),
        (b"#\n1 2\n1 2\n", r"rows\.txt:2: has 2 values"),
        (b"1 2 3\n\n4 5 6 7\n", r"rows\.txt:3: has 4 values"),
        (b"1 2 3\n4 five 6\n", r"rows\.txt:2: 'five' is not a number"),
        (b"1 2 3\n4 1_000 6\n", r"rows\.txt:2: '1_000' is not a number"),
        (b"1 2 3\n4 \xff 6\n", r"rows\.txt:2: '\ufffd' is not a number"),
        ("1 2 3\n".encode("utf-16"), r"rows\.txt: is UTF-16; save it as UTF-8"),
    ],
)
def test_bad_rows_are_named(tmp_path: Path, data: bytes, message: str) -> None:
    with pytest.raises(BadFile, match=message):
        read_rows(written(tmp_path, data), columns=COLUMNS)


def test_a_folder_and_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="is a folder, a file is expected"):
        read_rows(tmp_path, columns=COLUMNS)
    with pytest.raises(BadFile, match="is missing"):
        read_rows(tmp_path / "none", columns=COLUMNS)


def test_counting_numbers_raises_nothing(tmp_path: Path) -> None:
    assert count_numbers(written(tmp_path, b"\xef\xbb\xbf# x\n\n1, 2 3\nfour")) == 3
    assert count_numbers(written(tmp_path, b"1 two 3")) == 0
    assert count_numbers(written(tmp_path, bytes(range(256)))) == 0
    assert count_numbers(tmp_path) == 0
    assert count_numbers(tmp_path / "none") == 0
