"""Interface of compiled equations, which their binary exports and programs check when they load it.

The generated C defines three texts:

    equations_hash       hash of the variables and states
    equations_variables  the same in words, a line each, for the message about a difference
    equations_functions  arguments and results of the exported functions with their sizes, a line
                         "NAME ARGUMENT SIZE ... -> RESULT SIZE ..." for each function

The hash follows from the declared variables without CasADi, so a program compares it at no cost.
The sizes are those of the CasADi expressions from which the C code is generated: a program
allocates its arrays by them and counts nothing itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import TYPE_CHECKING

from ...core.component import Variable

if TYPE_CHECKING:
    import casadi as ca

#: end of the name of a table with any number of rows, whose size is that of one row
ROWS_SUFFIX = "_rows"


@dataclass(frozen=True, slots=True)
class ExportedFunction:
    """Sizes of the arrays that a compiled function reads and writes, by name and in order."""

    arguments: dict[str, int]
    results: dict[str, int]

    @property
    def sizes(self) -> dict[str, int]:
        """Sizes of all its arrays."""
        return self.arguments | self.results


def describe_variables(variables: Iterable[Variable], states: Iterable[str]) -> str:
    """Return everything that gives the elements of the arrays their meaning, a line per variable.

    Start values, limits and descriptions are left out: they may differ between vehicles.
    """
    lines = [f"state {name}" for name in states]
    for variable in variables:
        unit = variable.unit.name if variable.unit else "no unit"
        shape = "".join(f"[{size}]" for size in variable.shape)
        lines.append(f"{variable.causality} {variable.name}{shape} ({variable.type}, {unit})")
    return "\n".join(lines)


def interface_hash(variables_text: str) -> str:
    """Return the hash of a text of `describe_variables`."""
    return sha256(variables_text.encode()).hexdigest()


def interface_code(
    variables: Iterable[Variable], states: Iterable[str], functions: Sequence[ca.Function]
) -> str:
    """Return the C definitions of the three texts.

    Raises:
        ValueError: Arrays with the same name have different sizes.
    """
    text = describe_variables(variables, states)
    sizes: dict[str, int] = {}
    function_lines = []
    for function in functions:
        arrays = [(function.name_in(i), function.numel_in(i)) for i in range(function.n_in())]
        arrays += [(function.name_out(i), function.numel_out(i)) for i in range(function.n_out())]
        words = [f"{name} {size}" for name, size in arrays]
        words.insert(function.n_in(), "->")
        function_lines.append(" ".join([function.name(), *words]))
        for name, size in arrays:
            if sizes.setdefault(name, size) != size:
                raise ValueError(
                    f'{function.name()}: the array "{name}" has {size} elements, and '
                    f"{sizes[name]} in another function"
                )
    texts = {
        "hash": [interface_hash(text)],
        "variables": text.split("\n"),
        "functions": function_lines,
    }
    return "".join(
        f"\nMODEL_EXPORT const char equations_{name}[] =\n{_string_literal(lines)};\n"
        for name, lines in texts.items()
    )


def _string_literal(lines: Sequence[str]) -> str:
    separators = ["\\n"] * (len(lines) - 1) + [""]
    return "\n".join(f'    "{line}{end}"' for line, end in zip(lines, separators, strict=True))


def read_functions(text: str) -> dict[str, ExportedFunction]:
    """Return the functions of a text `equations_functions` by name."""
    functions = {}
    for line in text.splitlines():
        name, _, arrays = line.partition(" ")
        arguments, _, results = arrays.partition("->")
        functions[name] = ExportedFunction(_sizes(arguments), _sizes(results))
    return functions


def _sizes(words: str) -> dict[str, int]:
    names_and_sizes = words.split()
    return dict(zip(names_and_sizes[::2], map(int, names_and_sizes[1::2]), strict=True))


def first_difference(expected: str, found: str) -> tuple[str, str]:
    """Return the first lines in which two texts differ; "nothing" where one text has ended."""
    expected_lines, found_lines = expected.splitlines(), found.splitlines()
    count = max(len(expected_lines), len(found_lines))
    expected_lines += ["nothing"] * (count - len(expected_lines))
    found_lines += ["nothing"] * (count - len(found_lines))
    pairs = zip(expected_lines, found_lines, strict=True)
    return next(pair for pair in pairs if pair[0] != pair[1])
