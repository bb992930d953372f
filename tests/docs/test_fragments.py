"""Fragments of JSON files in the reference: components are created, other parts are valid where
they belong.
"""

import json
import re
from inspect import signature
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import cosim
from cosim.export.plant import vehicle_file_schema
from cosim.scenario import json_schema
from plant_src.world import World

ROOT = Path(__file__).parents[2]
SCENARIO = json_schema()
DEFINITIONS = SCENARIO["$defs"]
MULTIROTOR = vehicle_file_schema()["oneOf"][0]
#: arguments of a world
WORLD_KEYS = signature(World).parameters
#: files of the reader, and shipped ones in their place
OWN_FILES = {
    "my_quad.json": "../plant_src/vehicles/data/x500.json",
    "my_boat.json": "../plant_src/vehicles/data/heron.json",
}
#: language of fragments, in docs/ beside that of complete files
FRAGMENTS = ("json", "jsonc")
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PART = re.compile(r'[\s,]*(?:("[^"]*")\s*:\s*)?(?=\S)')


def fragments():
    """Return the pages and texts of the blocks that are part of a JSON file."""
    pages = [*sorted(ROOT.glob("plant_src/**/*.md")), ROOT / "docs/scenarios.md"]
    found = []
    for page in pages:
        fragments = FRAGMENTS[page.parent.name == "docs"]
        for language, text in blocks(page):
            # tests/plant_src/test_urdf.py reads the vehicle files
            if language == fragments and not text.startswith('{"family"'):
                found.append((page, text))
    return found


def blocks(page):
    return BLOCK.findall(page.read_text())


def parts(text):
    """Yield (key, value) of the members and ("", object) of the elements of a fragment."""
    text = re.sub(r"//.*$|^\.\.\.$", "", text, flags=re.MULTILINE)
    for own, shipped in OWN_FILES.items():
        text = text.replace(own, shipped)
    decoder, place = json.JSONDecoder(), 0
    while match := PART.match(text, place):
        value, place = decoder.raw_decode(text, match.end())
        yield json.loads(match[1] or '""'), value


def schema_of(key, value):
    """Return the schema of the place where a part stands; None for components and parts of the
    world.
    """
    if key in SCENARIO["properties"]:
        return SCENARIO["properties"][key]
    if key in DEFINITIONS["AlgorithmSpec"]["properties"]:
        return DEFINITIONS["AlgorithmSpec"]["properties"][key]
    if key in MULTIROTOR["properties"]:
        return MULTIROTOR["properties"][key]
    return None if key else DEFINITIONS["FunctionSpec" if "python" in value else "ConnectionSpec"]


@pytest.mark.parametrize(
    ("page", "text"), fragments(), ids=lambda value: str(getattr(value, "parent", value))[-40:]
)
def test_the_parts_of_a_fragment_are_valid(page, text, monkeypatch):
    monkeypatch.chdir(ROOT / "scenarios")
    components, world = {}, {}
    for key, value in parts(text):
        if schema := schema_of(key, value):
            Draft202012Validator({"$defs": DEFINITIONS, **schema}).validate(value)
        else:
            (world if key in WORLD_KEYS else components)[key] = value
    if world:
        components["plant"] = {
            "python": "../plant_src/world.py:World",
            "arguments": {"vehicles": {}, **world},
        }
    if components:
        cosim.load(
            {
                "name": page.stem,
                "stop_time": 0.1,
                "step_size": 0.01,
                "components": components,
                "connections": [],
            }
        ).close()


#: languages of blocks that this module or test_documents.py executes
EXECUTED = {"sh", "python", "json", "jsonc"}
#: other languages: output of programs, settings of a shell
SHOWN = {"text", "bash"}


def test_no_block_of_a_page_outside_of_the_guides_escapes():
    pages = [
        ROOT / name
        for name in re.findall(r": ([\w/]+\.md)$", (ROOT / "mkdocs.yml").read_text(), re.MULTILINE)
    ]
    others = [
        page for page in pages if page.parent.name not in ("tutorials", "how_to") and page.exists()
    ]
    languages: set[str] = set()
    for page in others:
        languages.update(language for language, _ in blocks(page))
    assert languages <= EXECUTED | SHOWN
