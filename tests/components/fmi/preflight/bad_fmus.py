"""Invalid FMUs, each made from a valid one by one change."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import pytest

from cosim.components.fmi import FmuFile
from cosim.components.fmi.preflight.findings import Finding
from cosim.components.fmi.preflight.validation import validate_fmu
from cosim.core.errors import InputError


def read_members(fmu: Path) -> dict[str, bytes]:
    with ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@dataclass(frozen=True)
class Member:
    """Member of an archive; `local` and `central` replace fields of its local file header and
    central directory header.
    """

    name: str | bytes
    content: bytes = b""
    deflated: bool = True
    local: Mapping[str, Any] = field(default_factory=dict)
    central: Mapping[str, Any] = field(default_factory=dict)
    trailing_bytes: bytes = b""
    #: offset in the central directory if the member is not to be written (bytes)
    offset: int | None = None

    @property
    def raw_name(self) -> bytes:
        return self.name.encode() if isinstance(self.name, str) else self.name

    @cached_property
    def data(self) -> bytes:
        if not self.deflated:
            return self.content
        compressor = zlib.compressobj(9, zlib.DEFLATED, -15)
        return compressor.compress(self.content) + compressor.flush()

    def fields(self) -> dict[str, Any]:
        return {
            "flags": 0x800,
            "method": 8 if self.deflated else 0,
            "crc": zlib.crc32(self.content),
            "compressed": len(self.data),
            "size": len(self.content),
            "name": self.raw_name,
            "extra": b"",
            "mode": 0o100644,
        }

    def local_header(self) -> bytes:
        f = self.fields() | self.local
        head = struct.pack(
            "<4s5H3L2H",
            b"PK\3\4",
            20,
            f["flags"],
            f["method"],
            0,
            33,
            f["crc"],
            f["compressed"],
            f["size"],
            len(f["name"]),
            len(f["extra"]),
        )
        return head + f["name"] + f["extra"]

    def central_header(self, offset: int) -> bytes:
        f = self.fields() | self.central
        numbers = (0x314, 20, f["flags"], f["method"], 0, 33, f["crc"], f["compressed"], f["size"])
        lengths = (len(f["name"]), len(f["extra"]), 0, 0, 0)
        return (
            struct.pack("<4s6H3L5H2L", b"PK\1\2", *numbers, *lengths, f["mode"] << 16, offset)
            + f["name"]
            + f["extra"]
        )


def pack_archive(
    members: Iterable[Member], comment: bytes = b"", count: int | None = None, front: bytes = b""
) -> bytes:
    """Write an archive; `count` replaces the number of members, `front` is data before the first
    one.
    """
    body, directory, number = bytearray(front), bytearray(), 0
    for member in members:
        directory += member.central_header(len(body) if member.offset is None else member.offset)
        number += 1
        if member.offset is None:
            body += member.local_header() + member.data + member.trailing_bytes
    number = number if count is None else count
    end = struct.pack(
        "<4s4H2LH", b"PK\5\6", 0, 0, number, number, len(directory), len(body), len(comment)
    )
    return bytes(body + directory + end + comment)


def members(files: Mapping[str, bytes]) -> list[Member]:
    return [Member(name, content) for name, content in files.items()]


def with_headers(member: Member, **headers: Any) -> Member:
    """Return the member with the same fields changed in both of its headers."""
    return replace(member, local=headers, central=headers)


def find_problems(path: Path) -> list[Finding]:
    """Return the findings of `cosim validate`."""
    return list(validate_fmu(path))


def _load_fmu(path: Path) -> None:
    file = FmuFile(path)
    _ = file.description
    file.acquire()


def refusal_message(path: Path) -> str:
    """Return the message of the InputError when the FMU is loaded; each line names the file."""
    with pytest.raises(InputError) as error:
        _load_fmu(path)
    lines = str(error.value).splitlines()
    assert all(line.startswith((f'"{path}": ', f'FMU "{path}" ')) for line in lines), lines
    assert all(line.isprintable() for line in lines)
    return str(error.value)


def with_description(text: str, files: Mapping[str, bytes], folder: Path) -> Path:
    """Write the FMU with another modelDescription.xml."""
    path = folder / "bad.fmu"
    path.write_bytes(pack_archive(members({**files, "modelDescription.xml": text.encode()})))
    return path


def with_change(old: str, new: str, files: Mapping[str, bytes], folder: Path) -> Path:
    """Write the FMU with one change in its modelDescription.xml."""
    text = files["modelDescription.xml"].decode()
    assert old in text
    return with_description(text.replace(old, new, 1), files, folder)
