"""Rules about variables.

Names, causality, variability, value references, references to other definitions, start values, min
and max, and the sizes of arrays.
"""

import math
import re
from collections import defaultdict
from collections.abc import Generator, Iterator, Mapping, Sequence
from itertools import islice

from ....core.errors import did_you_mean
from ....core.size_limits import MAX_SCALARS
from .model_description import (
    ALLOWED_INITIAL,
    ModelDescription,
    ModelVariable,
    Violation,
    parse_float,
    parse_value,
)

_ATTRIBUTE_VALUES = {
    "causality": """
        parameter calculatedParameter input output local independent structuralParameter
    """,
    "variability": "constant fixed tunable discrete continuous",
    "initial": "exact approx calculated",
}
_NAME_PATTERN = (
    r"(?:[A-Za-z_][A-Za-z0-9_]*|'(?:[A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~ "
    r"]|\\['\"?\\abfnrtv])+')(?:\[[0-9]+(?:,[0-9]+)*\])?"
)
_STRUCTURED_NAME = re.compile(
    rf"{_NAME_PATTERN}(?:\.{_NAME_PATTERN})*|"
    rf"der\({_NAME_PATTERN}(?:\.{_NAME_PATTERN})*(?:,[0-9]+)?\)"
)
#: largest number of names that are compared for a spelling hint, which is slow
_MAX_HINT_CANDIDATES = 200
#: types of FMI 2.0 whose value references share one number range with another type
_ACCESSOR_TYPES = {"Enumeration": "Int32"}


def check_identity(model: ModelDescription) -> Iterator[Violation]:
    """Check that variable names are printable, unique and follow the declared naming convention."""
    first_lines: dict[str, int] = {}
    is_structured = model.root.get("variableNamingConvention") == "structured"
    for name, line in _all_names(model):
        if not name or not name.isprintable():
            text = f'found the variable name "{name}", expected one without control characters'
            yield "variable.name", line, text
        elif is_structured and not _STRUCTURED_NAME.fullmatch(name):
            text = f'the name "{name}" does not follow the structured naming convention'
            yield "variable.convention", line, text
        if name in first_lines:
            text = (
                f'the variable name "{name}" is already used in line {first_lines[name]}; this one '
                "is ignored"
            )
            yield "variable.unique", line, text
        first_lines.setdefault(name, line)


def _all_names(model: ModelDescription) -> Iterator[tuple[str, int]]:
    for variable in model.variables:
        yield variable.name, variable.line
        for alias in variable.aliases:
            yield alias.get("name", ""), variable.line


def check_kinds(model: ModelDescription) -> Iterator[Violation]:
    """Check that type, causality, variability and initial are valid and allowed in combination."""
    for variable in model.variables:
        if not variable.kind:
            yield "variable.type", variable, "has no type that this FMI version defines"
        invalid_values = list(_check_attribute_values(variable))
        yield from invalid_values
        if not invalid_values and variable.kind != "Clock":
            yield from _check_combination(model, variable)
    count = sum(variable.causality == "independent" for variable in model.variables)
    if count > 1 or (model.major == 3 and count == 0):
        yield (
            "variable.independent",
            model.lines[""],
            f"found {count} independent variables, expected one",
        )


def _check_attribute_values(variable: ModelVariable) -> Iterator[Violation]:
    for attribute, allowed in _ATTRIBUTE_VALUES.items():
        words = allowed.split()
        word = variable.attributes.get(attribute, words[0])
        if word not in words:
            text = f'found {attribute}="{word}"{did_you_mean(word, words)}'
            yield "variable.word", variable, text


def _check_combination(model: ModelDescription, variable: ModelVariable) -> Iterator[Violation]:
    causality, variability = variable.causality, variable.variability
    allowed = ALLOWED_INITIAL.get((causality, variability))
    if allowed is None:
        text = f'causality="{causality}" is not allowed with variability="{variability}"'
        yield "variable.combination", variable, text
        return
    if variability == "continuous" and variable.kind and not variable.is_float:
        text = (
            f'type {variable.kind} is not allowed with variability="continuous"; it is treated as '
            "discrete"
        )
        yield "variable.continuous", variable, text
    if (
        model.major == 2
        and "variability" not in variable.attributes
        and variable.kind
        and not variable.is_float
    ):
        text = (
            f"lacks the attribute variability; its default is continuous, but {variable.kind} is "
            "treated as discrete"
        )
        yield "variable.implied-continuous", variable, text
    initial = variable.attributes.get("initial")
    if initial and (causality == "independent" or (causality == "input" and model.major == 2)):
        text = f'found initial="{initial}", expected none for causality="{causality}"'
        yield "variable.initial-not-allowed", variable, text
    elif initial and initial not in allowed:
        text = (
            f'initial="{initial}" is not allowed with causality="{causality}" and '
            f'variability="{variability}"'
        )
        yield "variable.initial", variable, text


