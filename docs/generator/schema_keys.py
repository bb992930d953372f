"""Reference of the keys of JSON files, from their JSON Schemas."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from markdown_parts import code, page, plain, table

from cosim.export.plant import world_schema
from cosim.scenario import json_schema
from cosim.scenario.schema_types import schema_of
from cosim.studies.schema import SweepSpec, TuneSpec, WorstCaseSpec

Schema = Mapping[str, Any]


def scenario_keys_page() -> str:
    """Return the page with the keys of scenarios and nested systems."""
    scenario, nested = json_schema(), json_schema(nested=True)
    return page(
        "Scenario keys",
        (
            "`cosim schema` prints the schema of this page. [Scenarios](../scenarios.md) explains "
            "how the keys work together."
        ),
        *_sections("Scenario", scenario),
        *_sections("Nested system", nested, scenario["$defs"]),
    )


def world_keys_page() -> str:
    """Return the page with the arguments of the shipped plant and the functions of its scenes."""
    return page(
        "Arguments of the plant",
        'A scenario gives these arguments to the component `{"python": '
        '"cosim:plant_src/world.py:World", "arguments": {...}}`. '
        "[The plant](../../plant_src/README.md) explains the models, and "
        "[Put the shipped plant into your scenario](../how_to/use_the_plant.md) shows an example. "
        "An editor completes these keys with the schema of `cosim schema`. SI units; the world "
        "frame is east-north-up.",
        *_sections("World", world_schema()),
        "## Scenes",
        'The key `"scene"` of a scenario names one of these functions for the 3-D replay, for '
        "example "
        '`{"python": "cosim:plant_src/scene/replay.py:world_scene", "arguments": {"name": '
        '"plant"}}`. cosim passes `scenario`.',
        *(f"::: plant_src.scene.replay.{name}" for name in ("world_scene", "free")),
    )


def study_keys_page() -> str:
    """Return the page with the keys of sweeps and tunings."""
    sweep, tuning, worst = (
        schema_of(SweepSpec),
        schema_of(TuneSpec),
        schema_of(WorstCaseSpec),
    )
    return page(
        "Sweep and tuning keys",
        "`cosim schema --sweep`, `--tune` and `--worst` print the schemas of this page. [Sweeps "
        "and tuning](../sweeps.md) "
        "explains how the keys work together.",
        *_sections("Sweep", sweep),
        *_sections("Tuning", tuning, sweep["$defs"]),
        *_sections("Search for the worst case", worst, {**sweep["$defs"], **tuning["$defs"]}),
    )


def _sections(title: str, schema: Schema, known: Collection[str] = ()) -> Iterator[str]:
    """Yield a section for the keys of a file, and one for each kind of object in it.

    Kinds in `known` are left out.
    """
    yield _section(title, schema)
    for name, part in sorted(schema.get("$defs", {}).items()):
        if name not in known and "properties" in part:
            yield _section(_title(name), part)


def _section(title: str, part: Schema) -> str:
    required = part.get("required", ())
    rows = (
        (code(key), *_cells(about, key in required)) for key, about in part["properties"].items()
    )
    header = ("key", "type", "default", "unit", "meaning", "example")
    return f"## {title}\n\n{plain(part.get('description', ''))}\n\n{table(header, rows)}"


def _cells(about: Schema, required: bool) -> Iterator[str]:
    yield _type(about)
    yield "required" if required else _default(about.get("default"))
    yield about.get("unit", "")
    yield plain(about.get("description", ""))
    yield ", ".join(code(json.dumps(example)) for example in about.get("examples", ()))


def _default(value: Any) -> str:
    if isinstance(value, dict):
        value = {name: item for name, item in value.items() if item is not None}
    return (
        ""
        if value in (None, "", [], {})
        else code(value if isinstance(value, str) else json.dumps(value))
    )


def _type(schema: Schema) -> str:
    """Return the type of a value in words, with links to the sections of objects."""
    if "$ref" in schema:
        title = _title(schema["$ref"].rpartition("/")[2])
        return f"[{title.lower()}](#{title.lower().replace(' ', '-')})"
    if "anyOf" in schema:
        return " or ".join(
            dict.fromkeys(_type(part) for part in schema["anyOf"] if part.get("type") != "null")
        )
    if values := schema.get("enum", [schema["const"]] if "const" in schema else None):
        return " or ".join(code(json.dumps(value)) for value in values)
    match schema.get("type"):
        case "array":
            items = _type(schema.get("items", {}))
            return f"list of ({items})" if " or " in items else f"list of {items}"
        case "object":
            inner = next(
                iter(schema.get("patternProperties", {}).values()),
                schema.get("additionalProperties"),
            )
            return f"object of {_type(inner)}" if isinstance(inner, dict) and inner else "object"
        case list() as kinds:
            return " or ".join(kinds)
        case "string":
            return "text"
        case kind:
            return kind or "any value"


def _title(name: str) -> str:
    """Return the title of a class, such as "Iteration" for IterationSpec."""
    words = re.findall(r"[A-Z][a-z]+", name.removesuffix("Spec"))
    return " ".join(words).capitalize()
