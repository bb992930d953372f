"""XML of an FMU, parsed without any of XML's dangers: no DOCTYPE, so no entities and nothing fetched, and no huge trees."""

from __future__ import annotations

import re
from typing import Any

from lxml import etree

from .findings import FatalFinding, Rule
from .limits import PreflightLimits

SIZE = Rule("xml.size", "limits")
ENCODING = Rule("xml.encoding", "FMI 2.0.5 section 2.2, FMI 3.0.2 section 2.4")
DOCTYPE = Rule("xml.doctype", "caution: entities")
SYNTAX = Rule("xml.syntax", "XML 1.0")

#: FMI demands UTF-8; the others occur, and mean the same to every reader
_ENCODINGS = ("utf-8", "us-ascii", "ascii", "iso-8859-1", "windows-1252", "utf-16")
_DECLARED = re.compile(rb"""\s*<\?xml[^>]*?\sencoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
#: lxml looks up each attribute from the first one on, so that reading n of them takes n * n steps
_MAX_ATTRIBUTES = 100
_TOO_MANY_ATTRIBUTES = etree.XPath(f"//*[@*[{_MAX_ATTRIBUTES + 1}]]")
_BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}


def parse_xml(content: bytes, member: str, limits: PreflightLimits) -> Any:
    """The root element of an XML document. Raises Flaw, with line and column, when it is none or not a safe one."""
    if len(content) > limits.max_xml_size:
        raise FatalFinding(SIZE(f"has {len(content)} bytes, expected at most {limits.max_xml_size}", member))
    content = _to_utf8(content, member)
    if (place := content.find(b"<!DOCTYPE")) >= 0:
        raise FatalFinding(DOCTYPE("found a DOCTYPE, expected none", member, content.count(b"\n", 0, place) + 1))
    if (tags := content.count(b"<")) > limits.max_xml_tags:
        raise FatalFinding(SIZE(f"has {tags} tags, expected at most {limits.max_xml_tags}", member))
    root = _parse_tree(content, member)
    for element in _TOO_MANY_ATTRIBUTES(root):
        raise FatalFinding(SIZE(f"<{element.tag}> has more than {_MAX_ATTRIBUTES} attributes", member, element.sourceline))
    return root


def _to_utf8(content: bytes, member: str) -> bytes:
    """The text in UTF-8, so that the parser never has to guess an encoding in which something could hide."""
    marked = next((name for mark, name in _BYTE_ORDER_MARKS.items() if content.startswith(mark)), None)
    declared = _DECLARED.match(content)
    encoding = marked or (declared.group(1).decode().lower() if declared else "utf-8")
    if marked is None and encoding not in _ENCODINGS:
        raise FatalFinding(ENCODING(f'found encoding "{encoding}", expected "UTF-8"', member, 1))
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise FatalFinding(ENCODING(f"is not {encoding.removesuffix('-sig')} text: {error.reason}", member, line)) from None
    if "\0" in text:
        raise FatalFinding(ENCODING("holds null characters, expected UTF-8 text", member, 1))
    return content if encoding == "utf-8" else text.encode()


def _parse_tree(content: bytes, member: str) -> Any:
    parser = etree.XMLParser(
        encoding="utf-8",
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        return etree.fromstring(content, parser)
    except etree.XMLSyntaxError as error:
        line, column = error.position
        raise FatalFinding(SYNTAX(f"is no XML: {error.msg} (column {column})", member, line)) from None
    except (ValueError, LookupError) as error:
        raise FatalFinding(SYNTAX(f"is no XML: {error}", member)) from None
