"""JSON Schema of scenarios and nested systems for editors, with and without "extends".

In such a file no key is required, every key may be `null`, and lists with named elements may be
changed by an object. Rules that
concern several keys hold for the merged file alone and are left out.
"""

import re
from collections.abc import Mapping
from typing import Any

from .schema import KEYED_LISTS, NOT_INHERITED, json_schema

Schema = dict[str, Any]

_NULL: Schema = {"type": "null"}
_SUFFIX = "Change"
_EXTENDS: Schema = {
    "type": "string",
    "description": "file that this file extends, or name of a shipped scenario",
    "examples": ["demo1_box"],
}


def editor_schema(nested: bool = False) -> Schema:
    """Return the JSON Schema (2020-12) of scenario files or of nested-system files.

    It accepts files with and without "extends", also for inline nested systems.
    """
    full = json_schema(nested)
    version, definitions = full.pop("$schema"), full.pop("$defs")
    changes = {
        f"{name}{_SUFFIX}": _change_of_object(each, definitions)
        for name, each in definitions.items()
        if _is_object(each)
    }
    inline = definitions["NestedSpec"]
    change = _change_of_root(inline, definitions)
    changes[f"NestedSpec{_SUFFIX}"] = {**change, "required": []}
    roots = {"Nested": inline, f"Nested{_SUFFIX}": change, "NestedSpec": _with_or_without("Nested")}
    if not nested:
        roots["Scenario"] = full
        roots[f"Scenario{_SUFFIX}"] = _change_of_root(full, definitions)
    return {
        "$schema": version,
        **_with_or_without("Nested" if nested else "Scenario"),
        "$defs": {**definitions, **changes, **roots},
    }


def _with_or_without(name: str) -> Schema:
    """Return the schema of files of a kind, with "extends" or without it."""
    return {
        "if": {"type": "object", "required": ["extends"]},
        "then": {"$ref": f"#/$defs/{name}{_SUFFIX}"},
        "else": {"$ref": f"#/$defs/{name}"},
    }


def with_arguments(schema: Schema, file_and_class: str, arguments: Schema) -> Schema:
    """Return a schema with that of the arguments of a component class in Python.

    It applies to components in files that extend no other file.

    Args:
        schema: result of `editor_schema`.
        file_and_class: end of the component's key "python".
        arguments: schema of the arguments, with its own `$defs`.
    """
    root = {key: value for key, value in arguments.items() if key != "$defs"}
    name = f"ArgumentsOf{file_and_class.rpartition(':')[2]}"
    condition: Schema = {
        "properties": {"python": {"type": "string", "pattern": f"{re.escape(file_and_class)}$"}},
        "required": ["python"],
    }
    definitions = schema["$defs"]
    component = {
        **definitions["ComponentSpec"],
        "if": condition,
        "then": {"properties": {"arguments": {"$ref": f"#/$defs/{name}"}}},
    }
    return {
        **schema,
        "$defs": {**definitions, **arguments["$defs"], name: root, "ComponentSpec": component},
    }


def _change_of_root(full: Schema, definitions: Mapping[str, Schema]) -> Schema:
    change = _change_of_object(full, definitions)
    properties = change["properties"]
    for key, name in KEYED_LISTS.items():
        if key in properties:
            element = {"$ref": f"{full['properties'][key]['items']['$ref']}{_SUFFIX}"}
            named = {
                "type": "object",
                "additionalProperties": {"anyOf": [element, _NULL]},
                "description": f"elements by {name}",
            }
            properties[key] = {"anyOf": [*properties[key]["anyOf"], named]}
    own = {key: full["properties"][key] for key in NOT_INHERITED if key in full["properties"]}
    required = [key for key in full.get("required", ()) if key in own]
    return {
        **change,
        "properties": {"extends": _EXTENDS, **properties, **own},
        "required": ["extends", *required],
    }


def _is_object(schema: Schema) -> bool:
    return "properties" in schema


def _change_of_object(schema: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return the schema of an object that is merged with one of this schema."""
    properties = {
        key: {"anyOf": [_change_of_value(each, definitions), _NULL]}
        for key, each in schema["properties"].items()
    }
    kept = ("type", "title", "description", "additionalProperties")
    return {"properties": properties, **{key: each for key, each in schema.items() if key in kept}}


def _change_of_value(schema: Schema, definitions: Mapping[str, Schema]) -> Schema:
    """Return the schema of a value that is merged with one of this schema; only objects differ."""
    if "$ref" in schema:
        is_object = _is_object(definitions[schema["$ref"].rpartition("/")[2]])
        return {**schema, "$ref": f"{schema['$ref']}{_SUFFIX}"} if is_object else schema
    if "anyOf" in schema:
        return {
            **schema,
            "anyOf": [_change_of_value(each, definitions) for each in schema["anyOf"]],
        }
    changed = dict(schema)
    if isinstance(inner := schema.get("additionalProperties"), dict):
        changed["additionalProperties"] = {"anyOf": [_change_of_value(inner, definitions), _NULL]}
    if inner := schema.get("patternProperties"):
        changed["patternProperties"] = {
            pattern: {"anyOf": [_change_of_value(each, definitions), _NULL]}
            for pattern, each in inner.items()
        }
    return changed