def check_references(model: ModelDescription) -> Iterator[Violation]:
    """Check value references: unique in FMI 3.0, shared only by aliases in FMI 2.0."""
    groups: dict[tuple[str, int], list[ModelVariable]] = defaultdict(list)
    for variable in model.variables:
        text = variable.attributes.get("valueReference", "")
        if not re.fullmatch(r"\s*\+?[0-9]{1,10}\s*", text) or int(text) >= 2**32:
            message = f'found valueReference="{text}", expected an integer from 0 to 4294967295'
            yield "reference.value", variable, message
        else:
            kind = _ACCESSOR_TYPES.get(variable.kind, variable.kind) if model.major < 3 else ""
            groups[kind, int(text)].append(variable)
    for group in groups.values():
        if model.major == 3:
            for variable in group[1:]:
                text = f'has the same value reference as "{group[0].name}", expected a unique one'
                yield "reference.shared", variable, text
        elif model.major == 2:  # FMI 1.0 allows aliases of all variables
            yield from _check_aliases(group)


def _check_aliases(group: Sequence[ModelVariable]) -> Iterator[Violation]:
    settable = [variable for variable in group if variable.causality in ("input", "parameter")]
    for variable in settable[1:]:
        text = (
            f'has the same value reference as "{settable[0].name}", expected a unique one for each '
            "input and parameter"
        )
        yield "reference.shared", variable, text
    first = group[0]
    for variable in group[1:]:
        if (variable.variability == "constant") != (first.variability == "constant"):
            text = f'is an alias of "{first.name}", but only one of them is constant'
            yield "reference.alias", variable, text
        if variable.attribute("unit") != first.attribute("unit"):
            yield (
                "reference.alias",
                variable,
                f'is an alias of "{first.name}", but has another unit',
            )


def check_declarations(model: ModelDescription) -> Iterator[Violation]:
    """Check that the declared types, units, states and clocks that variables refer to exist."""
    units = {unit.name: unit.display_units for unit in model.units}
    for variable in model.variables:
        yield from _check_declared_type(model, variable)
        yield from _check_units(variable, units)
        state = variable.attributes.get("derivative", "").strip()
        if state and (state not in model.by_reference or not model.by_reference[state].is_float):
            text = f'found derivative="{state}", expected a reference to a floating-point variable'
            yield "variable.derivative", variable, text
        for clock in variable.attributes.get("clocks", "").split():
            if clock not in model.by_reference or model.by_reference[clock].kind != "Clock":
                text = f'found "{clock}" in its clocks, expected a reference to a clock'
                yield "variable.clocks", variable, text


def _check_declared_type(model: ModelDescription, variable: ModelVariable) -> Iterator[Violation]:
    name = variable.attributes.get("declaredType")
    if name is None:
        if variable.kind == "Enumeration" and model.major > 1:
            yield "variable.declared-type", variable, "is an enumeration without declaredType"
    elif variable.declared_type is None:
        hint = did_you_mean(
            name, (definition.name for definition in model.types[:_MAX_HINT_CANDIDATES])
        )
        yield (
            "variable.declared-type",
            variable,
            f'found declaredType="{name}", which is not defined{hint}',
        )
    elif variable.kind and variable.declared_type.kind not in ("", variable.kind):
        text = (
            f'the type "{name}" is {variable.declared_type.kind}, but the variable is '
            f"{variable.kind}"
        )
        yield "variable.other-type", variable, text


def _check_units(variable: ModelVariable, units: dict[str, Sequence[str]]) -> Iterator[Violation]:
    if not variable.is_float:
        return
    unit, display = variable.attribute("unit"), variable.attributes.get("displayUnit")
    if unit is not None and unit not in units:
        hint = did_you_mean(unit, islice(units, _MAX_HINT_CANDIDATES))
        yield "variable.unit", variable, f'the unit "{unit}" is not defined{hint}'
    elif display is not None and display not in units.get(unit or "", ()):
        text = f'the display unit "{display}" is not defined for unit "{unit or ""}"'
        yield "variable.display-unit", variable, text


CHECKS = (check_identity, check_kinds, check_references, check_declarations)


#: largest number of elements of one array variable
MAX_ARRAY_SIZE = 1_000_000
_NON_NUMERIC_TYPES = ("String", "Binary", "Clock", "")


def check_starts(model: ModelDescription) -> Iterator[Violation]:
    """Check that start values exist where required, are valid, and are between min and max."""
    for variable in model.variables:
        if (
            variable.kind not in ("Clock", "") and model.major > 1
        ):  # FMI 1.0 requires no start values
            initial, causality = variable.initial, variable.causality
            if not variable.start_words and (
                initial in ("exact", "approx") or causality == "input"
            ):
                reason = "inputs" if causality == "input" else f'initial="{initial}"'
                text = f"has no start value, which is required for {reason}"
                yield "start.missing", variable, text
            if variable.start_words is not None and (
                initial == "calculated" or causality == "independent"
            ):
                reason = (
                    "it is independent" if causality == "independent" else 'initial="calculated"'
                )
                yield "start.unwanted", variable, f"has a start value, but {reason}"
        if variable.kind not in _NON_NUMERIC_TYPES:
            yield from _check_start_values(variable)


