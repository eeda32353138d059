"""Addresses of stores: which are taken, and that no secret is."""

import sys
from pathlib import Path

import pytest

from ars_web.errors import BadInput
from ars_web.recordings.stores import StoreFolder, is_address, place, store_folder


def test_a_path_is_no_address() -> None:
    assert place("sets/d") == Path("sets/d")
    assert place("/sets/d") == Path("/sets/d")
    assert place("file:///sets/a%20b/") == Path("/sets/a b")
    assert place("s3://bucket/sets/") == StoreFolder("s3://bucket/sets")
    assert place("S3://bucket/Sets") == StoreFolder("s3://bucket/Sets")
    assert [is_address(text) for text in ("C:/x", "a:b", "//x", "s3://b", "gs://b")] == [
        False,
        False,
        False,
        True,
        True,
    ]


@pytest.mark.parametrize("address", ["s3://key:Secr3t@bucket/d", "s3://bucket/d?token=Secr3t", "ftp://u:Secr3t@host/d"])
def test_a_secret_in_an_address_is_refused_and_not_repeated(address: str) -> None:
    with pytest.raises(BadInput, match="holds a password or a query") as refused:
        place(address)
    assert "Secr3t" not in str(refused.value)


@pytest.mark.parametrize(
    ("address", "says"),
    [
        ("http://host/d", "no folders that can be listed"),
        ("https://host/d", "no folders that can be listed"),
        ("simplecache::s3://bucket/d", "'simplecache::s3://bucket/d'"),
        ("s3://bucket/a::b", "an address within an address"),
        ("s3://", "names no bucket"),
        ("file://host/x", "is no folder of this machine"),
        ("nope://x/y", "nope"),
        ("s3://bucket/a\nb", "cannot be printed"),
    ],
)
def test_addresses_that_cannot_be(address: str, says: str) -> None:
    with pytest.raises(BadInput, match=says):
        store_folder(address) if "::s3" in address else place(address)


def test_without_its_package_a_store_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(BadInput, match=r"install the extra `cluster` \(pip install 'ars-web\[cluster\]'\)"):
        place("s3://bucket/d")


def test_files_of_a_store(tmp_path: Path) -> None:
    folder = store_folder(f"memory://{tmp_path.name}/d")
    assert folder.names() == []
    (tmp_path / "a").write_bytes(b"one")
    folder.upload([(tmp_path / "a", "x/a"), (tmp_path / "a", "b")])
    StoreFolder(f"{folder}.other").write("c", b"")
    assert folder.names() == ["b", "x/a"]
    assert folder.below("x").names() == ["a"]
    assert folder.read("x/a") == b"one"
    assert (folder.has("b"), folder.has("nothing"), folder.detail("b")[0]) == (True, False, 3)
    assert folder.ranges([("b", 0, 2), ("x/a", 1, 3)]) == [b"on", b"ne"]
    folder.download(["x/a"], tmp_path / "down")
    assert (tmp_path / "down" / "x" / "a").read_bytes() == b"one"
    folder.remove(["b", "nothing"])
    assert folder.names() == ["x/a"]
    with pytest.raises(FileNotFoundError) as missing:
        folder.read("b")
    assert missing.value.filename == f"{folder}/b"


def test_what_s3_says_comes_out_as_the_systems_errors(s3: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    folder = store_folder("s3://bucket/d")
    folder.write("a", b"one")
    assert folder.details().keys() == {"a"}
    before = folder.detail("a")
    folder.write("a", b"two")
    assert folder.detail("a") != before
    with pytest.raises(FileNotFoundError, match="there is no such file"):
        folder.read("nothing")
    with pytest.raises(OSError, match=r"no such|not exist|NoSuchBucket"):
        store_folder("s3://no-such-bucket/d").write("a", b"")
