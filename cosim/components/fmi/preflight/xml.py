"""Safe XML parser.

No DOCTYPE and therefore no entities and no external files, and limits of the document's size.
"""

import re
from typing import Any

from lxml import etree

from ....core.text import MAX_TEXT_LENGTH
from .findings import FatalFindingError

#: largest size of an XML file (bytes) and number of its tags
MAX_XML_SIZE, MAX_XML_TAGS = 1 << 25, 1_000_000
#: accepted encodings; FMI requires UTF-8, but exporters use the others too
_ENCODINGS = ("utf-8", "us-ascii", "ascii", "iso-8859-1", "windows-1252", "utf-16")
_DECLARED = re.compile(rb"""\s*<\?xml[^>]*?\sencoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_TOO_LONG_TEXTS = etree.XPath(
    "//@*[string-length() > $length] | //text()[string-length() > $length]"
)
#: begin of libxml2's message for an attribute or text above its own limit of 10^7 bytes
_LIBRARY_LIMIT = "Resource limit exceeded"
#: largest number of attributes of an element; lxml takes quadratic time in it
_MAX_ATTRIBUTES = 100
_TOO_MANY_ATTRIBUTES = etree.XPath(f"//*[@*[{_MAX_ATTRIBUTES + 1}]]")
_BYTE_ORDER_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}


def parse_xml(content: bytes, member: str) -> Any:
    """Parse an XML document.

    Args:
        content: The document.
        member: Member of the archive, for messages.

    Returns:
        The root element (lxml).

    Raises:
        FatalFindingError: The document is not well-formed, exceeds a limit or is not safe.
    """
    if len(content) > MAX_XML_SIZE:
        raise FatalFindingError(
            "xml.size", f"has {len(content)} bytes, expected at most {MAX_XML_SIZE}", member
        )
    content = _to_utf8(content, member)
    if (position := content.find(b"<!DOCTYPE")) >= 0:
        raise FatalFindingError(
            "xml.doctype",
            "found a DOCTYPE, expected none",
            member,
            content.count(b"\n", 0, position) + 1,
        )
    if (tags := content.count(b"<")) > MAX_XML_TAGS:
        raise FatalFindingError(
            "xml.size", f"has {tags} tags, expected at most {MAX_XML_TAGS}", member
        )
    root = _parse_tree(content, member)
    for element in _TOO_MANY_ATTRIBUTES(root):
        raise FatalFindingError(
            "xml.size",
            f"<{element.tag}> has more than {_MAX_ATTRIBUTES} attributes",
            member,
            element.sourceline,
        )
    for text in _TOO_LONG_TEXTS(root, length=MAX_TEXT_LENGTH):
        where = f'attribute "{text.attrname}"' if text.is_attribute else "text"
        found = (
            f"<{text.getparent().tag}> has {where} with {len(text)} characters, expected at most "
            f"{MAX_TEXT_LENGTH}"
        )
        raise FatalFindingError("xml.size", found, member, text.getparent().sourceline)
    return root


def _to_utf8(content: bytes, member: str) -> bytes:
    """Convert a document to UTF-8, so that the parser does not guess the encoding."""
    mark_encoding = next(
        (name for mark, name in _BYTE_ORDER_MARKS.items() if content.startswith(mark)), None
    )
    declared = _DECLARED.match(content)
    encoding = mark_encoding or (declared.group(1).decode().lower() if declared else "utf-8")
    if mark_encoding is None and encoding not in _ENCODINGS:
        raise FatalFindingError(
            "xml.encoding", f'found encoding "{encoding}", expected "UTF-8"', member, 1
        )
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise FatalFindingError(
            "xml.encoding",
            f"is not {encoding.removesuffix('-sig')} text: {error.reason}",
            member,
            line,
        ) from None
    if "\0" in text:
        raise FatalFindingError(
            "xml.encoding", "contains null characters, expected UTF-8 text", member, 1
        )
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
        if _LIBRARY_LIMIT in error.msg:
            found = f"has an attribute or text with more than {MAX_TEXT_LENGTH} characters"
            raise FatalFindingError("xml.size", found, member, line) from None
        raise FatalFindingError(
            "xml.syntax", f"is not well-formed XML: {error.msg} (column {column})", member, line
        ) from None
    except (ValueError, LookupError) as error:
        raise FatalFindingError("xml.syntax", f"is not well-formed XML: {error}", member) from None
