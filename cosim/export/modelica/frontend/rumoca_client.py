"""Client of the child process in which rumoca runs, and the parts of a model that it may change."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from ....core.errors import InputError, Problem
from ....process.failure_attribution import describe_exit_status

#: limits of the child process: processor time and wall time (s), private memory and size of the
#: flat model (bytes)
CPU_LIMIT, TIMEOUT, MEMORY_LIMIT, OUTPUT_LIMIT = 120, 900, 2 << 30, 1 << 28

#: numbers of parts of a model that are changed to find the one that rumoca refuses, without and
#: with packages
TRIALS, LIBRARY_TRIALS = 200, 3
_PROGRAM = Path(__file__).with_name("rumoca_process.py")

#: text that Rust writes when memory is exhausted
_OUT_OF_MEMORY = b"memory allocation of"


def run_rumoca(
    version: str,
    files: Sequence[Path],
    packages: Sequence[Path],
    model: str,
    text: tuple[str, str] | None,
    declaration: str = "",
) -> dict[str, Any]:
    """Run rumoca in a child process.

    Args:
        version: The required version.
        files: All files that the model may use; the file of the model is the first one.
        packages: Folders of packages.
        model: Full name of the model.
        text: Name under which the model's file is loaded, and its text; None for a member of a
            package.
        declaration: Text of a further class, which is that of the model.

    Returns:
        The answer of `rumoca_process`.

    Raises:
        InputError: rumoca crashed, did not end in time or exceeded a limit; names the file that it
            was reading.
    """
    request = {
        "version": version,
        "files": [str(file) for file in files],
        "packages": [str(package) for package in packages],
        "model": model,
        "text": text,
        "declaration": declaration,
        "values": assigned_values(text[1]) if text else [],
        "parts": removable_parts(text[1]) if text else [],
        "trials": LIBRARY_TRIALS if packages else TRIALS,
        "memory": MEMORY_LIMIT,
        "output_size": OUTPUT_LIMIT,
        "seconds": CPU_LIMIT,
    }
    with TemporaryFile() as output, TemporaryFile() as errors:
        reason = _run_process(json.dumps(request).encode(), output, errors)
        output.seek(0)
        messages: list[dict[str, Any]] = [
            json.loads(line) for line in output if line.endswith(b"\n")
        ]
        errors.seek(0)
        if _OUT_OF_MEMORY in errors.read(OUTPUT_LIMIT):
            reason = f"it needs more than {MEMORY_LIMIT >> 30} GiB of memory"
    present = [message["file"] for message in messages if "file" in message]
    if messages and "file" not in messages[-1]:
        return messages[-1]
    raise InputError(
        Problem(
            f"the Modelica front end failed on this file: {reason}",
            present[-1] if present else str(files[0]),
        )
    )


def _run_process(request: bytes, output: Any, errors: Any) -> str:
    """Run the child process to its end and return the description of a failure."""
    command = [sys.executable, "-P", str(_PROGRAM)]
    # rumoca would read further libraries from the folders of MODELICAPATH
    environment = {name: value for name, value in os.environ.items() if name != "MODELICAPATH"}
    try:
        process = subprocess.run(  # noqa: S603
            command,
            input=request,
            stdout=output,
            stderr=errors,
            timeout=TIMEOUT,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return f"it did not end within {TIMEOUT:g} s"
    return describe_exit_status(
        -process.returncode if process.returncode < 0 else process.returncode << 8
    )


_PART_TOKEN = re.compile(
    r'(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<string>"(?:[^"\\]|\\.)*")|'
    r"(?P<word>[A-Za-z_]\w*)|(?P<symbol>:=|==|<=|>=|<>|\S)",
    re.DOTALL,
)
_SECTIONS = ("equation", "algorithm")
_COMPOUND = ("if", "for", "while", "when")
_OPEN, _CLOSE = ("(", "[", "{"), (")", "]", "}")
Token = tuple[str, int, int]


def removable_parts(text: str) -> list[tuple[int, int]]:
    """Return begin and end of each equation or statement, then of each binding.

    >>> text = "model M Real x = 1; equation y = x; end M;"
    >>> [text[begin:end] for begin, end in removable_parts(text)]
    ['y = x;', '= 1']
    """
    tokens = _tokens(text)
    equations: list[tuple[int, int]] = []
    bindings: list[tuple[int, int]] = []
    k = 0
    while k < len(tokens):
        in_section = tokens[k][0] in _SECTIONS
        k = (
            _read_section(tokens, k + 1, equations)
            if in_section
            else _read_declaration(tokens, k, bindings)
        )
    return equations + bindings


def assigned_values(text: str) -> list[tuple[int, int]]:
    """Return begin and end of the right side of each assignment, then of each equation.

    Those inside of loops and branches are included.

    >>> text = "model M Real x; algorithm if a then x := 1; end if; equation y = x; end M;"
    >>> [text[begin:end] for begin, end in assigned_values(text)]
    ['1', 'x']
    """
    tokens = _tokens(text)
    sides: dict[str, list[tuple[int, int]]] = {":=": [], "=": []}
    for begin, end in removable_parts(text):
        inside = [k for k, token in enumerate(tokens) if begin <= token[1] < end]
        for k in _outside_of_parentheses(tokens, inside[0], inside[-1]):
            if tokens[k][0] in sides and k > inside[0]:
                sides[tokens[k][0]].append((tokens[k + 1][1], tokens[_end_of_simple(tokens, k)][1]))
    return sides[":="] + sides["="]


def _tokens(text: str) -> list[Token]:
    return [
        (m[0], m.start(), m.end()) for m in _PART_TOKEN.finditer(text) if m.lastgroup != "comment"
    ]


def _read_section(tokens: Sequence[Token], k: int, parts: list[tuple[int, int]]) -> int:
    """Append the statements of a section that begins at a token.

    Return the number of the token after it.
    """
    while k < len(tokens) and tokens[k][0] not in (
        "end",
        "public",
        "protected",
        "initial",
        "annotation",
        "external",
        *_SECTIONS,
    ):
        last = (
            _end_of_compound(tokens, k) if tokens[k][0] in _COMPOUND else _end_of_simple(tokens, k)
        )
        parts.append((tokens[k][1], tokens[last][2]))
        k = last + 1
    return k


def _read_declaration(tokens: Sequence[Token], k: int, parts: list[tuple[int, int]]) -> int:
    """Append the binding of the declaration that begins at a token, if it has one.

    Return the number of the token after it.
    """
    last = _end_of_simple(tokens, k)
    for j in _outside_of_parentheses(tokens, k, last):
        if tokens[j][0] in _SECTIONS:
            return j
        if tokens[j][0] == "=":
            stop = next(
                (
                    i
                    for i in _outside_of_parentheses(tokens, j, last)
                    if tokens[i][0] in ("annotation", "if")
                ),
                last,
            )
            while tokens[stop - 1][0].startswith('"') and stop - 2 > j:
                stop -= 1
            parts.append((tokens[j][1], tokens[stop - 1][2]))
            break
    return last + 1


def _outside_of_parentheses(tokens: Sequence[Token], first: int, last: int) -> Iterator[int]:
    depth = 0
    for k in range(first, last):
        depth += (tokens[k][0] in _OPEN) - (tokens[k][0] in _CLOSE)
        if depth == 0:
            yield k


def _end_of_simple(tokens: Sequence[Token], first: int) -> int:
    """Return the number of the next semicolon outside of parentheses, or of the last token."""
    depth = 0
    for k in range(first, len(tokens)):
        depth += (tokens[k][0] in _OPEN) - (tokens[k][0] in _CLOSE)
        if tokens[k][0] == ";" and depth <= 0:
            return k
    return len(tokens) - 1


def _end_of_compound(tokens: Sequence[Token], first: int) -> int:
    """Return the number of the semicolon after the `end if` or similar that belongs to a token."""
    depth = 0
    for k in range(first, len(tokens) - 2):
        word = tokens[k][0]
        if word == "end" and tokens[k + 1][0] in _COMPOUND:
            depth -= 1
            if depth == 0:
                return k + 2
        elif (
            word in _COMPOUND
            and tokens[k - 1][0] in (";", "then", "else", "loop", *_SECTIONS)
            and (depth or k == first)
        ):
            depth += 1
    return _end_of_simple(tokens, first)
