"""Archives of strangers: unpacked within their folder and their limits, or not at all."""

import stat
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from ars_web.errors import BadFile, BadInput, RefusedPath, StoreError, TooLarge
from ars_web.sessions.archive import ArchiveLimits, extract_zip

Pack = Callable[..., Path]


@pytest.fixture
def pack(tmp_path: Path) -> Pack:
    def pack(*members: tuple[str | zipfile.ZipInfo, bytes], compression: int = zipfile.ZIP_STORED) -> Path:
        path = tmp_path / "given.zip"
        with zipfile.ZipFile(path, "w", compression) as archive:
            for member, data in members:
                archive.writestr(member, data, compress_type=compression)
        return path

    return pack


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def assert_refused(source: Path, error: type[Exception], message: str, **limits: int | float) -> None:
    target = source.parent / "out"
    with pytest.raises(error, match=message):
        extract_zip(source, target, limits=ArchiveLimits(**limits))
    assert sorted(path.name for path in source.parent.iterdir()) == ["given.zip"]


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_what_is_in_the_archive_is_in_the_folder(pack: Pack, tmp_path: Path, compression: int):
    source = pack(
        ("poses.txt", b"1 0 0 0\n" * 100), ("images/", b""), ("images/ä 1.jpg", b"x"), ("empty/", b""),
        compression=compression,
    )  # fmt: skip
    extract_zip(source, tmp_path / "out")
    assert files(tmp_path / "out") == {"poses.txt": b"1 0 0 0\n" * 100, "images/ä 1.jpg": b"x"}
    assert (tmp_path / "out" / "empty").is_dir()


def test_an_empty_folder_may_be_the_target_and_nothing_else(pack: Pack, tmp_path: Path):
    source = pack(("a", b"x"))
    (tmp_path / "out").mkdir()
    extract_zip(source, tmp_path / "out")
    with pytest.raises(BadInput, match="something here already"):
        extract_zip(source, tmp_path / "out")
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(BadInput, match="something here already"):
        extract_zip(source, tmp_path / "link")


@pytest.mark.parametrize(
    "name",
    [
        "../a",
        "a/../../b",
        "/etc/passwd",
        "//x",
        "C:/x",
        "C:x",
        "a\\..\\b",
        "./a",
        "a//b",
        "a/./b",
        "..",
        "a\nb",
        "\x7f",
    ],
)
def test_a_name_that_could_leave_the_folder_is_refused(pack: Pack, name: str):
    member = zipfile.ZipInfo()
    member.filename = member.orig_filename = name
    assert_refused(pack(("good", b"x"), (member, b"x")), RefusedPath, "a member")


def test_a_name_cut_by_a_nul_is_refused(pack: Pack):
    source = pack(("a.txtX.jpg", b"x"))
    source.write_bytes(source.read_bytes().replace(b"a.txtX.jpg", b"a.txt\0.jpg"))
    assert_refused(source, RefusedPath, "which would leave the folder or cannot be a path")


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFBLK, stat.S_IFSOCK])
def test_links_and_devices_are_refused(pack: Pack, kind: int):
    member = zipfile.ZipInfo("link")
    member.external_attr = (kind | 0o777) << 16
    assert_refused(pack((member, b"/etc/passwd")), RefusedPath, "a link or a device")


