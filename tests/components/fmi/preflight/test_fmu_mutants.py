"""Random changes to good FMUs: whatever comes out is accepted or refused, and nothing else ever happens."""

import random
import time

import pytest
from bad_fmus import Member, members, pack_archive, read_members

from cosim.components.fmi import FmuFile
from cosim.components.fmi.preflight import elf
from cosim.components.fmi.preflight.fmu_platform import current_platform
from cosim.components.fmi.preflight.library import InvalidLibraryError, SharedLibrary
from cosim.components.fmi.preflight.validation import validate_fmu
from cosim.core import resources
from cosim.core.errors import InputError

#: for each FMI version, or library; long ones: 100 000 archives, and as many model descriptions
SHORT = 150
WORDS = (
    b"",
    b"-1",
    b"NaN",
    b"1e999",
    b"4294967296",
    b"\xff",
    b"\0",
    b"<",
    b'"',
    b"&amp;",
    b"]]>",
    b"<!DOCTYPE x>",
    b"\xe2\x80\xae",
    b"PK\5\6",
)


def counts(many):
    return pytest.mark.parametrize("count", [SHORT, pytest.param(many, marks=pytest.mark.fuzz)])


def dice(seed):
    return random.Random(seed)  # noqa: S311 - mutants have to come back the same


def mutant(content, draw):
    """One to four changes: bytes flipped, cut, doubled, moved, or replaced by a telling word."""
    content = bytearray(content)
    for _ in range(draw.randint(1, 4)):
        place = draw.randrange(len(content) + 1)
        length = min(draw.choice((1, 1, 2, 4, 30, 300)), len(content) - place)
        piece = content[place : place + length]
        flipped = bytes(b ^ 1 << draw.randrange(8) for b in piece)
        content[place : place + length] = draw.choice((flipped, b"", piece * 2, draw.choice(WORDS), draw.randbytes(length)))
    return bytes(content)


def outcome(path):
    """What becomes of an FMU up to the moment before its library would be loaded."""
    begin = time.process_time()
    file = FmuFile(path)
    try:
        _ = file.description
        file.acquire()
        file.release()
        result = "accepted"
    except InputError as error:
        assert str(error)
        result = "refused"
    errors = [finding for finding in validate_fmu(path) if finding.rule.severity == "error"]
    assert bool(errors) == (result == "refused"), errors
    assert time.process_time() - begin < 2
    return result


@counts(50_000)
@pytest.mark.parametrize("version", [2, 3])
def test_mutated_archives(version, count, good, tmp_path):
    draw = dice(version)
    archive = pack_archive(members(good[version] | {"resources/data.txt": b"data" * 100}))
    path = tmp_path / "mutant.fmu"
    results = []
    for _ in range(count):
        path.write_bytes(mutant(archive, draw))
        results.append(outcome(path))
    assert set(results) == {"accepted", "refused"} or set(results) == {"refused"}


@counts(25_000)
@pytest.mark.parametrize("version", [2, 3])
def test_mutated_descriptions(version, count, good, tmp_path):
    draw = dice(version)
    others = members(good[version])[1:]
    path = tmp_path / "mutant.fmu"
    results = []
    for _ in range(count):
        xml = mutant(good[version]["modelDescription.xml"], draw)
        path.write_bytes(pack_archive([Member("modelDescription.xml", xml), *others]))
        results.append(outcome(path))
    assert set(results) == {"accepted", "refused"}


@counts(25_000)
@pytest.mark.parametrize("version", [2, 3])
def test_mutated_attributes(version, count, good, tmp_path):
    """The XML stays well-formed: only attributes change."""
    draw = dice(version)
    pieces = good[version]["modelDescription.xml"].split(b'"')
    values = sorted(
        {*pieces[1::2], b"", b"-1", b"NaN", b"INF", b"1e999", b"99999999999999999999999", b"\xc3\xa9", b" 1 ", b"0x1", b"a b"}
    )
    others = members(good[version])[1:]
    path = tmp_path / "mutant.fmu"
    results = []
    for _ in range(count):
        changed = list(pieces)
        for _ in range(draw.randint(1, 3)):
            changed[draw.randrange(3, len(pieces) // 2) * 2 + 1] = draw.choice(values)
        path.write_bytes(pack_archive([Member("modelDescription.xml", b'"'.join(changed)), *others]))
        results.append(outcome(path))
    assert set(results) == {"accepted", "refused"}


@counts(50_000)
@pytest.mark.parametrize("name", ["fmus/strider.fmu", "fmus/python/vtol.fmu"])
def test_mutated_libraries(name, count):
    draw = dice(name)
    files = read_members(resources.root() / name)
    library = next(content for member, content in files.items() if member.endswith(".so"))
    results = set()
    for _ in range(count):
        # the headers and tables that are followed stand at the beginning
        content = mutant(library[:8192], draw) + library[8192:] if draw.random() < 0.8 else mutant(library, draw)
        begin = time.process_time()
        try:
            results.add(type(elf.read_library(content, current_platform().architecture)))
        except InvalidLibraryError as damage:
            assert str(damage).startswith(("is ", "has "))
            results.add(type(damage))
        assert time.process_time() - begin < 2
    assert results == {SharedLibrary, InvalidLibraryError}
