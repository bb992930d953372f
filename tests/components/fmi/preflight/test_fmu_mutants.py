"""Random changes to valid FMUs: each result is either accepted or refused with an InputError, in
limited time.
"""

import random
import time

import pytest
from bad_fmus import Member, members, pack_archive, read_members

from cosim.components.fmi import FmuFile
from cosim.components.fmi.preflight import elf
from cosim.components.fmi.preflight.platforms import (
    InvalidLibraryError,
    SharedLibrary,
    current_platform,
)
from cosim.components.fmi.preflight.validation import validate_fmu
from cosim.core import resources
from cosim.core.errors import InputError

#: mutants for each FMI version or library; the fuzz tests make 100 000 archives and as many model
#: descriptions
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


def seeded_random(seed):
    return random.Random(seed)  # noqa: S311 - seeded for reproducible mutants


def mutate(content, rng):
    """Make one to four changes: bytes are flipped, removed, repeated, or replaced by random bytes
    or by one of WORDS.
    """
    content = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        begin = rng.randrange(len(content) + 1)
        length = min(rng.choice((1, 1, 2, 4, 30, 300)), len(content) - begin)
        piece = content[begin : begin + length]
        flipped = bytes(b ^ 1 << rng.randrange(8) for b in piece)
        content[begin : begin + length] = rng.choice(
            (flipped, b"", piece * 2, rng.choice(WORDS), rng.randbytes(length))
        )
    return bytes(content)


def outcome(path):
    """Return "accepted" or "refused" after all steps before the library would be loaded."""
    begin = time.process_time()
    file = FmuFile(path)
    try:
        _ = file.description
        file.acquire()
        file.release()
        result = "accepted"
    except InputError as error:
        result = "refused" if str(error) else "refused without a message"
    errors = [finding for finding in validate_fmu(path) if finding.severity == "error"]
    assert result == ("refused" if errors else "accepted"), errors
    assert time.process_time() - begin < 2
    return result


@counts(50_000)
@pytest.mark.parametrize("version", [2, 3])
def test_mutated_archives(version, count, good, tmp_path):
    rng = seeded_random(version)
    archive = pack_archive(members(good[version] | {"resources/data.txt": b"data" * 100}))
    path = tmp_path / "mutant.fmu"
    results = []
    for _ in range(count):
        path.write_bytes(mutate(archive, rng))
        results.append(outcome(path))
    assert set(results) == {"accepted", "refused"} or set(results) == {"refused"}


@counts(25_000)
@pytest.mark.parametrize("version", [2, 3])
def test_mutated_descriptions(version, count, good, tmp_path):
    rng = seeded_random(version)
    others = members(good[version])[1:]
    path = tmp_path / "mutant.fmu"
    results = []
    for _ in range(count):
        xml = mutate(good[version]["modelDescription.xml"], rng)
        path.write_bytes(pack_archive([Member("modelDescription.xml", xml), *others]))
        results.append(outcome(path))
    assert set(results) == {"accepted", "refused"}


@counts(25_000)
@pytest.mark.parametrize("version", [2, 3])
def test_mutated_attributes(version, count, good, tmp_path):
    """The XML stays well-formed: only attributes change."""
    rng = seeded_random(version)
    pieces = good[version]["modelDescription.xml"].split(b'"')
    values = sorted(
        {
            *pieces[1::2],
            b"",
            b"-1",
            b"NaN",
            b"INF",
            b"1e999",
            b"99999999999999999999999",
            b"\xc3\xa9",
            b" 1 ",
            b"0x1",
            b"a b",
        }
    )
    others = members(good[version])[1:]
    path = tmp_path / "mutant.fmu"
    results = []
    for _ in range(count):
        changed = list(pieces)
        for _ in range(rng.randint(1, 3)):
            changed[rng.randrange(3, len(pieces) // 2) * 2 + 1] = rng.choice(values)
        path.write_bytes(
            pack_archive([Member("modelDescription.xml", b'"'.join(changed)), *others])
        )
        results.append(outcome(path))
    assert set(results) == {"accepted", "refused"}


@counts(50_000)
@pytest.mark.parametrize("name", ["fmus/strider.fmu", "fmus/python/vtol.fmu"])
def test_mutated_libraries(name, count):
    rng = seeded_random(name)
    files = read_members(resources.root() / name)
    library = next(content for member, content in files.items() if member.endswith(".so"))
    results = set()
    for _ in range(count):
        # most changes are made in the headers and tables at the beginning
        content = (
            mutate(library[:8192], rng) + library[8192:]
            if rng.random() < 0.8
            else mutate(library, rng)
        )
        begin = time.process_time()
        try:
            results.add(type(elf.read_library(content, current_platform().architecture)))
        except InvalidLibraryError as error:
            results.add(type(error) if str(error).startswith(("is ", "has ")) else str(error))
        assert time.process_time() - begin < 2
    assert results == {SharedLibrary, InvalidLibraryError}
