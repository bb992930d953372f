"""Hostile and damaged archives: refused by the rule they break, before anything of them is written
or run.
"""

import os
import socket
import tempfile
import time
import tracemalloc
from dataclasses import replace
from pathlib import Path

import pytest
from bad_fmus import Member, find_problems, members, pack_archive, refusal_message, with_headers

from cosim.components.fmi import FmuFile
from cosim.components.fmi.preflight import archive, binary, xml, zip_format
from cosim.core.errors import InputError

EXTRA = Member("resources/data.txt", b"data " * 50)


def with_member(name, **more):
    return lambda good: pack_archive([*good, Member(name, b"evil", **more)])


def with_extra(change):
    """The good FMU with one more member, after a change to it."""
    return lambda good: pack_archive([*good, change(EXTRA)])


def overlapping(good):
    """Two names for the same bytes."""
    return pack_archive(
        [
            *good,
            replace(
                good[0], name="resources/again", offset=0, central={"name": b"resources/again"}
            ),
        ]
    )


def nested(good):
    """A member inside the data of a stored member."""
    inner = Member("resources/inner", b"inside")
    outer = Member("resources/outer", inner.local_header() + inner.data, deflated=False)
    offset = sum(len(m.local_header() + m.data) for m in good) + len(outer.local_header())
    return pack_archive([*good, outer, replace(inner, offset=offset)])


def two_ends(good):
    """An archive whose comment contains a second archive with another description."""
    hidden = pack_archive([Member("modelDescription.xml", b"<other/>")])
    return pack_archive(good, comment=hidden)


