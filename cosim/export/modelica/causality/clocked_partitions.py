"""Replacement of clocked equations by equations and when-clauses with `sample(start, period)`.

All variables of a clocked partition keep their values between ticks if the values from other
partitions and from the previous tick do. Therefore only these become variables that a when-clause
sets at a tick; the clocked equations remain equations.
"""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

from ..model.builtin_functions import CLOCKED_OPERATORS, PRE_OPERATORS, ROUNDINGS
from ..model.flat_model import (
    EVENT_SECTIONS,
    SAMPLED,
    Equation,
    Model,
    Variable,
    internal_variable,
    is_continuous,
    is_input,
)
from ..model.syntax_tree import (
    Array,
    Assign,
    Binary,
    Builtin,
    Colon,
    Expression,
    If,
    Index,
    Literal,
    Name,
    Range,
    SourceLocation,
    When,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import (
    assigned_names,
    has_builtin,
    is_call,
    variable_names,
    walk,
)
from .clock_inference import (
    ClockInference,
    Rate,
    event_sections,
    is_clock,
    is_clocked_when,
    is_sampler,
    samplers,
)


def resolve_clocks(model: Model) -> Model:
    """Return the model without clocks.

    Args:
        model: The flat model with its structural parameters as literals.

    Raises:
        InputError: A clock is not determined, contradictory or not supported.
    """
    sections = event_sections(model)
    if (
        not has_builtin(sections, *CLOCKED_OPERATORS)
        and next(samplers(sections, model), None) is None
    ):
        return model
    return _Replacement(model).model()


class _Replacement:
    """Translation of the clocked operators of a model."""

    def __init__(self, model: Model):
        self._model = model
        self._clocks = ClockInference(model)
        self._variables: dict[str, Variable] = {
            name: replace(v, variability="discrete", fixed=None) if self._clocks.rate(name) else v
            for name, v in model.variables.items()
            if v.type != "Clock"
        }
        self._bodies: dict[tuple[Rate, bool], list[Assign]] = {}
        self._held: dict[tuple[Rate, Expression], Name] = {}
        self._previous_values: dict[tuple[Rate, str], Name] = {}
        self._ticks: dict[Rate, Name] = {}
        self._jumps = JumpSearch(model)
        self._limits: list[Equation] = []
        sections = event_sections(model)
        #: true if a sampled value can depend on a held one, so that held values have their start
        #: values at the initialization
        self._has_limits = any(
            self._jumps.may_jump(call.arguments[0]) for call in samplers(sections, model)
        )

    def model(self) -> Model:
        """Return the translated model."""
        changed: dict[str, list[Any]] = {section: [] for section in EVENT_SECTIONS}
        for node, item in self._clocks.items():
            if isinstance(item, Equation) and (
                is_clock(item.left, self._model) or is_clock(item.right, self._model)
            ):
                continue
            changed[node.partition(" ")[0]].append(self._translate(node, item))
        whens = [
            When(((self._condition(*key), tuple(body)),)) for key, body in self._bodies.items()
        ]
        sections: dict[str, Any] = {section: tuple(items) for section, items in changed.items()}
        sections["whens"] += tuple(whens)
        sections["equations"] += tuple(self._limits)
        return replace(self._model, variables=self._variables, **sections)

    def _translate(self, node: str, tree: Any) -> Any:
        """Return the tree of a node without clocked operators."""
        if isinstance(tree, tuple) and not isinstance(tree, SourceLocation):
            return tuple(self._translate(node, item) for item in tree)
        if isinstance(tree, Builtin) and (
            tree.name in CLOCKED_OPERATORS or is_sampler(tree, self._model)
        ):
            return self._operator(node, tree)
        if is_clocked_when(tree, self._model):
            return When(
                (
                    (
                        self._condition(self._rate(node), True),
                        self._translate(node, tree.branches[0][1]),
                    ),
                ),
                tree.where,
            )
        if not is_dataclass(tree) or isinstance(tree, type):
            return tree
        return replace(
            tree,
            **{
                field.name: self._translate(node, getattr(tree, field.name))
                for field in fields(tree)
            },
        )

    def _rate(self, node: str) -> Rate:
        rate = self._clocks.rate(node)
        assert rate is not None, "the inference determines the clock of each operator"
        return rate

    def _operator(self, node: str, call: Builtin) -> Expression:
        if call.name == "interval":
            period = self._rate(node).period
            return (
                Literal(float(period), "Real")
                if period
                else raise_model_error("the clock has no fixed interval", call.where)
            )
        if call.name == "firstTick":
            return Binary("<=", self._count(self._rate(node)), Literal(1, "Integer"))
        if call.name == "previous":
            return self._previous(self._rate(node), call.arguments[0], call)
        inner = self._clocks.argument(call)
        value: Expression = self._translate(inner, call.arguments[0])
        if call.name in ("noClock", "superSample"):
            return value
        limited = call.name == "sample" and self._jumps.may_jump(call.arguments[0])
        if limited:
            template = self._template(value, call)
            sampled = self._declare(f"{SAMPLED}{len(self._limits)}", template, with_start=False)
            self._variables[sampled.name] = replace(
                self._variables[sampled.name], variability=template.variability
            )
            limit = self._declare(f"$limit {len(self._limits)}", template, with_start=False)
            before = Builtin("pre", (sampled,), call.where)
            self._limits += [
                Equation(sampled, value, call.where),
                Equation(limit, before, call.where),
            ]
            value = limit
        if call.name == "hold":
            return self._hold(
                self._rate(inner), value, call, with_start=True, at_start=not self._has_limits
            )
        if call.name == "backSample":  # the start value until the first tick of the argument
            value = self._hold(self._rate(inner), value, call, with_start=True)
        return self._hold(
            self._rate(node), value, call, with_start=call.name != "sample", at_start=not limited
        )

    def _condition(self, rate: Rate, at_start: bool) -> Expression:
        """Return the condition of a when-clause at the ticks of a clock, `at_start`.

        Also at the initialization.
        """
        # a clock with a condition that depends on its own ticks acts in the next evaluation of the
        # event
        if rate.condition:
            return (
                Builtin("pre", (rate.condition,))
                if self._jumps.is_held(rate.condition)
                else rate.condition
            )
        tick = Builtin(
            "sample", (Literal(float(rate.offset), "Real"), Literal(float(rate.period), "Real"))
        )
        return Array((Builtin("initial", ()), tick)) if at_start and rate.offset == 0 else tick

    def _hold(
        self, rate: Rate, value: Expression, call: Builtin, with_start: bool, at_start: bool = True
    ) -> Name:
        """Return the variable with the value at the last tick.

        `at_start`: the initialization sets it, too.
        """
        if (rate, value) not in self._held:
            template = self._template(value, call)
            name = self._declare(f"$clocked {len(self._held) + 1}", template, with_start)
            self._held[rate, value] = name
            self._bodies.setdefault((rate, at_start), []).append(Assign(name, value, call.where))
        return self._held[rate, value]

    def _previous(self, rate: Rate, argument: Expression, call: Builtin) -> Expression:
        """Return the value of a variable at the previous tick, before that its start value."""
        if not isinstance(argument, Name | Index):
            raise_model_error(f"{call.name}() takes a variable", call.where)
        name = referenced_variable(argument)
        if (rate, name) not in self._previous_values:
            previous = self._declare(f"$previous {name}", self._variables[name], with_start=True)
            self._previous_values[rate, name] = previous
            is_first = Binary("<=", self._count(rate), Literal(1, "Integer"))
            value = If(((is_first, Builtin("pre", (previous,))),), Builtin("pre", (Name(name),)))
            self._bodies.setdefault((rate, True), []).append(Assign(previous, value, call.where))
        base = self._previous_values[rate, name]
        return base if isinstance(argument, Name) else replace(argument, base=base)

    def _count(self, rate: Rate) -> Name:
        """Return the variable with the number of ticks, at most 2."""
        if rate not in self._ticks:
            template = replace(self._real(), type="Integer", variability="discrete")
            ticks = self._ticks[rate] = self._declare(
                f"$ticks {len(self._ticks) + 1}", template, with_start=False
            )
            number = Binary("+", Builtin("pre", (ticks,)), Literal(1, "Integer"))
            body = Assign(ticks, Builtin("min", (number, Literal(2, "Integer"))))
            self._bodies.setdefault((rate, False), []).append(body)
        return self._ticks[rate]

    def _declare(self, name: str, template: Variable, with_start: bool) -> Name:
        variable = internal_variable(template, name)
        self._variables[name] = replace(
            variable, variability="discrete", start=template.start if with_start else None
        )
        return Name(name)

    def _template(self, value: Expression, call: Builtin) -> Variable:
        """Return a variable with the type and shape of an expression."""
        if isinstance(value, Name) and value.name in self._variables:
            return self._variables[value.name]
        if isinstance(value, Index):
            if any(
                isinstance(each, Colon | Range) or variable_names(each) for each in value.subscripts
            ):
                raise_model_error(
                    f"{call.name}() takes a variable or an element of an array", call.where
                )
            return replace(self._variables[referenced_variable(value)], shape=(), start=None)
        return self._real()

    def _real(self) -> Variable:
        template = next(iter(self._model.variables.values()))
        return replace(
            internal_variable(template, ""),
            type="Real",
            shape=(),
            enumeration="",
            variability="continuous",
        )


_JUMPING = (
    *CLOCKED_OPERATORS,
    *PRE_OPERATORS,
    *ROUNDINGS,
    "sample",
    "initial",
    "delay",
    "sign",
)


class JumpSearch:
    """Dependences of the variables of a model, through all equations that contain them.

    States, inputs and parameters depend on nothing here.
    """

    def __init__(self, model: Model):
        self._model = model
        calls = (item for item in walk(model.equations) if is_call(item, "der"))
        ends = {
            referenced_variable(call.arguments[0])
            for call in calls
            if variable_names(call.arguments)
        }
        ends |= {
            v.name
            for v in model.variables.values()
            if is_input(v) or v.variability in ("parameter", "constant")
        }
        self._ends = ends
        self._assigned = assigned_names((model.whens, model.algorithms))
        self._equations: dict[str, list[Any]] = {}
        for equation in model.equations:
            for name in variable_names(equation):
                self._equations.setdefault(name, []).append(equation)

    def may_jump(self, expression: Expression) -> bool:
        """Return whether an expression can jump at an event other than a change of an input."""
        return any(self._jumps(tree) for tree in self._dependences(expression))

    def is_held(self, expression: Expression) -> bool:
        """Return whether an expression depends on a value that `hold()` keeps."""
        return any(has_builtin(tree, "hold") for tree in self._dependences(expression))

    def _dependences(self, expression: Expression) -> Iterator[Any]:
        """Yield the expression, and all equations that contain variables on which it depends."""
        pending, seen = [expression], set(self._ends)
        while pending:
            tree = pending.pop()
            yield tree
            for name in variable_names(tree) - seen:
                seen.add(name)
                pending += self._equations.get(name, ())

    def _jumps(self, tree: Any) -> bool:
        variables = self._model.variables
        for name in variable_names(tree) - self._ends:
            if name in self._assigned or (name in variables and not is_continuous(variables[name])):
                return True
        return has_builtin(tree, *_JUMPING) or any(isinstance(item, If) for item in walk(tree))
