"""What examining and extracting an FMU may cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """An FMU beyond one of these is refused."""

    #: files and folders in the archive
    members: int = 10_000
    #: bytes of all members together, extracted
    expanded: int = 1 << 30
    #: extracted size over compressed size, of members that extract to more than `ratio_from` bytes
    ratio: int = 200
    ratio_from: int = 1 << 24
    #: bytes of the library that is to be loaded: it is examined in memory
    library: int = 1 << 28
    #: bytes of one XML file, and tags in it: each costs memory
    xml: int = 1 << 25
    xml_tags: int = 500_000
    #: scalars of one array variable
    array: int = 1_000_000


LIMITS = Limits()
