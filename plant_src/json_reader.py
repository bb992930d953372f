"""Reader of JSON values that collects all problems instead of stopping at the first one."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

from cosim.core.errors import Problem, did_you_mean
from cosim.core.json_values import JsonObject

JsonPath = tuple[str, ...]
Numbers = tuple[float, ...]


def argument_problem(text: str, *path: str) -> Problem:
    """Return a problem of the argument with this path."""
    return Problem(text, subject=("arguments", *path))


class JsonReader:
    """Reader of the JSON arguments of a component.

    An invalid value is replaced by a valid one, so that reading continues. The path of a value is
    its place within the arguments.

    Attributes:
        problems: All problems; the subject of each is ("arguments", *path).
    """

    def __init__(self) -> None:
        self.problems: list[Problem] = []
        self._missing: set[JsonPath] = set()

    def add_problem(self, path: JsonPath, text: str) -> None:
        """Record a problem of the value at `path`, once."""
        problem = Problem(text, ".".join(path), ("arguments", *path))
        if problem not in self.problems:
            self.problems.append(problem)

    def add_missing(self, path: JsonPath, key: str, common: str) -> None:
        """Record that a key is missing at `path` and at `common`, unless it is misspelt there.

        The values at `common` count for all.
        """
        places = (("arguments", *path), ("arguments", common))
        misspelt = (
            each for each in self.problems if each.message.endswith(f'; did you mean "{key}"?')
        )
        if not any(each.subject[:-1] in places for each in misspelt):
            self.add_problem(path, f'"{key}" is missing, here and in "{common}"')

    def read_named_objects(self, value: Any, path: JsonPath) -> JsonObject:
        """Read an object whose keys become parts of variable names."""
        for name in (found := self.mapping(value, path)):
            if not re.fullmatch(r"[A-Za-z_]\w*", name):
                self.add_problem(
                    (*path, name),
                    f'found the name "{name}", expected letters, digits and underscores',
                )
        return found

    def read_object(
        self, value: Any, path: JsonPath, required: Sequence[str], optional: Sequence[str]
    ) -> JsonObject:
        """Read an object with these keys and no others."""
        found = self.mapping(value, path)
        valid = (*required, *optional)
        hints = {key: did_you_mean(key, valid) for key in found if key not in valid}
        for key, hint in hints.items():
            self.add_problem((*path, key), f'unknown key "{key}"{hint}')
        missing = (
            [key for key in required if key not in found] if isinstance(value, Mapping) else []
        )
        self._missing.update((*path, key) for key in missing)
        for key in missing:
            if f'; did you mean "{key}"?' not in hints.values():
                self.add_problem(path, f'"{key}" is missing')
        return found

    def mapping(self, value: Any, path: JsonPath) -> JsonObject:
        """Read an object with any keys."""
        if isinstance(value, Mapping):
            return value
        if tuple(path) not in self._missing:
            self.add_problem(path, f"found {value!r}, expected an object {{...}}")
        return {}

    def vector(self, value: Any, path: JsonPath, axes: Sequence[str]) -> Numbers:
        """Read a list of finite numbers, one for each of `axes`."""
        if not isinstance(value, list | tuple) or len(value) != len(axes):
            self.add_problem(
                path, f"found {value!r}, expected a list of {len(axes)} numbers [{', '.join(axes)}]"
            )
            return (1.0,) * len(axes)
        return tuple(self.number(number, path) for number in value)

    def number(
        self,
        value: Any,
        path: JsonPath,
        low: float = -math.inf,
        high: float = math.inf,
        hint: str = "",
    ) -> float:
        """Read a finite number from `low` to `high`.

        `hint` follows the message about another one.
        """
        if (
            not isinstance(value, int | float)
            or isinstance(value, bool)
            or not math.isfinite(value)
        ):
            self.add_problem(path, f"found {value!r}, expected a finite number")
        elif not low <= value <= high:
            self.add_problem(path, f"found {value!r}, expected {_range_text(low, high)}{hint}")
        else:
            return float(value)
        return min(max(1.0, low), high)

    def positive(self, value: Any, path: JsonPath) -> float:
        """Read a finite number greater than 0."""
        number = self.number(value, path)
        if number <= 0:
            self.add_problem(path, f"found {value!r}, expected a number greater than 0")
        return number if number > 0 else 1.0

    def integer(self, value: Any, path: JsonPath, low: int, high: int | None = None) -> int:
        """Read an integer from `low` to `high`."""
        if (
            isinstance(value, int)
            and not isinstance(value, bool)
            and value >= low
            and (high is None or value <= high)
        ):
            return value
        expected = f"of at least {low}" if high is None else f"from {low} to {high}"
        self.add_problem(path, f"found {value!r}, expected an integer {expected}")
        return low

    def choice(self, value: Any, path: JsonPath, valid: Sequence[str]) -> str:
        """Read one of the strings `valid`."""
        if isinstance(value, str) and value in valid:
            return value
        hint = (
            did_you_mean(value, valid)
            if isinstance(value, str)
            else f", expected one of: {', '.join(valid)}"
        )
        self.add_problem(path, f"found {value!r}{hint}")
        return valid[0]


def _range_text(low: float, high: float) -> str:
    if high == math.inf:
        return f"at least {low:g}"
    return f"at most {high:g}" if low == -math.inf else f"a number from {low:g} to {high:g}"
