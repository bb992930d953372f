"""Limits of the resources that checking and extracting an FMU may use."""

from __future__ import annotations

from dataclasses import dataclass

from ....core.size_limits import MAX_SCALARS
from ....core.text import MAX_TEXT_LENGTH


@dataclass(frozen=True, slots=True)
class PreflightLimits:
    """Limits of the preflight check; an FMU that exceeds one of them is refused."""

    #: number of files and folders in the archive
    max_members: int = 10_000
    #: total extracted size (bytes)
    max_expanded_size: int = 1 << 30
    #: largest ratio of extracted to compressed size, for members larger than `ratio_threshold`
    #: (bytes)
    max_ratio: int = 200
    ratio_threshold: int = 1 << 24
    #: size of the library for this platform (bytes), which is read into memory
    max_library_size: int = 1 << 28
    #: size of an XML file (bytes) and number of its tags
    max_xml_size: int = 1 << 25
    max_xml_tags: int = 1_000_000
    #: length of one attribute or text in an XML file (characters)
    max_text_length: int = MAX_TEXT_LENGTH
    #: number of elements of one array variable
    max_array_size: int = 1_000_000
    #: number of variables, an array counted with all its elements
    max_scalars: int = MAX_SCALARS


DEFAULT_LIMITS = PreflightLimits()
