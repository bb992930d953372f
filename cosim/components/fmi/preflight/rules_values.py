"""Rules about values: start values, min and max, and the sizes of arrays."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator, Mapping, Sequence

from .findings import DESCRIPTION_FILE, Finding, Rule
from .limits import PreflightLimits
from .model_description import ModelDescription, ModelVariable
from .values import parse_float, parse_value

_START = "FMI 2.0.5 section 2.2.7, FMI 3.0.2 section 2.4.7.5"
_DIMENSION = "FMI 3.0.2 section 2.4.7.2"

MISSING = Rule("start.missing", _START, "warning")
UNEXPECTED = Rule("start.unwanted", _START, "warning")
VALUE = Rule("start.value", _START)
FINITE = Rule("start.finite", _START)
INFINITE = Rule("start.infinite", _START, "warning")
RANGE = Rule("start.range", _START, "warning")
COUNT = Rule("start.count", "FMI 3.0.2 section 2.4.7.5")
LIMIT = Rule("variable.limits", _START, "warning")
LIMIT_VALUE = Rule("variable.limit-value", _START, "warning")
DIMENSION = Rule("variable.dimension", _DIMENSION)
SIZE = Rule("variable.size", "limits")

_NON_NUMERIC_TYPES = ("String", "Binary", "Clock", "")


def check_starts(model: ModelDescription) -> Iterator[Finding]:
    """Check that start values exist where required, are valid, and are between min and max."""
    for variable in model.variables:
        if (
            variable.kind not in ("Clock", "") and model.major > 1
        ):  # FMI 1.0 requires no start values
            yield from _check_start_presence(variable)
        if variable.kind not in _NON_NUMERIC_TYPES:
            yield from _check_start_values(variable)


def _check_start_presence(variable: ModelVariable) -> Iterator[Finding]:
    initial, causality = variable.initial, variable.causality
    if not variable.start_words and (initial in ("exact", "approx") or causality == "input"):
        reason = "inputs" if causality == "input" else f'initial="{initial}"'
        yield _variable_finding(
            MISSING, variable, f"has no start value, which is required for {reason}"
        )
    if variable.start_words is not None and (initial == "calculated" or causality == "independent"):
        reason = "it is independent" if causality == "independent" else 'initial="calculated"'
        yield _variable_finding(UNEXPECTED, variable, f"has a start value, but {reason}")


def _check_start_values(variable: ModelVariable) -> Iterator[Finding]:
    low, high = yield from _read_limits(variable)
    for word in variable.start_words or ():
        try:
            number = parse_value(word, variable.kind)
        except ValueError:
            text = (
                f'start value "{" ".join(variable.start_words or ())}" of {variable} is not a '
                f"valid {variable.kind}"
            )
            yield VALUE(text, DESCRIPTION_FILE, variable.line)
            return
        if not math.isfinite(number):
            is_allowed = math.isinf(number) and variable.causality not in ("input", "output")
            text = f"found start value {word}, expected a finite number"
            yield _variable_finding(INFINITE if is_allowed else FINITE, variable, text)
        elif not low <= number <= high:
            yield _variable_finding(
                RANGE, variable, f"found start value {word}, expected {low:g} to {high:g}"
            )
    yield from _check_enumeration_start(variable)


def _read_limits(variable: ModelVariable) -> Generator[Finding, None, tuple[float, float]]:
    """Return (min, max), infinite for a limit that is missing or invalid.

    Yield findings about invalid limits.
    """
    limits = {"min": -math.inf, "max": math.inf}
    for name in limits:
        if (text := variable.attribute(name)) is None or variable.kind == "Boolean":
            continue
        limit = read_limit(text)
        if limit is None:
            yield _variable_finding(
                LIMIT_VALUE, variable, f'found {name}="{text}", expected a number'
            )
        else:
            limits[name] = limit
    if limits["min"] > limits["max"]:
        yield _variable_finding(
            LIMIT, variable, f"min {limits['min']:g} is above max {limits['max']:g}"
        )
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


def _check_enumeration_start(variable: ModelVariable) -> Iterator[Finding]:
    if variable.kind == "Enumeration" and variable.declared_type and variable.declared_type.items:
        values = {item[1].strip() for item in variable.declared_type.items}
        for word in variable.start_words or ():
            if word not in values:
                text = (
                    f'found start value {word}, expected an item of "{variable.declared_type.name}"'
                )
                yield _variable_finding(RANGE, variable, text)


def check_dimensions(model: ModelDescription, limits: PreflightLimits) -> Iterator[Finding]:
    """Check the dimensions of arrays, the number of their start values, and the number of all elements."""
    scalars = 0
    for variable in model.variables:
        if not variable.dimensions:
            shape: Sequence[int] | None = ()
        else:
            shape = yield from _read_shape(model, variable)
        if shape is None:
            continue
        size = math.prod(shape)
        if size > limits.max_array_size:
            yield _variable_finding(
                SIZE, variable, f"has {size} elements, expected at most {limits.max_array_size}"
            )
            continue
        scalars += size * (1 + len(variable.aliases))
        if scalars > limits.max_scalars:
            text = (
                f"the variables up to this one have {scalars} elements, expected at most "
                f"{limits.max_scalars}"
            )
            yield _variable_finding(SIZE, variable, text)
            return
        if variable.start_words and len(variable.start_words) not in (1, size):
            count = len(variable.start_words)
            text = f"found {count} start value{'s' if count > 1 else ''}, expected {size}"
            yield _variable_finding(COUNT, variable, text)


def _read_shape(
    model: ModelDescription, variable: ModelVariable
) -> Generator[Finding, None, Sequence[int] | None]:
    """Return the shape, or None if a dimension is invalid.

    Yield findings about invalid dimensions.
    """
    sizes = [dimension_size(model, dimension) for dimension in variable.dimensions]
    for size, dimension in zip(sizes, variable.dimensions, strict=True):
        if size is None or size < 1:
            found = " ".join(f'{name}="{text}"' for name, text in dimension.items()) or "nothing"
            expected = "start > 0, or the value reference of a structural parameter with start > 0"
            text = f"found a dimension with {found}, expected {expected}"
            yield _variable_finding(DIMENSION, variable, text)
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


def _variable_finding(rule: Rule, variable: ModelVariable, text: str) -> Finding:
    return rule(f"{variable}: {text}", DESCRIPTION_FILE, variable.line)