NAMES = {
    "parent": ("../evil.txt", "archive.name", 'contains an empty, "." or ".." part'),
    "parent inside": (
        "resources/../../evil.txt",
        "archive.name",
        'contains an empty, "." or ".." part',
    ),
    "absolute": ("/etc/evil.txt", "archive.name", "relative path"),
    "double slash": ("resources//evil.txt", "archive.name", "contains an empty"),
    "backslash": ("..\\evil.txt", "archive.name", '".." part'),
    "drive": ("C:/evil.txt", "archive.name", "colon"),
    "stream": ("resources/a.txt:stream", "archive.name", "colon"),
    "null": ("resources/a\0.txt", "archive.name", "control characters"),
    "escape": ("resources/\x1b[2J.txt", "archive.name", "control characters"),
    "newline": ("resources/a\n.txt", "archive.name", "control characters"),
    "right to left": ("resources/\u202etxt.exe", "archive.name", "non-printable characters"),
    "empty": ("", "archive.name", "contains an empty"),
    "long": ("resources/" + "a" * 300, "archive.name", "longer than 255 bytes"),
    "deep": ("a/" * 80 + "b", "archive.name", "is nested 80 folders deep, expected at most 64"),
    "no UTF-8": (b"resources/\xff\xfe", "archive.name", "not UTF-8"),
    "twice": ("modelDescription.xml", "archive.collision", "occurs twice"),
    "other case": ("MODELDESCRIPTION.XML", "archive.collision", "differs only in case"),
    "below a file": ("modelDescription.xml/evil", "archive.collision", "which is a file"),
}
HEADERS = {
    "symbolic link": (
        with_extra(lambda m: with_headers(m, mode=0o120777)),
        "archive.kind",
        "is a symbolic link",
    ),
    "device": (with_extra(lambda m: with_headers(m, mode=0o060644)), "archive.kind", "is a device"),
    "pipe": (
        with_extra(lambda m: with_headers(m, mode=0o010644)),
        "archive.kind",
        "is a named pipe",
    ),
    "folder with content": (
        with_member("resources/x/"),
        "archive.kind",
        "is a folder with 4 bytes",
    ),
    "encrypted": (
        with_extra(lambda m: with_headers(m, flags=0x801)),
        "archive.encryption",
        "is encrypted",
    ),
    "strongly encrypted": (
        with_extra(lambda m: with_headers(m, flags=0x841)),
        "archive.encryption",
        "is encrypted",
    ),
    "LZMA": (
        with_extra(lambda m: with_headers(m, method=14)),
        "archive.compression",
        "method 14, expected 0 (stored) or 8",
    ),
    "other name": (
        with_extra(lambda m: replace(m, local={"name": b"resources/evil"})),
        "archive.header",
        "has name",
    ),
    "other size": (
        with_extra(lambda m: replace(m, local={"size": 1})),
        "archive.header",
        "has size 1",
    ),
    "other method": (
        with_extra(lambda m: replace(m, local={"method": 0})),
        "archive.header",
        "has method 0",
    ),
    "other CRC": (
        with_extra(lambda m: replace(m, local={"crc": 5})),
        "archive.header",
        "has CRC 5",
    ),
    "no header": (
        lambda good: pack_archive([*good, replace(EXTRA, offset=7)]),
        "archive.header",
        "found no member at byte 7",
    ),
    "offset beyond": (
        lambda good: pack_archive([*good, replace(EXTRA, offset=2**32 - 2)]),
        "archive.header",
        "found no member",
    ),
    "same bytes": (overlapping, "archive.header", "has name"),
    "same header": (
        lambda good: pack_archive([*good, replace(good[0], offset=0)]),
        "archive.overlap",
        "shares its bytes",
    ),
    "nested": (nested, "archive.overlap", "shares its bytes"),
    "longer than the archive": (
        with_extra(lambda m: with_headers(m, compressed=10**6)),
        "archive.overlap",
        "shares its bytes",
    ),
}
DATA = {
    "wrong CRC": (with_extra(lambda m: with_headers(m, crc=5)), "archive.data", "found CRC"),
    "too short": (
        with_extra(lambda m: with_headers(m, size=999)),
        "archive.data",
        "found 250 bytes, expected 999",
    ),
    "too long": (
        with_extra(lambda m: with_headers(m, size=9)),
        "archive.data",
        "found more bytes, expected 9",
    ),
    "no deflate stream": (
        with_extra(
            lambda m: replace(m, deflated=False, local={"method": 8}, central={"method": 8})
        ),
        "archive.data",
        "damaged",
    ),
    "stored size": (
        with_extra(lambda m: with_headers(replace(m, deflated=False), size=9)),
        "archive.size",
        "stored in 250 bytes but has a size of 9",
    ),
}
STRUCTURE = {
    "empty file": (lambda _: b"", "archive.zip", "is not an FMU: it is not a ZIP file"),
    "text": (lambda _: b"hello" * 100, "archive.zip", "is not an FMU: it is not a ZIP file"),
    "no members": (
        lambda _: pack_archive([]),
        "archive.description",
        "no member 'modelDescription.xml'",
    ),
    "cut in half": (
        lambda good: pack_archive(good)[: len(pack_archive(good)) // 2],
        "archive.zip",
        "its end is missing",
    ),
    "cut at the end": (lambda good: pack_archive(good)[:-1], "archive.zip", "its end is missing"),
    "cut at the front": (
        lambda good: pack_archive(good)[100:],
        "archive.contents",
        "should end at byte",
    ),
    "data in front": (
        lambda good: b"#!/bin/sh\n" + pack_archive(good),
        "archive.contents",
        "should end at byte",
    ),
    "data behind": (
        lambda good: pack_archive(good) + b"more",
        "archive.trailing-data",
        "found 4 bytes behind the end",
    ),
    "two ends": (two_ends, "archive.trailing-data", "a second end"),
    "several disks": (
        lambda good: pack_archive(good)[:-18] + b"\1\0\1\0" + pack_archive(good)[-14:],
        "archive.contents",
        "several parts",
    ),
    "too many listed": (lambda good: pack_archive(good, count=99), "archive.contents", "damaged"),
    "too few listed": (
        lambda good: pack_archive(good, count=1),
        "archive.contents",
        "bytes longer than its 1 header",
    ),
    "10001 members": (
        lambda good: pack_archive([*good, *(Member(f"resources/{i}") for i in range(10_000))]),
        "archive.contents",
        "found 10002",
    ),
    "a gigabyte": (
        with_extra(lambda m: with_headers(m, size=2**30, compressed=10**7)),
        "archive.size",
        "expected at most 1073741824",
    ),
    "a bomb": (
        lambda good: pack_archive([*good, Member("resources/zeros", bytes(1 << 25))]),
        "archive.size",
        "expected at most 200 times",
    ),
}
CASES = (
    {name: (with_member(path), rule, words) for name, (path, rule, words) in NAMES.items()}
    | HEADERS
    | DATA
    | STRUCTURE
)


@pytest.mark.parametrize("case", CASES)
def test_bad_archives_are_refused(case, good, tmp_path, monkeypatch):
    build, rule, words = CASES[case]
    inside = tmp_path / "inside"
    inside.mkdir()
    path = tmp_path / "bad.fmu"
    path.write_bytes(build(members(good[2])))
    monkeypatch.setattr(tempfile, "tempdir", str(inside))
    begin = time.process_time()
    assert words in refusal_message(path)
    assert (rule, True) in [(f.rule, words in f.message) for f in find_problems(path)]
    assert time.process_time() - begin < 1
    assert list(inside.iterdir()) == []
    assert sorted(tmp_path.iterdir()) == [path, inside]


@pytest.mark.parametrize("version", [2, 3])
def test_a_good_fmu_has_no_findings(version, probes):
    assert find_problems(probes[version]) == []


@pytest.mark.parametrize(
    "harmless",
    [
        Member("resources/"),
        Member("resources/größe.txt", b"x"),
        Member(
            "resources/größe.txt".encode("cp437"), b"x", local={"flags": 0}, central={"flags": 0}
        ),
        Member("resources/stored", b"x", deflated=False),
        with_headers(EXTRA, mode=0),
        with_headers(EXTRA, mode=0o100755),
        replace(
            EXTRA,
            local={"flags": 0x808, "crc": 0, "compressed": 0, "size": 0},
            central={"flags": 0x808},
            trailing_bytes=bytes(16),
        ),
        replace(
            EXTRA,
            local={
                "compressed": 2**32 - 1,
                "size": 2**32 - 1,
                "extra": b"\1\0\x10\0"
                + len(EXTRA.content).to_bytes(8, "little")
                + len(EXTRA.data).to_bytes(8, "little"),
            },
        ),
    ],
    ids=[
        "folder",
        "UTF-8",
        "code page 437",
        "stored",
        "no mode",
        "executable",
        "sizes behind the data",
        "ZIP64",
    ],
)
def test_archives_of_common_tools_are_accepted(harmless, good, tmp_path):
    path = tmp_path / "good.fmu"
    path.write_bytes(pack_archive([*members(good[2]), harmless]))
    assert find_problems(path) == []
    file = FmuFile(path)
    folder = file.acquire()
    assert (
        folder / harmless.name
        if isinstance(harmless.name, str)
        else folder / harmless.name.decode("cp437")
    ).exists()
    file.release()


@pytest.mark.parametrize("front", [b"x" * 100], ids=["hidden bytes"])
def test_bytes_between_members_are_a_warning(front, good, tmp_path):
    path = tmp_path / "gap.fmu"
    path.write_bytes(pack_archive(members(good[2]), front=front))
    assert [(f.rule, f.severity) for f in find_problems(path)] == [("archive.gap", "warning")]
    assert FmuFile(path).description.model_name == "Probe"


def special_files(folder):
    os.mkfifo(folder / "pipe")
    (folder / "folder").mkdir()
    server = socket.socket(socket.AF_UNIX)
    server.bind(str(folder / "socket"))
    server.close()
    return {
        "pipe": "a named pipe",
        "folder": "a folder",
        "socket": "cannot be opened",
        "/dev/zero": "a device",
        "missing": "does not exist",
    }


def test_special_files_are_refused_without_blocking(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, words in special_files(tmp_path).items():
        assert words in refusal_message(Path(name))
        with pytest.raises(InputError):
            _ = FmuFile(Path(name)).sha256


def test_a_symbolic_link_to_a_valid_fmu_is_accepted(probes, tmp_path):
    (tmp_path / "link.fmu").symlink_to(probes[2])
    assert find_problems(tmp_path / "link.fmu") == []


@pytest.mark.parametrize(
    ("module", "limits", "words"),
    [
        (zip_format, {"MAX_MEMBERS": 1}, "found 2 members, expected at most 1"),
        (archive, {"MAX_EXPANDED_SIZE": 1000}, "bytes, expected at most 1000"),
        (archive, {"MAX_RATIO": 2, "RATIO_THRESHOLD": 1000}, "expected at most 2 times as many"),
        (binary, {"MAX_LIBRARY_SIZE": 1000}, "the library has .* bytes, expected at most 1000"),
        (xml, {"MAX_XML_SIZE": 100}, "bytes, expected at most 100"),
        (xml, {"MAX_XML_TAGS": 5}, "tags, expected at most 5"),
    ],
)
def test_an_fmu_above_a_limit_is_refused(module, limits, words, good, tmp_path, monkeypatch):
    for name, value in limits.items():
        monkeypatch.setattr(module, name, value)
    path = tmp_path / "good.fmu"
    path.write_bytes(pack_archive(members(good[2])))
    with pytest.raises(InputError, match=words):
        FmuFile(path).check_binary()


def test_a_member_with_a_false_size_needs_no_memory(good, tmp_path):
    path = tmp_path / "bomb.fmu"
    path.write_bytes(
        pack_archive(
            [*members(good[2]), with_headers(Member("resources/zeros", bytes(1 << 25)), size=1000)]
        )
    )
    tracemalloc.start()
    assert "found more bytes, expected 1000" in refusal_message(path)
    assert tracemalloc.get_traced_memory()[1] < 2**22
    tracemalloc.stop()


def test_a_huge_central_directory_is_not_read(good, tmp_path, monkeypatch):
    monkeypatch.setattr(zip_format, "MAX_MEMBERS", 3)
    path = tmp_path / "bad.fmu"
    path.write_bytes(pack_archive([*members(good[2]), with_headers(EXTRA, extra=bytes(60_000))]))
    with pytest.raises(
        InputError, match=r"found a central directory of 60[0-9]+ bytes, expected at most 12288"
    ):
        _ = FmuFile(path).description


def test_only_the_first_of_many_problems_are_listed(good, tmp_path):
    path = tmp_path / "bad.fmu"
    path.write_bytes(pack_archive([*members(good[2]), *(Member(f"../{i}") for i in range(5000))]))
    lines = refusal_message(path).splitlines()
    assert len(lines) == 101
    assert lines[-1].endswith("and 4900 more errors")


def test_deeply_nested_folders_are_checked_quickly(good, tmp_path):
    path = tmp_path / "deep.fmu"
    path.write_bytes(
        pack_archive(
            [*members(good[2]), *(Member("a/" * 500 + str(i), deflated=False) for i in range(9000))]
        )
    )
    begin = time.process_time()
    assert "is nested 500 folders deep" in refusal_message(path)
    assert time.process_time() - begin < 2


def test_all_problems_of_an_archive_are_reported_together(good, tmp_path):
    path = tmp_path / "bad.fmu"
    path.write_bytes(
        pack_archive(
            [*members(good[2]), Member("../a"), Member("/b"), with_headers(EXTRA, mode=0o120777)]
        )
    )
    assert len(refusal_message(path).splitlines()) == 3


def test_an_fmu_that_changes_after_the_check_is_refused(probes, good, tmp_path):
    path = tmp_path / "changing.fmu"
    path.write_bytes(probes[2].read_bytes())
    file = FmuFile(path)
    file.check_binary()
    path.write_bytes(pack_archive([*members(good[2]), Member("resources/new", b"x")]))
    with pytest.raises(InputError, match="was changed after it had been examined"):
        file.acquire()


def test_extraction_writes_exactly_the_members(good, tmp_path):
    path = tmp_path / "good.fmu"
    path.write_bytes(pack_archive([*members(good[2]), EXTRA]))
    file = FmuFile(path)
    folder = file.acquire()
    written = {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert written == good[2] | {EXTRA.name: EXTRA.content}
    assert not any(p.is_symlink() for p in folder.rglob("*"))
    file.release()
    assert not folder.exists()


@pytest.mark.parametrize(
    "unused", ["sources/model.c", "documentation/index.html", "binaries/amiga/model.so"]
)
def test_what_a_run_does_not_use_is_not_extracted(good, tmp_path, unused):
    path = tmp_path / "good.fmu"
    path.write_bytes(
        pack_archive(
            [*members(good[2]), Member(unused, b"unused"), Member("binariesX/a", b"used"), EXTRA]
        )
    )
    file = FmuFile(path)
    folder = file.acquire()
    assert not (folder / unused).parent.exists()
    assert (folder / "binariesX/a").read_bytes() == b"used"
    assert (folder / EXTRA.name).is_file()
    file.release()