def _check_start_values(variable: ModelVariable) -> Iterator[Violation]:
    low, high = yield from _read_limits(variable)
    for word in variable.start_words or ():
        try:
            number = parse_value(word, variable.kind)
        except ValueError:
            text = (
                f'start value "{" ".join(variable.start_words or ())}" of {variable} is not a '
                f"valid {variable.kind}"
            )
            yield "start.value", variable.line, text
            return
        if not math.isfinite(number):
            is_allowed = math.isinf(number) and variable.causality not in ("input", "output")
            text = f"found start value {word}, expected a finite number"
            yield "start.infinite" if is_allowed else "start.finite", variable, text
        elif not low <= number <= high:
            yield "start.range", variable, f"found start value {word}, expected {low:g} to {high:g}"
    if variable.kind == "Enumeration" and variable.declared_type and variable.declared_type.items:
        values = {item[1].strip() for item in variable.declared_type.items}
        for word in variable.start_words or ():
            if word not in values:
                text = (
                    f'found start value {word}, expected an item of "{variable.declared_type.name}"'
                )
                yield "start.range", variable, text


def _read_limits(variable: ModelVariable) -> Generator[Violation, None, tuple[float, float]]:
    """Return (min, max), infinite for a limit that is missing or invalid.

    Yield findings about invalid limits.
    """
    limits = {"min": -math.inf, "max": math.inf}
    for name in limits:
        if (text := variable.attribute(name)) is None or variable.kind == "Boolean":
            continue
        limit = read_limit(text)
        if limit is None:
            yield "variable.limit-value", variable, f'found {name}="{text}", expected a number'
        else:
            limits[name] = limit
    if limits["min"] > limits["max"]:
        yield "variable.limits", variable, f"min {limits['min']:g} is above max {limits['max']:g}"
        return -math.inf, math.inf
    return limits["min"], limits["max"]


def read_limit(text: str) -> float | None:
    """Parse the value of `min` or `max`.

    Limits of integers are parsed as floating-point numbers too, because exporters write limits
    beyond the integer range.

    Returns:
        The limit, or None if the text is not a number.
    """
    try:
        limit = parse_float(text.strip())
    except ValueError:
        return None
    return None if math.isnan(limit) else limit


def check_dimensions(model: ModelDescription) -> Iterator[Violation]:
    """Check dimensions and numbers of start values of arrays, and the number of all elements."""
    scalars = 0
    for variable in model.variables:
        if not variable.dimensions:
            shape: Sequence[int] | None = ()
        else:
            shape = yield from _read_shape(model, variable)
        if shape is None:
            continue
        size = math.prod(shape)
        if size > MAX_ARRAY_SIZE:
            yield (
                "variable.size",
                variable,
                f"has {size} elements, expected at most {MAX_ARRAY_SIZE}",
            )
            continue
        scalars += size * (1 + len(variable.aliases))
        if scalars > MAX_SCALARS:
            text = (
                f"the variables up to this one have {scalars} elements, expected at most "
                f"{MAX_SCALARS}"
            )
            yield "variable.size", variable, text
            return
        if variable.start_words and len(variable.start_words) not in (1, size):
            count = len(variable.start_words)
            text = f"found {count} start value{'s' if count > 1 else ''}, expected {size}"
            yield "start.count", variable, text


def _read_shape(
    model: ModelDescription, variable: ModelVariable
) -> Generator[Violation, None, Sequence[int] | None]:
    """Return the shape, or None if a dimension is invalid.

    Yield findings about invalid dimensions.
    """
    sizes = [dimension_size(model, dimension) for dimension in variable.dimensions]
    for size, dimension in zip(sizes, variable.dimensions, strict=True):
        if size is None or size < 1:
            found = " ".join(f'{name}="{text}"' for name, text in dimension.items()) or "nothing"
            expected = "start > 0, or the value reference of a structural parameter with start > 0"
            yield (
                "variable.dimension",
                variable,
                f"found a dimension with {found}, expected {expected}",
            )
    valid = [size for size in sizes if size]
    return valid if len(valid) == len(sizes) else None


def dimension_size(model: ModelDescription, dimension: Mapping[str, str]) -> int | None:
    """Return the size of a dimension according to the start values.

    Args:
        model: The model description.
        dimension: XML attributes of the dimension.

    Returns:
        The size, or None if the dimension is not defined by exactly one of `start` and a valid
        `valueReference`.
    """
    reference, text = dimension.get("valueReference"), dimension.get("start")
    if (reference is None) == (text is None):
        return None
    if reference is not None:
        source = model.by_reference.get(reference.strip())
        if (
            source is None
            or source.dimensions
            or source.causality != "structuralParameter"
            or len(source.start_words or ()) != 1
        ):
            return None
        text = (source.start_words or ("",))[0]
    try:
        return int(parse_value((text or "").strip(), "UInt64"))
    except ValueError:
        return None
