"""Cache of FMUs built from Modelica sources: one build for all processes, and damaged files are
replaced.
"""

from __future__ import annotations

import os
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cosim.core.errors import InputError, OutputError
from cosim.export.build import cached_fmu
from cosim.export.cache import _is_intact
from cosim.export.fmu.package import write_archive

MODELICA = """
block Doubler
  parameter Real k = 2;
  input Real u(start = 0);
  output Real y(start = 0);
equation
  when sample(0, 1) then
    y = k*u;
  end when;
end Doubler;
"""


@pytest.fixture
def source(tmp_path: Path) -> Path:
    (tmp_path / "models").mkdir()
    path = tmp_path / "models" / "Doubler.mo"
    path.write_text(MODELICA)
    return path


def damage(fmu: Path, kind: str) -> None:
    content = bytearray(fmu.read_bytes())
    content[len(content) // 2] ^= 1
    match kind:
        case "empty":
            fmu.write_bytes(b"")
        case "truncated":
            fmu.write_bytes(content[:500])
        case "changed":
            fmu.write_bytes(content)
        case "missing":
            fmu.unlink()
        case "without a digest":
            fmu.with_suffix(".sha256").unlink()
        case "unfinished":
            fmu.replace(fmu.with_name(f".{fmu.name}.0123.part"))


KINDS = ("empty", "truncated", "changed", "missing", "without a digest", "unfinished")


def test_a_damaged_fmu_in_the_cache_is_built_again(source, cache, tmp_path):
    fmu = cached_fmu(source, "Doubler")
    content = fmu.read_bytes()
    for kind in KINDS:
        copy = shutil.copytree(fmu.parent, tmp_path / kind) / fmu.name
        assert _is_intact(copy)
        damage(copy, kind)
        assert not _is_intact(copy), kind
    damage(fmu, "unfinished")
    fmu.write_bytes(content[:500])
    assert cached_fmu(source, "Doubler").read_bytes() == content
    assert not list(cache.rglob("*.part"))


def test_processes_that_build_an_fmu_at_once_use_the_same_file(source, cache):
    reader, writer = os.pipe()
    children = []
    for _ in range(4):
        if (child := os.fork()) == 0:
            try:
                file = cached_fmu(source, "Doubler")
                os.write(writer, f"{file.stat().st_ino} {file.stat().st_mtime_ns}\n".encode())
            finally:
                os._exit(0)
        children.append(child)
    for child in children:
        os.waitpid(child, 0)
    os.close(writer)
    with os.fdopen(reader) as answers:
        identities = answers.read().splitlines()
    assert len(identities) == 4
    assert len(set(identities)) == 1
    assert len(list(cache.rglob("*.fmu"))) == 1


@contextmanager
def file_size_limit(size: int) -> Iterator[None]:
    """Let writing of larger files fail, as on a full disk."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.parametrize("size", [0, 1000, 4500])
def test_a_full_disk_leaves_the_former_fmu_and_no_part_of_a_new_one(tmp_path, size):
    fmu = tmp_path / "a.fmu"
    fmu.write_bytes(b"former")
    with (
        file_size_limit(size),
        pytest.raises(OutputError, match=r"cannot write .*a.fmu: .*File too large"),
    ):
        write_archive({"a": os.urandom(5000)}, fmu)
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"former"]


@pytest.mark.usefixtures("cache")
def test_a_cache_that_cannot_be_written_is_named(source, tmp_path, monkeypatch):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.raises(
        InputError, match=r'cannot write to ".*file/cosim/fmus/\w+": Not a directory'
    ):
        cached_fmu(source, "Doubler")