@pytest.mark.parametrize(
    "names", [("a", "a"), ("a", "A"), ("\u00e9", "e\u0301"), ("a", "a/b"), ("x/a", "X/A/b")], ids=str
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_one_name_for_two_things_is_refused(pack: Pack, names: tuple[str, str]):
    assert_refused(pack(*((name, b"x") for name in names)), RefusedPath, "occurs twice|file and a folder")


def test_limits_are_kept(pack: Pack):
    many = pack(*((f"{i}", b"") for i in range(11)))
    assert_refused(many, TooLarge, "holds 11 members; at most 10", members=10)
    assert_refused(pack(("x" * 101, b"")), TooLarge, "longer than 100 bytes", name_bytes=100)
    assert_refused(pack(("ä" * 51, b"")), TooLarge, "longer than 100 bytes", name_bytes=100)
    for name in ("x" * 256, "ä" * 128 + "/a"):
        assert_refused(pack((name, b"")), TooLarge, "a name over 255 bytes")
    assert_refused(pack(("a", b"x" * 600), ("b", b"x" * 600)), TooLarge, "more than 1000 bytes", bytes=1000)


def test_a_bomb_is_refused_before_it_is_unpacked(pack: Pack):
    source = pack(("zeros", b"\0" * 5_000_000), compression=zipfile.ZIP_DEFLATED)
    assert source.stat().st_size < 10_000
    assert_refused(source, TooLarge, "100 times the archive's own size")


def test_a_short_file_of_equal_lines_is_no_bomb(pack: Pack, tmp_path: Path):
    extract_zip(pack(("poses.txt", b"0 0 0 0 0 0 1\n" * 50_000), compression=zipfile.ZIP_DEFLATED), tmp_path / "out")
    assert (tmp_path / "out" / "poses.txt").stat().st_size == 700_000


def test_members_that_share_their_bytes_count_each(pack: Pack):
    """A bomb of many entries over one piece of data says nothing untrue of any one of them."""
    source = pack(("x" * 8, b"\0" * 900_000), compression=zipfile.ZIP_DEFLATED)
    raw = source.read_bytes()
    start = raw.index(b"PK\1\2")
    end = raw.index(b"PK\5\6")
    entry, count = raw[start:end], 1000
    entries = b"".join(entry.replace(b"x" * 8, b"%08d" % i) for i in range(count))
    tail = bytearray(raw[end:])
    tail[8:12] = count.to_bytes(2, "little") * 2
    tail[12:16] = len(entries).to_bytes(4, "little")
    source.write_bytes(raw[:start] + entries + bytes(tail))
    assert_refused(source, TooLarge, "times the archive's own size")


def test_an_archive_that_lies_about_a_size_is_refused(pack: Pack):
    source = pack(("zeros", b"\0" * 500_000), compression=zipfile.ZIP_DEFLATED)
    raw = source.read_bytes()
    source.write_bytes(raw.replace((500_000).to_bytes(4, "little"), (50).to_bytes(4, "little")))
    assert_refused(source, BadFile, "damaged")


def test_damage_is_said_to_be_damage(pack: Pack, tmp_path: Path):
    source = pack(("a", b"0123456789" * 100))
    whole = source.read_bytes()
    for damaged in (b"", b"no zip", whole[:500], whole.replace(b"0123", b"3210", 1), whole[:-30]):
        source.write_bytes(damaged)
        assert_refused(source, BadFile, r"given\.zip: is no zip archive or a damaged one")
    source.write_bytes(pack(("b", b"\1\2\3\4" * 1000), compression=zipfile.ZIP_DEFLATED).read_bytes())
    raw = bytearray(source.read_bytes())
    raw[40:44] = b"\xff\xff\xff\xff"
    source.write_bytes(raw)
    assert_refused(source, BadFile, "damaged")


def test_an_archive_that_lost_its_beginning_is_damaged(pack: Pack):
    source = pack(("a", b"0123456789" * 100), ("b", b"x"))
    source.write_bytes(source.read_bytes()[200:])
    assert_refused(source, BadFile, "damaged zip archive: a member is said to lie outside it")


def test_a_member_said_to_lie_beyond_any_file_is_damage(pack: Pack):
    source = pack(("a", b"x"))
    raw = source.read_bytes()
    start, end = raw.index(b"PK\1\2"), raw.index(b"PK\5\6")
    entry, tail = bytearray(raw[start:end]), bytearray(raw[end:])
    extra = struct.pack("<HHQ", 1, 8, 2**64 - 1)  # ZIP64: where the member's own header is
    entry[30:32] = struct.pack("<H", len(extra))
    entry[42:46] = b"\xff" * 4
    tail[12:16] = struct.pack("<I", len(entry) + len(extra))
    source.write_bytes(raw[:start] + entry + extra + tail)
    assert_refused(source, BadFile, "lie outside it")


@pytest.mark.parametrize("header", [b"PK\1\2", b"PK\3\4"])
def test_a_name_that_is_not_the_text_it_says_it_is_is_damage(pack: Pack, header: bytes):
    source = pack(("ä.txt", b"x"))
    raw = source.read_bytes()
    at = raw.index("ä".encode(), raw.index(header))
    source.write_bytes(raw[:at] + b"\xff\xff" + raw[at + 2 :])
    assert_refused(source, BadFile, "damaged")


def test_other_packings_and_passwords_are_refused(pack: Pack):
    assert_refused(pack(("a", b"x" * 100), compression=zipfile.ZIP_LZMA), BadFile, "packed by method 14")
    source = pack(("a", b"x"))
    raw = source.read_bytes()
    start = raw.index(b"PK\1\2")
    source.write_bytes(raw[: start + 8] + b"\1" + raw[start + 9 :])
    assert_refused(source, BadFile, "encrypted")


def test_a_missing_archive_or_an_impossible_target_is_said_in_words(pack: Pack, tmp_path: Path):
    with pytest.raises(BadFile, match=r"nothing\.zip: cannot be read: No such file"):
        extract_zip(tmp_path / "nothing.zip", tmp_path / "out")
    (tmp_path / "file").write_text("x")
    with pytest.raises(StoreError, match="cannot be unpacked here"):
        extract_zip(pack(("a", b"x")), tmp_path / "file" / "out")
