"""A model description as it is written: texts, nothing checked, FMI 2.0 and 3.0 in the same shape."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

#: first the default, then what else `initial` may be (FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.4)
_EXACT, _DERIVED, _ANY = ("exact",), ("calculated", "approx"), ("calculated", "exact", "approx")
ALLOWED_INITIAL: Mapping[tuple[str, str], Sequence[str]] = {
    ("structuralParameter", "fixed"): _EXACT,
    ("structuralParameter", "tunable"): _EXACT,
    ("parameter", "fixed"): _EXACT,
    ("parameter", "tunable"): _EXACT,
    ("calculatedParameter", "fixed"): _DERIVED,
    ("calculatedParameter", "tunable"): _DERIVED,
    ("input", "discrete"): _EXACT,
    ("input", "continuous"): _EXACT,
    ("output", "constant"): _EXACT,
    ("output", "discrete"): _ANY,
    ("output", "continuous"): _ANY,
    ("local", "constant"): _EXACT,
    ("local", "fixed"): _DERIVED,
    ("local", "tunable"): _DERIVED,
    ("local", "discrete"): _ANY,
    ("local", "continuous"): _ANY,
    ("independent", "continuous"): ("",),
}


@dataclass(frozen=True, slots=True)
class TypeDefinition:
    """A declared type; `kind` is an FMI 3.0 type name, `items` are (name, value) of an enumeration."""

    name: str
    kind: str
    attributes: Mapping[str, str]
    items: Sequence[tuple[str, str]]
    line: int


@dataclass(frozen=True, slots=True)
class ModelVariable:
    """A variable; `kind` is an FMI 3.0 type name, or "" when it has none that FMI knows.

    `attributes` are those of the variable and of its type together, `starts` the words of its start value (None: it has
    none), `dimensions` the attributes of each of its dimensions, `aliases` those of its FMI 3.0 aliases.
    """

    name: str
    kind: str
    causality: str
    variability: str
    attributes: Mapping[str, str]
    start_words: Sequence[str] | None
    dimensions: Sequence[Mapping[str, str]]
    aliases: Sequence[Mapping[str, str]]
    line: int
    declared_type: TypeDefinition | None

    @property
    def initial(self) -> str:
        """What is written, else the default of causality and variability; "" where there is none."""
        return self.attributes.get("initial") or ALLOWED_INITIAL.get((self.causality, self.variability), ("",))[0]

    @property
    def is_float(self) -> bool:
        return self.kind.startswith("Float")

    def attribute(self, name: str) -> str | None:
        """Its own attribute, else that of its declared type."""
        return self.attributes.get(name) or (self.declared_type.attributes.get(name) if self.declared_type else None)

    def __str__(self) -> str:
        return f'variable "{self.name}"'


@dataclass(frozen=True, slots=True)
class Unknown:
    """A row of the model structure. `group` is the FMI 3.0 name of the list it stands in."""

    element: str
    reference: str
    dependencies: Sequence[str] | None
    dependency_kinds: Sequence[str] | None
    line: int


@dataclass(frozen=True, slots=True)
class UnitDefinition:
    """A unit; `base` are the attributes of its BaseUnit, None without one."""

    name: str
    base_unit: Mapping[str, str] | None
    display_units: Sequence[str]
    line: int


@dataclass(frozen=True)
class ModelDescription:
    """A model description. `root` are the attributes of the root, `interface` those of CoSimulation (None: not offered)."""

    major: int
    root: Mapping[str, str]
    co_simulation: Mapping[str, str] | None
    default_experiment: Mapping[str, str]
    variables: Sequence[ModelVariable]
    types: Sequence[TypeDefinition]
    units: Sequence[UnitDefinition]
    model_structure: Sequence[Unknown]
    log_categories: Sequence[str]
    lines: Mapping[str, int]
    by_reference: Mapping[str, ModelVariable] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """FMI 2.0 refers to variables by their place, counted from one, FMI 3.0 by their value references."""
        keys: Any = map(str, range(1, len(self.variables) + 1))
        if self.major == 3:
            keys = (variable.attributes.get("valueReference", "").strip() for variable in self.variables)
        object.__setattr__(self, "by_reference", dict(zip(keys, self.variables, strict=True)))
