"""A flattened Modelica model as plain frozen data: what the front end hands to the sorter, the emitter and the interpreter.

Flattened means: components, connections and modifiers are resolved; names are dotted ("pid.kp"), every `for` of an equation
section is unrolled, constants are values. Types are "Real", "Integer", "Boolean", "Enumeration" (an Integer from 1) and "String".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal as OneOf
from typing import NamedTuple, NoReturn, TypeAlias

from ....core.errors import InputError, Problem


class SourceLocation(NamedTuple):
    """A line of a Modelica file."""

    path: Path
    line: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line}"

    @property
    def file_and_line(self) -> str:
        """Without the folder: the same on every machine."""
        return f"{self.path.name}:{self.line}"


def raise_model_error(message: str, where: SourceLocation | None) -> NoReturn:
    """Say what cannot be translated, and where it stands."""
    raise InputError(Problem(message, str(where or "")))


Expression: TypeAlias = "Literal | Name | Index | Unary | Binary | If | Array | Range | Builtin | Call"
Statement: TypeAlias = "Assign | MultiAssign | IfStatement | For | Assert | When | EdgeDetector"
Body: TypeAlias = "tuple[Statement, ...]"


@dataclass(frozen=True, slots=True)
class Literal:
    value: float | int | bool | str
    type: str


@dataclass(frozen=True, slots=True)
class Name:
    """A variable, a local of a function, a loop index, or `time`."""

    name: str
    where: SourceLocation | None = field(default=None, compare=False)


class Colon(NamedTuple):
    """The subscript `:`."""


@dataclass(frozen=True, slots=True)
class Index:
    base: Expression
    subscripts: tuple[Expression | Colon, ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Unary:
    operator: OneOf["-", "not"]
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary:
    """`operator` as Modelica writes it; the elementwise ones are ".+", ".-", ".*", "./" and ".^"."""

    operator: str
    left: Expression
    right: Expression
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class If:
    branches: tuple[tuple[Expression, Expression], ...]
    otherwise: Expression


@dataclass(frozen=True, slots=True)
class Array:
    elements: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Range:
    start: Expression
    step: Expression | None
    stop: Expression


@dataclass(frozen=True, slots=True)
class Builtin:
    """A function or operator of the language, by its Modelica name: sin, pre, sample, size ..."""

    name: str
    arguments: tuple[Expression, ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Call:
    """A function of the model; one argument for each of its inputs."""

    function: str
    arguments: tuple[Expression, ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Assign:
    target: Name | Index
    value: Expression
    where: SourceLocation | None = field(default=None, compare=False)

    @property
    def name(self) -> str:
        """The variable that is assigned, or of which a part is assigned."""
        return referenced_variable(self.target)


@dataclass(frozen=True, slots=True)
class MultiAssign:
    """`(a, b[i]) := f(x)`."""

    targets: tuple[Name | Index, ...]
    call: Call
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class IfStatement:
    branches: tuple[tuple[Expression, Body], ...]
    otherwise: Body
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class For:
    index: str
    range: Range
    body: Body
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Assert:
    condition: Expression
    message: str
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class When:
    """`when ... elsewhen ... end when`, of an algorithm or of an equation section (then its body is unordered)."""

    branches: tuple[tuple[Expression, Body], ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class EdgeDetector:
    """Made by the sorter: compares a condition with its value at the last event and sets the flag risen(index)."""

    index: int
    condition: Expression
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of the flat model. `enumeration` names its enumeration type; `binding` is a declaration equation."""

    name: str
    type: str
    shape: tuple[int, ...]
    variability: OneOf["constant", "parameter", "discrete", "continuous"]
    causality: OneOf["input", "output", "local"]
    start: Expression | None
    binding: Expression | None
    bound_by_modifier: bool
    final: bool
    protected: bool
    top_level: bool
    unit: str
    description: str
    minimum: Expression | None
    maximum: Expression | None
    enumeration: str
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Equation:
    left: Expression
    right: Expression
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class FunctionVariable:
    """An input, output or protected variable of a function; a dimension is None where the argument decides (`:`)."""

    name: str
    type: str
    dimensions: tuple[Expression | None, ...]
    default: Expression | None
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Function:
    name: str
    inputs: tuple[FunctionVariable, ...]
    outputs: tuple[FunctionVariable, ...]
    locals: tuple[FunctionVariable, ...]
    body: Body
    where: SourceLocation | None = field(default=None, compare=False)


class StructuralParameters(NamedTuple):
    """Parameters whose default the front end has used to choose array sizes, loop ranges or equations."""

    purpose: str
    parameters: tuple[str, ...]
    where: SourceLocation | None


@dataclass(frozen=True)
class Model:
    """Everything of a flat model; `whens` are those of equation sections, `enumerations` maps a type to its literals.

    `states` are the continuous ones, which der() makes (see states.py).
    """

    name: str
    description: str
    variables: Mapping[str, Variable]
    equations: tuple[Equation, ...]
    whens: tuple[When, ...]
    algorithms: tuple[Body, ...]
    asserts: tuple[Assert, ...]
    initial_equations: tuple[Equation, ...]
    initial_algorithms: tuple[Body, ...]
    functions: Mapping[str, Function]
    enumerations: Mapping[str, tuple[str, ...]]
    structural: tuple[StructuralParameters, ...]
    states: tuple[str, ...] = ()


def referenced_variable(target: Expression) -> str:
    """The variable behind a reference such as `q` or `q[i]`."""
    while isinstance(target, Index):
        target = target.base
    if not isinstance(target, Name):
        raise TypeError(f"not a reference: {target}")
    return target.name


def derivative_name(state: str) -> str:
    """The name of the variable that holds the derivative of a state."""
    return f"der({state})"


def owning_component(name: str) -> str:
    """The component that a variable belongs to; "" for the model's own."""
    return name.removeprefix("der(").rpartition(".")[0]
