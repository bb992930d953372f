"""Dangerous and malformed XML is refused quickly and with its line, without access to other files
and the network.
"""

import re
import socket
import threading
import time
from contextlib import contextmanager

import pytest
from bad_fmus import find_problems, members, pack_archive, refusal_message

from cosim.components.fmi import FmuFile
from cosim.core.errors import InputError
from cosim.export.fmu.description_xml import validate_description

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'
LAUGHS = "".join(f'<!ENTITY l{i + 1} "{f"&l{i};" * 10}">' for i in range(9))


def with_prolog(prolog):
    return lambda xml: xml.replace(HEAD.encode(), HEAD.encode() + prolog.encode())


def edited(old, new):
    def edit(xml):
        assert xml.count(old.encode()) >= 1
        return xml.replace(old.encode(), new if isinstance(new, bytes) else new.encode(), 1)

    return edit


def deep(xml):
    return xml.replace(b"<ModelStructure>", b"<ModelStructure>" + b"<a>" * 5000 + b"</a>" * 5000)


def many_attributes(xml):
    attributes = b" ".join(b'a%d=""' % i for i in range(100_000))
    return xml.replace(b"<DefaultExperiment", b"<DefaultExperiment " + attributes)


LONG = "x" * (1 << 21)
CASES = {
    "long description": (
        edited("a lag", LONG),
        "xml.size",
        ':2: <fmiModelDescription> has attribute "description" with 2097',
    ),
    "long name": (
        edited('name="y"', f'name="{LONG}"'),
        "xml.size",
        '> has attribute "name" with 2097152 characters, ',
    ),
    "long start": (
        edited('start=""', f'start="{LONG}"'),
        "xml.size",
        'has attribute "start" with 2097152 characters',
    ),
    "long text": (
        edited("</ModelVariables>", f"</ModelVariables>{LONG}"),
        "xml.size",
        "<ModelVariables> has text with 20971",
    ),
    "endless description": (
        edited("a lag", LONG * 6),
        "xml.size",
        "has an attribute or text with more than 1048576 characters",
    ),
    "DOCTYPE": (
        with_prolog("<!DOCTYPE fmiModelDescription>"),
        "xml.doctype",
        ":2: found a DOCTYPE",
    ),
    "billion laughs": (
        with_prolog(f'<!DOCTYPE x [<!ENTITY l0 "ha">{LAUGHS}]>'),
        "xml.doctype",
        ":2: found a DOCTYPE",
    ),
    "file entity": (
        with_prolog('<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>'),
        "xml.doctype",
        "found a DOCTYPE",
    ),
    "parameter entity": (
        with_prolog('<!DOCTYPE x [<!ENTITY % e SYSTEM "http://127.0.0.1/x"> %e;]>'),
        "xml.doctype",
        "DOCTYPE",
    ),
    "external DTD": (
        with_prolog('<!DOCTYPE x SYSTEM "http://127.0.0.1/x.dtd">'),
        "xml.doctype",
        "found a DOCTYPE",
    ),
    "late DOCTYPE": (
        with_prolog("<!-- a\n-->\n<!DOCTYPE x>"),
        "xml.doctype",
        ":4: found a DOCTYPE",
    ),
    "DOCTYPE in UTF-16": (
        lambda xml: (
            with_prolog("<!DOCTYPE x>")(xml).decode().replace("UTF-8", "UTF-16").encode("utf-16")
        ),
        "xml.doctype",
        ":2: found a DOCTYPE",
    ),
    "UTF-16 without mark": (
        lambda xml: xml.decode().encode("utf-16-le"),
        "xml.encoding",
        "null characters",
    ),
    "UTF-32": (lambda xml: xml.decode().encode("utf-32"), "xml.encoding", "null characters"),
    "UTF-7": (
        edited('"UTF-8"', '"UTF-7"'),
        "xml.encoding",
        'found encoding "utf-7", expected "UTF-8"',
    ),
    "EBCDIC": (edited('"UTF-8"', '"IBM037"'), "xml.encoding", 'found encoding "ibm037"'),
    "no such encoding": (edited('"UTF-8"', '"x-none"'), "xml.encoding", 'found encoding "x-none"'),
    "wrong bytes": (edited("a lag", b"a l\xff\xfeg"), "xml.encoding", ":2: is not utf-8 text"),
    "undefined entity": (
        edited("a lag", "&secret;"),
        "xml.syntax",
        ":2: is not well-formed XML: Entity 'secret' not defined",
    ),
    "cut in the middle": (
        lambda xml: xml[: len(xml) // 2],
        "xml.syntax",
        "is not well-formed XML: ",
    ),
    "empty": (lambda _: b"", "xml.syntax", "is not well-formed XML"),
    "text": (lambda _: b"hello", "xml.syntax", ":1: is not well-formed XML: Start tag expected"),
    "binary": (lambda _: bytes(range(1, 128)), "xml.syntax", "is not well-formed XML"),
    "wrong end tag": (
        edited("</ModelVariables>", "</ModelVariable>"),
        "xml.syntax",
        "tag mismatch: ModelVariables",
    ),
    "attribute twice": (
        edited('name="u"', 'name="u" name="v"'),
        "xml.syntax",
        "Attribute name redefined",
    ),
    "control character": (
        edited("a lag", "a\x07lag"),
        "xml.syntax",
        ":2: is not well-formed XML: ",
    ),
    "control reference": (
        edited("a lag", "a&#7;lag"),
        "xml.syntax",
        "is not well-formed XML: xmlParseCharRef",
    ),
    "two roots": (lambda xml: xml + b"<more/>", "xml.syntax", "Extra content at the end"),
    "too deep": (deep, "xml.syntax", "Excessive depth"),
    "too many attributes": (
        many_attributes,
        "xml.size",
        "<DefaultExperiment> has more than 100 attributes",
    ),
    "other root": (
        lambda _: b"<fmu/>",
        "model.root",
        ":1: found <fmu>, expected <fmiModelDescription>",
    ),
    "namespace": (
        edited("<fmiModelDescription ", '<fmiModelDescription xmlns="urn:x" '),
        "model.root",
        "found <{urn:x}",
    ),
}


@contextmanager
def listener():
    """Yield the port of a server and the list of its connections."""
    server = socket.create_server(("127.0.0.1", 0))
    connections = []
    accepting = threading.Thread(target=lambda: connections.append(server.accept()), daemon=True)
    accepting.start()
    yield server.getsockname()[1], connections
    with socket.create_connection(server.getsockname()):
        accepting.join()
    server.close()


@pytest.mark.parametrize("case", CASES)
def test_bad_xml_is_refused(case, good, tmp_path):
    change, rule, words = CASES[case]
    path = tmp_path / "bad.fmu"
    xml = change(good[2]["modelDescription.xml"])
    path.write_bytes(pack_archive(members(good[2] | {"modelDescription.xml": xml})))
    begin = time.process_time()
    text = refusal_message(path)
    assert time.process_time() - begin < 1
    assert f'"{path}": modelDescription.xml' in text
    assert words in text
    assert find_problems(path)[0].rule == rule


@pytest.mark.parametrize(
    "prolog",
    [
        '<!DOCTYPE x SYSTEM "http://127.0.0.1:{port}/x.dtd">',
        '<!DOCTYPE x [<!ENTITY e SYSTEM "http://127.0.0.1:{port}/e">]>',
        '<!DOCTYPE x [<!ENTITY % e SYSTEM "http://127.0.0.1:{port}/e"> %e;]>',
        '<?xml-stylesheet href="http://127.0.0.1:{port}/s.xsl"?>',
    ],
)
def test_no_network_connection_is_made(prolog, good, tmp_path):
    path = tmp_path / "calling.fmu"
    schema = (
        ' xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
        'xsi:noNamespaceSchemaLocation="http://127.0.0.1:{port}/x.xsd" '
    )
    with listener() as (port, connections):
        xml = with_prolog(prolog.format(port=port))(good[2]["modelDescription.xml"])
        xml = xml.replace(b" modelName", schema.format(port=port).encode() + b" modelName")
        path.write_bytes(pack_archive(members(good[2] | {"modelDescription.xml": xml})))
        find_problems(path)
        assert connections == []


@pytest.mark.parametrize(
    "member", ["sources/buildDescription.xml", "terminalsAndIcons/terminalsAndIcons.xml"]
)
def test_other_xml_files_are_checked_too(member, good, tmp_path):
    path = tmp_path / "bad.fmu"
    xml = (
        b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>'
        b"<fmiBuildDescription>&e;</fmiBuildDescription>"
    )
    path.write_bytes(pack_archive(members(good[3] | {member: xml})))
    (finding,) = find_problems(path)
    assert (finding.rule, finding.location) == ("xml.doctype", f"{member}:1")


@pytest.mark.parametrize(
    "encoding", ["utf-8-sig", "utf-16", "iso-8859-1", "windows-1252", "us-ascii"]
)
def test_unambiguous_encodings_are_read(encoding, good, tmp_path):
    path = tmp_path / "good.fmu"
    text = good[2]["modelDescription.xml"].decode().replace("UTF-8", encoding.removesuffix("-sig"))
    text = text.replace("a lag", "a lag" if encoding == "us-ascii" else "ein Glätter")
    path.write_bytes(
        pack_archive(members(good[2] | {"modelDescription.xml": text.encode(encoding)}))
    )
    description = FmuFile(path).description
    assert description.description.startswith("a lag" if encoding == "us-ascii" else "ein Glätter")
    assert len(description.variables) == 13


@pytest.mark.parametrize(
    "xml",
    [
        lambda xml: xml.replace(b"a lag", b"a" * 9_000_000),
        lambda xml: xml.replace(b"<Unit ", b"<a/>" * 400_000 + b"<Unit ", 1),
        lambda xml: xml.replace(b"<ModelVariables>", b"<a/>" * 200_000 + b"<ModelVariables>", 1),
        lambda xml: xml.replace(
            b"</ModelVariables>", b"<ScalarVariable/>" * 50_000 + b"</ModelVariables>", 1
        ),
        lambda xml: xml.replace(
            b'index="2"', b'index="2" dependencies="' + b"0 " * 10**6 + b'"', 1
        ),
    ],
    ids=["a long text", "many units", "many parts", "many bad variables", "many dependencies"],
)
def test_large_xml_is_checked_quickly(xml, good, tmp_path):
    path = tmp_path / "large.fmu"
    path.write_bytes(
        pack_archive(
            members(good[2] | {"modelDescription.xml": xml(good[2]["modelDescription.xml"])})
        )
    )
    begin = time.process_time()
    find_problems(path)
    assert time.process_time() - begin < 2


def test_very_many_tags_are_refused_before_they_are_parsed(good, tmp_path):
    path = tmp_path / "large.fmu"
    xml = good[2]["modelDescription.xml"] + b"<a/>" * 1_000_001
    path.write_bytes(pack_archive(members(good[2] | {"modelDescription.xml": xml})))
    assert "tags, expected at most 1000000" in refusal_message(path)


@pytest.mark.parametrize(
    "case", [case for case, (_, rule, _) in CASES.items() if rule.startswith("xml.")]
)
def test_descriptions_to_be_exported_are_checked_too(case, good, tmp_path):
    """FMPy's XML reader has no such checks, so an unsafe description of C or Python sources must
    not reach it.
    """
    change, rule, words = CASES[case]
    with pytest.raises(InputError, match=re.escape(rule)) as error:
        validate_description(
            change(good[2]["modelDescription.xml"]), tmp_path / "modelDescription.xml"
        )
    assert words in str(error.value)
