"""The flat model: a flattened Modelica model as immutable data.

The front end produces it; causality analysis, code generation and the interpreter use it. In a flat
model components, connections and modifiers are resolved, names are dotted ("pid.kp"), and
for-equations are unrolled. Types are "Real", "Integer", "Boolean", "Enumeration" (an Integer,
counted from 1), "String" and "ExternalObject".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol
from typing import Literal as OneOf

from .syntax_tree import (
    Assert,
    Binary,
    Body,
    Expression,
    SourceLocation,
    When,
)


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of the flat model with its attributes."""

    name: str
    type: str
    shape: tuple[int, ...]
    variability: OneOf["constant", "parameter", "discrete", "continuous"]
    causality: OneOf["input", "output", "local"]
    start: Expression | None
    #: right side of the declaration equation
    binding: Expression | None
    #: true if the binding comes from a modifier of the component that contains the variable
    bound_by_modifier: bool
    final: bool
    #: attribute `fixed`; None if it is not given
    fixed: bool | None
    protected: bool
    #: true if the variable belongs to the model itself and not to one of its components
    top_level: bool
    unit: str
    description: str
    minimum: Expression | None
    maximum: Expression | None
    #: name of the enumeration type, or ""
    enumeration: str
    where: SourceLocation | None = field(default=None, compare=False)
    #: physical quantity, for example "Mass", or ""
    quantity: str = ""


@dataclass(frozen=True, slots=True)
class Equation:
    """An equation `left = right`."""

    left: Expression
    right: Expression
    where: SourceLocation | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class FunctionVariable:
    """An input, output or protected variable of a function; a dimension declared as `:` is None."""

    name: str
    type: str
    dimensions: tuple[Expression | None, ...]
    default: Expression | None
    where: SourceLocation | None = field(default=None, compare=False)


class CallableLibrary(Protocol):
    """External functions that can be called."""

    def call(self, function: Function, inputs: Sequence[Any]) -> dict[int, Any]:
        """Return the outputs of a C function by the numbers of the arguments.

        The result has the number -1.
        """


@dataclass(frozen=True, slots=True)
class ExternalCode:
    """Annotations of an external function."""

    #: C code that declares or defines the C function
    include: str
    #: folder of the headers, as a URI or a path relative to the file of the function
    include_directory: str
    libraries: tuple[str, ...]
    #: folder of the libraries
    library_directory: str
    #: C function that deletes the object which the function constructs, or ""
    destructor: str = ""
    #: evaluation of the function in Python
    library: CallableLibrary | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the model."""

    name: str
    inputs: tuple[FunctionVariable, ...]
    outputs: tuple[FunctionVariable, ...]
    locals: tuple[FunctionVariable, ...]
    body: Body
    where: SourceLocation | None = field(default=None, compare=False)
    #: annotations of an external function, whose body is one `ExternalCall`
    external: ExternalCode | None = None


#: beginning of the names of variables that are arguments of clocked sample() operators and can jump
SAMPLED = "$sampled "


@dataclass(frozen=True, slots=True)
class Relation:
    """A comparison that changes between events.

    `name` is the Boolean variable that holds its value until the next event.
    """

    name: str
    condition: Binary


@dataclass(frozen=True, slots=True)
class Delay:
    """A `delay(x, duration)`; `name` is the variable that is equal to x."""

    name: str
    duration: Expression


@dataclass(frozen=True, slots=True)
class Hybrid:
    """Parts of a model with event iteration."""

    relations: tuple[Relation, ...]
    delays: tuple[Delay, ...]
    #: variables with a variable for their value before the event
    remembered: tuple[str, ...]
    #: variables of `remembered` whose change in an event requires another evaluation
    iterated: tuple[str, ...]
    #: variables of `remembered` whose stored value is the one before the first of several events at
    #: the same time
    sampled: tuple[str, ...] = ()


#: sections of a model that are evaluated at events
EVENT_SECTIONS = ("equations", "whens", "algorithms", "asserts")
SECTIONS = (*EVENT_SECTIONS, "initial_equations", "initial_algorithms")


@dataclass(frozen=True)
class Model:
    """A flat model."""

    name: str
    description: str
    variables: Mapping[str, Variable]
    equations: tuple[Equation, ...]
    #: when-clauses of equation sections; those of algorithms are statements of `algorithms`
    whens: tuple[When, ...]
    algorithms: tuple[Body, ...]
    asserts: tuple[Assert, ...]
    initial_equations: tuple[Equation, ...]
    initial_algorithms: tuple[Body, ...]
    functions: Mapping[str, Function]
    #: enumeration type -> literals
    enumerations: Mapping[str, tuple[str, ...]]
    #: parameters whose values determine array sizes, loop ranges or the choice of equations
    structural: frozenset[str]
    #: continuous states (see `causality/continuous_states.py`)
    states: tuple[str, ...] = ()
    #: true if the model uses a library that is not part of its own sources
    uses_library: bool = False
    #: variables that are only computed at the initialization
    initialized: frozenset[str] = frozenset()
    #: None for a model whose equations are evaluated once per event (see `causality/hybrid.py`)
    hybrid: Hybrid | None = None


def is_integrated(model: Model) -> bool:
    """Return whether a model with event iteration has states or relations."""
    return model.hybrid is not None and bool(model.states or model.hybrid.relations)


def is_continuous(variable: Variable) -> bool:
    """Return whether a variable is a Real that can change between events."""
    return variable.type == "Real" and variable.variability == "continuous"


def given_variables(model: Model) -> set[str]:
    """Return the constants, parameters and inputs, which no equation determines."""
    return {
        v.name
        for v in model.variables.values()
        if v.variability in ("constant", "parameter") or is_input(v)
    }


def internal_variable(variable: Variable, name: str) -> Variable:
    """Return the declaration of an inserted variable, with type and shape of another one."""
    return replace(
        variable,
        name=name,
        causality="local",
        start=None,
        binding=None,
        fixed=None,
        final=False,
        protected=True,
        top_level=False,
        unit="",
        quantity="",
        description="",
        minimum=None,
        maximum=None,
    )


def derivative_name(state: str) -> str:
    """Return the name of the variable that holds the derivative of a state."""
    return f"der({state})"


def previous_name(variable: str) -> str:
    """Return the name of the variable with the value of a variable before the event."""
    return f"pre({variable})"


def owning_component(name: str) -> str:
    """Return the component that a variable belongs to, or "" for the model itself."""
    return name.removeprefix("der(").removeprefix("pre(").rpartition(".")[0]


def is_input(variable: Variable) -> bool:
    """Return whether a variable is an input of the model itself.

    Neither one of a component nor a protected connector.
    """
    return variable.causality == "input" and variable.top_level and not variable.protected
