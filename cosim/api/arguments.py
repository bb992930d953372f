"""Checks of the types of arguments from Python, each with an error of one sentence."""

import os
from collections.abc import Iterable, Mapping
from typing import Any, get_args

from ..core.errors import InputError, Problem, did_you_mean
from ..core.text import shorten
from ..engine.pacer import LatePolicy
from ..scenario import IsolationMode


def expect(name: str, value: Any, accepted: bool, description: str) -> None:
    """Check an argument.

    Args:
        name: Name of the argument.
        value: Its value.
        accepted: The value is of the right type.
        description: The right type, for the message.

    Raises:
        InputError: The value is not accepted.
    """
    if not accepted:
        found = f"{shorten(repr(value))} ({type(value).__name__})"
        raise InputError(Problem(f"expected {description}; found {found}", name))


def check_names(name: str, value: Any) -> None:
    """Check that an argument is None or a mapping from texts; InputError otherwise."""
    has_names = isinstance(value, Mapping) and all(isinstance(key, str) for key in value)
    expect(name, value, value is None or has_names, "a dict from names to values")


def check_options(options: Mapping[str, Any], valid: Iterable[str]) -> None:
    """Check the names of keyword arguments; InputError with the nearest valid name."""
    names = list(valid)
    if unknown := [name for name in options if name not in names]:
        raise InputError(
            f'unknown argument "{name}"{did_you_mean(name, names)}' for name in unknown
        )


def check_load_arguments(scenario: Any, parameters: Any, options: Mapping[str, Any]) -> None:
    """Check the types of the arguments of `load`; InputError names the first wrong one."""
    text = "the path of a scenario file, the name of a shipped scenario, or a dict"
    expect("scenario", scenario, isinstance(scenario, str | os.PathLike | Mapping), text)
    check_names("parameters", parameters)
    for name in ("stop_time", "step_size"):
        time = options[name]
        is_time = time is None or isinstance(time, str) or is_number(time)
        expect(name, time, is_time, "seconds as a number or a text")
    ratio = options["real_time"]
    expect("real_time", ratio, ratio is None or is_number(ratio), "a number or None")
    for name, literal in (("late", LatePolicy), ("isolation", IsolationMode)):
        valid = get_args(literal)
        expect(name, options[name], options[name] in valid, f"one of {', '.join(map(repr, valid))}")
    expect("sandbox", options["sandbox"], isinstance(options["sandbox"], bool), "True or False")


def is_integer(value: Any) -> bool:
    """Return whether a value is an integer of Python or NumPy, and no Boolean."""
    return hasattr(value, "__index__") and not isinstance(value, bool)


def is_number(value: Any) -> bool:
    """Return whether a value is a number of Python or NumPy, and no Boolean."""
    return hasattr(value, "__float__") and not isinstance(value, bool | str)
