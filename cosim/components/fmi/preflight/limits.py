"""What examining and extracting an FMU may cost."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PreflightLimits:
    """An FMU beyond one of these is refused."""

    #: files and folders in the archive
    max_members: int = 10_000
    #: bytes of all members together, extracted
    max_expanded_size: int = 1 << 30
    #: extracted size over compressed size, of members that extract to more than `ratio_from` bytes
    max_ratio: int = 200
    ratio_threshold: int = 1 << 24
    #: bytes of the library that is to be loaded: it is examined in memory
    max_library_size: int = 1 << 28
    #: bytes of one XML file, and tags in it: each costs memory
    max_xml_size: int = 1 << 25
    max_xml_tags: int = 500_000
    #: scalars of one array variable
    max_array_size: int = 1_000_000


DEFAULT_LIMITS = PreflightLimits()
