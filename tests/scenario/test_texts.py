"""Texts with characters that no FMU and no file can hold, and texts that are too long: refused
wherever values come in.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import cosim
from cosim.core.text import MAX_TEXT_LENGTH
from cosim.studies.schema import SweepSpec
from cosim.studies.study import read_study

BAD = {
    "U+0000": "a\0b",
    "U+D800": "\ud800",
    "U+DFFF": "end\udfff",
    "characters is not": "x" * (MAX_TEXT_LENGTH + 1),
}
bad = pytest.mark.parametrize(("words", "text"), BAD.items(), ids=BAD)

READER = """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, String

class Reader(Fmi2Slave):
    def __init__(self, **options):
        super().__init__(**options)
        self.text, self.copy, self.spoil = "", "", False
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(String("text", **tunable))
        self.register_variable(Boolean("spoil", **tunable))
        self.register_variable(String("copy", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.copy = self.text + (SPOILED if self.spoil else "")
        return True
"""


@pytest.fixture
def reader(tmp_path: Path) -> Any:
    """Write the scenario of a component with a string parameter, in which `more` replaces keys;
    return its path.
    """
    (tmp_path / "reader.py").write_text(READER)

    def write(parameters: Any = None, spoiled: str = "", **more: Any) -> Path:
        (tmp_path / "reader.py").write_text(f"SPOILED = {spoiled!a}\n{READER}")
        component = {"python": "reader.py:Reader", "parameters": parameters or {}}
        content = {
            "name": "texts",
            "stop_time": 0.1,
            "step_size": 0.01,
            "components": {"reader": component},
            **more,
        }
        path = tmp_path / "texts.json"
        path.write_text(json.dumps(content))
        return path

    return write


def refusal(scenario: Path, parameters: Any = None) -> str:
    with pytest.raises(cosim.InputError) as refused:
        cosim.run(scenario, parameters)
    assert len(refused.value.problems) == 1
    assert len(str(refused.value)) < 400
    return str(refused.value)


@bad
def test_in_the_scenario(reader, words, text):
    path = reader({"text": text})
    assert words in refusal(path)
    assert f"{path}:1:" in refusal(path)


@bad
def test_in_an_event(reader, words, text):
    assert words in refusal(reader(events=[{"time": 0.05, "set": {"reader.text": text}}]))


@bad
@pytest.mark.parametrize(
    "name", ["reader.text", "reader.spoil", "/components/reader/parameters/text", "/description"]
)
def test_in_a_value_of_the_caller(reader, words, text, name):
    assert words in refusal(reader({"text": "x"}), {name: text})


@bad
def test_in_a_list_or_an_object_of_the_caller(reader, words, text):
    assert words in refusal(reader(), {"/components/reader/parameters": {"text": text}})
    assert words in refusal(reader(), {"/record": {"signals": ["reader.*", text]}})


@bad
def test_in_a_name_of_the_caller(reader, words, text):
    assert words in refusal(reader(), {f"reader.{text}": 1})


@bad
def test_in_a_sweep(reader, words, text):
    path = reader()
    file = path.with_name("sweep.json")
    file.write_text(
        json.dumps(
            {
                "name": "sweep",
                "scenario": path.name,
                "factors": [{"parameter": "reader.text", "values": ["good", text]}],
            }
        )
    )
    with pytest.raises(cosim.InputError, match=re.escape(words)):
        read_study(file, SweepSpec)


def test_in_an_output_of_a_component_in_python(reader):
    path = reader({"spoil": True}, spoiled="a\0b")
    with pytest.raises(
        cosim.ComponentError,
        match=r"reader: get_outputs failed .*output \"copy\" is 'a.x00b', expected",
    ):
        cosim.run(path)


def test_other_characters_are_accepted(reader):
    text = "\N{GREEK SMALL LETTER ALPHA}\t\n\N{PILE OF POO}" + "x" * (MAX_TEXT_LENGTH - 4)
    assert (
        cosim.run(reader(record={"signals": ["reader.copy"]}), {"reader.text": text})[
            "reader.copy"
        ][-1]
        == text
    )
