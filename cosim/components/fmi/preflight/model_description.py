"""Model description as unchecked text, in the same form for FMI 2.0 and FMI 3.0."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from ....core.component import DTYPES
from .findings import DESCRIPTION_FILE, Finding

_FLOAT = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN")
_INTEGER = re.compile(r"[+-]?[0-9]{1,20}")
_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}


def is_true(attributes: Mapping[str, str], *names: str) -> bool:
    """Return whether one of some XML attributes is true."""
    return any(attributes.get(name) in ("true", "1") for name in names)


def parse_value(word: str, kind: str) -> float | int | bool:
    """Parse one value of a numeric FMI type.

    Args:
        word: The text.
        kind: FMI 3.0 type name: a float or integer type, Boolean or Enumeration.

    Raises:
        ValueError: The text is not a value of the type.
    """
    if kind == "Boolean":
        if word not in _BOOLEANS:
            raise ValueError(word)
        return _BOOLEANS[word]
    return parse_float(word) if kind.startswith("Float") else _parse_integer(word, kind)


def parse_float(word: str) -> float:
    """Parse a floating-point number, which may be infinite or NaN.

    Raises:
        ValueError: The text is not a number.
    """
    if not _FLOAT.fullmatch(word.strip()):
        raise ValueError(word)
    return float(word)


def _parse_integer(word: str, kind: str) -> int:
    if not _INTEGER.fullmatch(word.strip()):
        raise ValueError(word)
    limits, number = np.iinfo(DTYPES[kind]), int(word)
    if not limits.min <= number <= limits.max:
        raise ValueError(word)
    return number


#: interface of an FMU through which it is simulated
Interface = Literal["co-simulation", "model-exchange"]

#: (causality, variability) -> allowed values of `initial`, the default first (FMI 2.0.5 section
#: 2.2.7, FMI 3.0.2 section 2.4.7.4)
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


class TypeDefinition(NamedTuple):
    """Declared type.

    Attributes:
        name: Name of the type.
        kind: FMI 3.0 type name, or "" if FMI does not define the type.
        attributes: XML attributes.
        items: (name, value) of the items of an enumeration.
        line: Line in the file.
    """

    name: str
    kind: str
    attributes: Mapping[str, str]
    items: Sequence[tuple[str, str]]
    line: int


class ModelVariable(NamedTuple):
    """Model variable.

    Attributes:
        name: Name of the variable.
        kind: FMI 3.0 type name, or "" if FMI does not define the type.
        causality: Causality, "local" by default.
        variability: Variability, or its default.
        attributes: XML attributes of the variable and of its type element.
        start_words: Words of the start value, or None without one.
        dimensions: XML attributes of each dimension.
        aliases: XML attributes of each alias (FMI 3.0).
        line: Line in the file.
        declared_type: Declared type, if it exists.
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
        """Value of `initial`, or its default, or "" if there is none."""
        allowed = ALLOWED_INITIAL.get((self.causality, self.variability), ("",))
        return self.attributes.get("initial") or allowed[0]

    @property
    def is_float(self) -> bool:
        """True for Float32 and Float64."""
        return self.kind.startswith("Float")

    def attribute(self, name: str) -> str | None:
        """Return an XML attribute of the variable, or else of its declared type."""
        own, declared = self.attributes.get(name), self.declared_type
        return own or (declared.attributes.get(name) if declared else None)

    def __str__(self) -> str:
        return f'variable "{self.name}"'


#: violated rule, variable or line in the file, and what was found and expected
Violation = tuple[str, ModelVariable | int, str]


def to_finding(rule: str, place: ModelVariable | int, message: str) -> Finding:
    """Return the finding for a violation."""
    if isinstance(place, int):
        return Finding(rule, message, DESCRIPTION_FILE, place)
    return Finding(rule, f"{place}: {message}", DESCRIPTION_FILE, place.line)


class Unknown(NamedTuple):
    """Element of the model structure.

    Attributes:
        element: FMI 3.0 name of the element, such as "Output" or "InitialUnknown".
        reference: Reference to the variable: index in FMI 2.0, value reference in FMI 3.0.
        dependencies: References in `dependencies`, or None without that attribute.
        dependency_kinds: Words in `dependenciesKind`, or None without that attribute.
        line: Line in the file.
    """

    element: str
    reference: str
    dependencies: Sequence[str] | None
    dependency_kinds: Sequence[str] | None
    line: int


class UnitDefinition(NamedTuple):
    """Unit definition.

    Attributes:
        name: Name of the unit.
        base_unit: XML attributes of BaseUnit, or None without one.
        display_units: Names of the display units.
        line: Line in the file.
    """

    name: str
    base_unit: Mapping[str, str] | None
    display_units: Sequence[str]
    line: int


@dataclass(frozen=True)
class ModelDescription:
    """Model description.

    Attributes:
        major: FMI major version.
        root: XML attributes of the root element.
        interfaces: XML attributes of the interfaces through which the FMU can be simulated, the
            preferred one first.
        default_experiment: XML attributes of the default experiment.
        variables: Model variables in order.
        types: Declared types.
        units: Unit definitions.
        model_structure: Elements of the model structure.
        log_categories: Names of the log categories.
        lines: Lines of the elements below the root by name; "" for the root.
        by_reference: Variables by the reference that the model structure uses, see `Unknown`.
    """

    major: int
    root: Mapping[str, str]
    interfaces: Mapping[Interface, Mapping[str, str]]
    default_experiment: Mapping[str, str]
    variables: Sequence[ModelVariable]
    types: Sequence[TypeDefinition]
    units: Sequence[UnitDefinition]
    model_structure: Sequence[Unknown]
    log_categories: Sequence[str]
    lines: Mapping[str, int]
    by_reference: Mapping[str, ModelVariable] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Index the variables.

        FMI 2.0 refers to them by their index from 1, FMI 3.0 by value reference.
        """
        if self.major < 3:
            references = [str(index) for index in range(1, len(self.variables) + 1)]
        else:
            references = [
                variable.attributes.get("valueReference", "").strip() for variable in self.variables
            ]
        object.__setattr__(self, "by_reference", dict(zip(references, self.variables, strict=True)))
