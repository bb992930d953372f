"""Syntax tree of a flat model.

Expressions and statements as immutable data, with their source locations.

The attribute `where` of a node is its location in the source; it does not take part in comparisons.
"""

from __future__ import annotations

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
        """Location without the folder, so that it does not depend on the machine."""
        return f"{self.path.name}:{self.line}"


def raise_model_error(message: str, where: SourceLocation | None) -> NoReturn:
    """Raise an InputError for a part of the model that cannot be translated, with its location."""
    raise InputError(Problem(message, str(where or "")))


Expression: TypeAlias = (
    "Literal | Name | Index | Unary | Binary | If | Array | Comprehension | Range | Builtin | Call"
)
Statement: TypeAlias = (
    "Assign | MultiAssign | IfStatement | For | While | Assert | When | Reinit | EdgeDetector | "
    "Solve | ExternalCall"
)
Body: TypeAlias = "tuple[Statement, ...]"


@dataclass(frozen=True, slots=True)
class Literal:
    """A literal of a predefined type or of an enumeration (its number)."""

    value: float | int | bool | str
    type: str

    @property
    def number(self) -> float:
        """Value of a literal that is not text."""
        assert not isinstance(self.value, str)
        return self.value


@dataclass(frozen=True, slots=True)
class Name:
    """A reference to a variable, a function local, a loop index or `time`."""

    name: str
    where: SourceLocation | None = field(default=None, compare=False)


class Colon(NamedTuple):
    """The subscript `:`."""


@dataclass(frozen=True, slots=True)
class Index:
    """A subscripted expression: `a[i, :]`."""

    base: Expression
    subscripts: tuple[Expression | Colon, ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Unary:
    """A unary operation."""

    operator: OneOf["-", "not"]
    operand: Expression


@dataclass(frozen=True, slots=True)
class Binary:
    """A binary operation.

    The operators are those of Modelica, with ".+", ".-", ".*", "./" and ".^" for elementwise ones.
    """

    operator: str
    left: Expression
    right: Expression
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class If:
    """An if-expression: pairs of condition and value, and the value after `else`."""

    branches: tuple[tuple[Expression, Expression], ...]
    otherwise: Expression


@dataclass(frozen=True, slots=True)
class Array:
    """An array constructor: `{a, b}`."""

    elements: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Comprehension:
    """An array constructor with an iterator: `{value for index in range}`."""

    value: Expression
    index: str
    range: Expression
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Range:
    """A range: `start:stop` or `start:step:stop`."""

    start: Expression
    step: Expression | None
    stop: Expression


@dataclass(frozen=True, slots=True)
class Builtin:
    """A call of a built-in function or operator of Modelica: sin, pre, sample, size, ..."""

    name: str
    arguments: tuple[Expression, ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Call:
    """A call of a function of the model, with one argument for each of its inputs."""

    function: str
    arguments: tuple[Expression, ...]
    where: SourceLocation | None = field(default=None, compare=False)
    #: number of the result that is the value of the expression
    result: int = 0


@dataclass(frozen=True, slots=True)
class Assign:
    """An assignment `target := value` of an algorithm, or of a solved equation."""

    target: Name | Index
    value: Expression
    where: SourceLocation | None = field(default=None, compare=False)

    @property
    def name(self) -> str:
        """Name of the variable that is assigned as a whole or in part."""
        return referenced_variable(self.target)


@dataclass(frozen=True, slots=True)
class MultiAssign:
    """An assignment of several results of a function: `(a, b[i]) := f(x)`."""

    targets: tuple[Name | Index, ...]
    call: Call
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class IfStatement:
    """An if-statement: pairs of condition and body, and the body after `else`."""

    branches: tuple[tuple[Expression, Body], ...]
    otherwise: Body
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class For:
    """A for-loop over a range."""

    index: str
    range: Range
    body: Body
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class While:
    """A while-loop."""

    condition: Expression
    body: Body
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Reinit:
    """A `reinit` of a continuous state.

    It takes effect after all equations of the event have been evaluated.
    """

    target: Name | Index
    value: Expression
    where: SourceLocation | None = field(default=None, compare=False)

    @property
    def name(self) -> str:
        """Name of the state."""
        return referenced_variable(self.target)


@dataclass(frozen=True, slots=True)
class Solve:
    """A system of equations `residuals = 0` that is solved for scalar unknowns by Newton's method.

    It is inserted by the causality analysis. A linear system needs one iteration.
    """

    unknowns: tuple[Name | Index, ...]
    residuals: tuple[Expression, ...]
    #: partial derivatives, one row for each residual
    jacobian: tuple[tuple[Expression, ...], ...]
    linear: bool
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class ExternalCall:
    """The call of a C function, the body of an external function.

    `result = function(arguments)`.
    """

    function: str
    #: names of inputs, of outputs (passed by pointers), or expressions
    arguments: tuple[Expression, ...]
    result: Name | None
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Assert:
    """An `assert` or `terminate`.

    The message consists of String literals and of expressions whose values become text.
    """

    condition: Expression
    message: tuple[Expression, ...]
    where: SourceLocation | None = field(default=None, compare=False)
    #: true for the level warning, false for the level error
    warning: bool = False
    #: true for a `terminate`, which ends the simulation without an error
    terminates: bool = False


@dataclass(frozen=True, slots=True)
class When:
    """A when-clause, `when ... elsewhen ... end when`.

    In an equation section the order of its body has no meaning.
    """

    branches: tuple[tuple[Expression, Body], ...]
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class EdgeDetector:
    """A comparison of a condition with its value at the previous event.

    Sets the flag risen(index) at a rising edge.

    It is inserted by the analysis of when-clauses.
    """

    index: int
    condition: Expression
    where: SourceLocation | None = field(default=None, compare=False)


def referenced_variable(target: Expression) -> str:
    """Return the name of the variable in a reference such as `q` or `q[i]`.

    Raises:
        TypeError: The expression is not a reference.
    """
    while isinstance(target, Index):
        target = target.base
    if not isinstance(target, Name):
        raise TypeError(f"expected a reference, found {target}")
    return target.name
