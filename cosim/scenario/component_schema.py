"""Validation of components by the data model of their kind, their JSON Schema, and their paths."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any

from pydantic import BaseModel, GetPydanticSchema, WithJsonSchema, create_model, model_validator
from pydantic.fields import FieldInfo
from pydantic_core.core_schema import no_info_plain_validator_function

from .component_sources import ComponentSource, InputTableSource, NestedSystem, component_kinds
from .evaluation_schema import CallSpec, ReferenceSpec
from .schema_types import HoldsPaths, PathChange, Spec, key, path_keys


def _parse_component(value: Any) -> ComponentSource:
    """Validate a component by the model of its kind.

    A component that does not have exactly one source, or a key of another kind, is refused by the
    model that has the keys of all kinds.
    """
    entry = value if isinstance(value, Mapping) else {}
    kinds = component_kinds(entry)
    given = [kind for name, kind in kinds.items() if entry.get(name) is not None]
    if len(given) != 1 or not entry.keys() <= given[0].model_fields.keys():
        component_model().model_validate(value)
        entry = {name: each for name, each in entry.items() if name in given[0].model_fields}
    return given[0].model_validate(entry)


#: a component of a scenario
ComponentSpec = Annotated[
    ComponentSource,
    GetPydanticSchema(lambda *_: no_info_plain_validator_function(_parse_component)),
    WithJsonSchema({"ref": "ComponentSpec"}),
]


class _AnyComponent(Spec):
    """Base of the model of components with the keys of all kinds."""

    @model_validator(mode="after")
    def _one_source(self) -> _AnyComponent:
        kinds = component_kinds(None)
        given = [name for name in kinds if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(
                f"expected exactly one of {', '.join(kinds)}; found {' and '.join(given) or 'none'}"
            )
        for name in type(self).model_fields:
            is_given = name in self.model_fields_set and getattr(self, name) not in (None, [], {})
            if is_given and name not in kinds[given[0]].model_fields:
                owners = [kind for kind in kinds.values() if name in kind.model_fields]
                keys = " or ".join(f'"{kind.KEY}"' for kind in owners)
                verb = "are" if name.endswith("s") else "is"
                hint = owners[0].MISPLACED.get(name, "")
                raise ValueError(f'"{name}" {verb} for components with {keys}{hint}')
        return self


@cache
def component_model() -> type[BaseModel]:
    """Return the model of components with the keys of all kinds, for problems and JSON Schema."""
    kinds = component_kinds(None)
    common = ComponentSource.model_fields
    owners: dict[str, list[str]] = {}
    fields: dict[str, Any] = {}
    for kind in kinds.values():
        for name in dict.fromkeys((kind.KEY, *kind.model_fields)):
            if name not in common:
                owners.setdefault(name, []).append(kind.KEY)
                fields[name] = _optional(kind.model_fields[name])
    rules: list[dict[str, Any]] = []
    for name, keys in owners.items():
        if name not in kinds:
            rules.append({"if": _is_given(name), "then": {"anyOf": list(map(_is_given, keys))}})
    for name, field in common.items():
        fields[name] = (field.annotation, field)
    names = list(kinds)
    model: type[BaseModel] = create_model(
        "ComponentSpec",
        __base__=_AnyComponent,
        __doc__=(
            f"A component with exactly one source: {', '.join(names[:-1])} or {names[-1]}.\n\n"
            "Paths start from the folder of this file."
        ),
        __cls_kwargs__={
            "json_schema_extra": {"oneOf": list(map(_is_given, kinds)), "allOf": rules}
        },
        **fields,
    )
    return model


def _is_given(name: str) -> dict[str, Any]:
    """Return the JSON Schema of objects in which a key has a value."""
    return {"required": [name], "properties": {name: {"not": {"enum": [None, [], {}]}}}}


def _optional(field: FieldInfo) -> tuple[Any, FieldInfo]:
    """Return annotation and field of a key that components of other kinds do not have."""
    if not field.is_required():
        return field.annotation, field
    annotation: Any = field.annotation
    if field.metadata:
        annotation = Annotated[(annotation, *field.metadata)]
    return annotation | None, key(
        str(field.description), (field.examples or [None])[0], default=None
    )


# -- paths of files in the JSON of scenarios and nested systems

#: entries other than components that name files, and their models or those of their elements
_MODELS: Mapping[str, type[Spec]] = {
    "scene": CallSpec,
    "reference": ReferenceSpec,
    "inputs": InputTableSource,
    "kpis": CallSpec,
    "figures": CallSpec,
}
_OBJECTS = ("scene", "reference")


def change_paths(system: Mapping[str, Any], change: PathChange) -> dict[str, Any]:
    """Return a copy of a scenario or nested system, or of a part, with changed paths.

    Texts in `arguments` and `parameters` are not paths for cosim and stay as they are.
    """

    def change_entry(entry: Any, keys: Mapping[str, HoldsPaths]) -> Any:
        if not isinstance(entry, Mapping):
            return entry
        changed = {
            name: mark.change(entry[name], change) for name, mark in keys.items() if name in entry
        }
        return {**entry, **changed}

    result = dict(system)
    for name in system.keys() & _MODELS.keys():
        keys = path_keys(_MODELS[name])
        match system[name]:
            case entry if name in _OBJECTS:
                result[name] = change_entry(entry, keys)
            case list(entries):
                result[name] = [change_entry(each, keys) for each in entries]
            case dict(entries):  # changes of a file with "extends", by name
                result[name] = {each: change_entry(entries[each], keys) for each in entries}
    if isinstance(components := system.get("components"), Mapping):
        changed = result["components"] = dict(components)
        for name, entry in components.items():
            if not isinstance(entry, Mapping):
                continue
            marks: dict[str, HoldsPaths] = {}
            for kind in component_kinds(entry).values():
                marks |= path_keys(kind)
            changed[name] = change_entry(entry, marks)
            inline = entry.get(NestedSystem.KEY)
            if isinstance(inline, Mapping):
                inner = changed[name][NestedSystem.KEY] = change_paths(inline, change)
                base = inline.get("extends")
                if isinstance(base, str) and (base.endswith(".json") or "/" in base):
                    inner["extends"] = change(base)
    return result
