"""Preparation of models with event iteration.

A model needs it if `pre()` or `sample()` occurs outside when-clauses, or if it has `reinit()`,
`delay()`, or comparisons between values that change while the states are integrated, or if it uses
a library and has states or when-clauses whose conditions change with time, or if an initial
equation determines `pre()` of a variable that equations determine. In such a model

- `pre(x)` becomes a variable with this name, which holds the value of x before the current
  evaluation of the equations;
- a comparison becomes a Boolean variable, which keeps its value between events; its change is an
  event;
- a value that floor(), ceil(), integer(), div(), mod() or rem() rounds becomes a variable, which a
  when-clause changes;
- the argument of `delay()` becomes a variable, whose past values are stored.

In an event all equations are evaluated with the values before it, then with the results in place of
these, until no discrete variable changes (event iteration, Modelica Language Specification 3.6,
section 8.6 and appendix B; Otter, Elmqvist and Mattsson, Hybrid modeling in Modelica based on the
synchronous data flow principle, 1999). Between events comparisons keep their values, so that the
integration sees smooth equations; a crossing of their operands is located and is the next event.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

from ..model.builtin_functions import PRE_OPERATORS, ROUNDINGS
from ..model.flat_model import (
    SAMPLED,
    SECTIONS,
    Delay,
    Equation,
    Hybrid,
    Model,
    Relation,
    Variable,
    internal_variable,
    is_continuous,
    is_input,
    previous_name,
)
from ..model.syntax_tree import (
    Array,
    Assign,
    Binary,
    Body,
    Builtin,
    Expression,
    If,
    Index,
    Literal,
    Name,
    Reinit,
    Unary,
    When,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import (
    assigned_names,
    has_builtin,
    is_call,
    rewrite,
    rewrite_outermost,
    to_text,
    variable_names,
    walk,
)

_COMPARISONS = ("<", "<=", ">", ">=")


def prepare_hybrid(model: Model) -> Model:
    """Return the model prepared for event iteration, or the model itself if it does not need it."""
    preparation = _Preparation(model)
    return preparation.prepare() if preparation.is_needed() else model


class _Preparation:
    def __init__(self, model: Model):
        self._model = model
        self._assigned = assigned_names((model.whens, model.algorithms))
        self._discrete = self._assigned | model.initialized
        self._discrete |= {v.name for v in model.variables.values() if not is_continuous(v)}
        self._variables: dict[str, Variable] = dict(model.variables)
        self._relations: list[Relation] = []
        self._delays: list[Delay] = []
        self._equations: list[Equation] = []
        self._rounded: dict[Expression, Name] = {}
        self._whens: list[When] = []

    def is_needed(self) -> bool:
        """Return whether the model has elements that require event iteration."""
        statements = chain.from_iterable(self._model.algorithms)
        outside = tuple(each for each in statements if not isinstance(each, When))
        clauses = list(walk((self._model.whens, self._model.algorithms)))
        conditions: tuple[Expression, ...] = ()
        for item in clauses:
            if isinstance(item, When):
                conditions += tuple(condition for condition, _ in item.branches)
        if has_builtin(
            (self._model.equations, outside, self._model.asserts), *PRE_OPERATORS, "sample", "delay"
        ):
            return True
        if has_builtin(conditions, *PRE_OPERATORS) or any(map(_is_combined_sample, conditions)):
            return True
        if any(isinstance(item, Reinit) for item in clauses):
            return True
        if _remembered(self._model.initial_equations) - self._assigned:
            return True
        if self._model.uses_library and (
            self._model.states or any(self._is_relation(item) for item in walk(conditions))
        ):
            return True
        comparisons = rewrite_outermost((self._model.equations, conditions), _without_events)
        return bool(self._model.states) and any(
            self._is_relation(item) or self._is_rounding(item) for item in walk(comparisons)
        )

    def prepare(self) -> Model:
        model = self._model
        sections = {name: rewrite(getattr(model, name), self._replace_delay) for name in SECTIONS}
        if model.states or "time" in variable_names((model.equations, model.whens)):
            sections["equations"] = rewrite_outermost(sections["equations"], self._replace_rounding)
            sections["whens"] = self._in_conditions(sections["whens"], self._replace_rounding)
            sections["equations"] = rewrite_outermost(sections["equations"], self._replace_relation)
            sections["whens"] = self._in_conditions(
                (*sections["whens"], *self._whens), self._replace_relation
            )
            sections["algorithms"] = tuple(map(self._in_algorithm, sections["algorithms"]))
        sections["equations"] = (*sections["equations"], *self._equations)
        used = _remembered(tuple(sections.values()))
        used |= {relation.name for relation in self._relations} | {
            v.name for v in self._variables.values() if is_input(v)
        }
        sections = {name: rewrite(section, self._replace_pre) for name, section in sections.items()}
        reinitialized = {
            item.name for item in walk((model.whens, model.algorithms)) if isinstance(item, Reinit)
        }
        remembered = tuple(
            n
            for n, v in self._variables.items()
            if n in used | reinitialized and v.variability not in ("constant", "parameter")
        )
        for name in remembered:
            variable = self._variables[name]
            internal = internal_variable(variable, previous_name(name))
            self._variables[internal.name] = replace(
                internal, variability="discrete", start=variable.start
            )
        sampled = tuple(n for n in remembered if n.startswith(SAMPLED))
        excluded = {*sampled, *(n for n in remembered if is_input(self._variables[n]))}
        iterated = tuple(
            n for n in remembered if n in self._discrete | reinitialized and n not in excluded
        )
        relations = tuple(
            Relation(r.name, rewrite(r.condition, self._replace_pre)) for r in self._relations
        )
        hybrid = Hybrid(relations, tuple(self._delays), remembered, iterated, sampled)
        return replace(model, variables=self._variables, hybrid=hybrid, **sections)

    # comparisons

    def _is_relation(self, node: Any) -> bool:
        """Return whether a node is a comparison of values that change between events."""
        if not (isinstance(node, Binary) and node.operator in _COMPARISONS):
            return False
        return self._changes_between_events((node.left, node.right))

    def _changes_between_events(self, node: Any) -> bool:
        return any(
            name == "time" or (name in self._variables and name not in self._discrete)
            for name in variable_names(node)
        )

    @staticmethod
    def _in_conditions(
        whens: tuple[When, ...], replacement: Callable[[Any], Any]
    ) -> tuple[When, ...]:
        """Return when-clauses with conditions in which nodes are replaced."""
        changed = []
        for when in whens:
            branches = [(rewrite_outermost(c, replacement), body) for c, body in when.branches]
            changed.append(replace(when, branches=tuple(branches)))
        return tuple(changed)

    def _in_algorithm(self, body: Body) -> Body:
        """Return an algorithm whose when-clauses have located conditions.

        Comparisons of variables that the algorithm itself assigns remain.
        """
        assigned = assigned_names(body)

        def change(node: Any) -> Any:
            return node if variable_names(node) & assigned else self._replace_relation(node)

        return tuple(
            self._in_conditions((s,), change)[0] if isinstance(s, When) else s for s in body
        )

    def _replace_relation(self, node: Any) -> Any:
        if _without_events(node) is not None:
            return node
        if not self._is_relation(node):
            return None
        for relation in self._relations:
            if relation.condition == node:
                return Name(relation.name, node.where)
        name = f"$relation {len(self._relations) + 1}"
        self._add_variable(name, "Boolean", node)
        self._relations.append(Relation(name, node))
        return Name(name, node.where)

    def _add_variable(self, name: str, type_name: str, value: Expression) -> None:
        self._declare(name, type_name, is_discrete=type_name == "Boolean")
        self._equations.append(Equation(Name(name), value, getattr(value, "where", None)))

    def _declare(self, name: str, type_name: str, is_discrete: bool) -> None:
        template = next(iter(self._model.variables.values()))
        variable = replace(
            internal_variable(template, name),
            type=type_name,
            shape=(),
            variability="discrete" if is_discrete else "continuous",
        )
        self._variables[name] = variable

    # rounding

    def _is_rounding(self, node: Any) -> bool:
        """Return whether a node rounds a value that changes between events."""
        return is_call(node, *ROUNDINGS) and self._changes_between_events(node.arguments)

    def _replace_rounding(self, node: Any) -> Any:
        if _without_events(node) is not None:
            return node
        if not self._is_rounding(node):
            return None
        first, *others = rewrite_outermost(node.arguments, self._replace_rounding)
        if node.name in ("floor", "integer"):
            value = self._floor(first, node)
            return value if node.name == "floor" else replace(node, arguments=(value,))
        if node.name == "ceil":
            return Unary("-", self._floor(Unary("-", first), node))
        (divisor,) = others
        quotient = Binary("/", first, divisor, node.where)
        whole: Expression = self._floor(quotient, node)
        if node.name != "mod":
            positive = Binary(">=", quotient, Literal(0.0, "Real"), node.where)
            whole = If(((positive, whole),), Unary("-", self._floor(Unary("-", quotient), node)))
        return (
            whole
            if node.name == "div"
            else Binary("-", first, Binary("*", whole, divisor, node.where), node.where)
        )

    def _floor(self, value: Expression, call: Builtin) -> Name:
        """Return the variable with the largest whole number that is not greater than a value."""
        if value in self._rounded:
            return self._rounded[value]
        rounded = self._rounded[value] = Name(f"$rounded {len(self._rounded) + 1}", call.where)
        self._declare(rounded.name, "Real", is_discrete=True)
        self._discrete.add(rounded.name)
        before = Builtin("pre", (rounded,), call.where)
        above = Binary(">=", value, Binary("+", before, Literal(1.0, "Real")), call.where)
        below = Binary("<", value, before, call.where)
        body = (Assign(rounded, Builtin("floor", (value,), call.where), call.where),)
        self._whens.append(
            When(((Array((Builtin("initial", ()), above, below)), body),), call.where)
        )
        return rounded

    # delay() and pre()

    def _replace_delay(self, node: Any) -> Any:
        if not (is_call(node, "delay")):
            return node
        name = f"$delayed {len(self._delays) + 1}"
        self._add_variable(name, "Real", node.arguments[0])
        self._delays.append(Delay(name, node.arguments[1]))
        return Builtin(
            "past", (Literal(len(self._delays) - 1, "Integer"), node.arguments[1]), node.where
        )

    def _replace_pre(self, node: Any) -> Any:
        if not (is_call(node, *PRE_OPERATORS)):
            return node
        (argument,) = node.arguments
        previous = self._previous(argument, node)
        if node.name == "pre":
            return previous
        return (
            Binary("and", argument, Unary("not", previous))
            if node.name == "edge"
            else Binary("<>", argument, previous)
        )

    def _previous(self, argument: Expression, call: Builtin) -> Expression:
        if isinstance(argument, Literal):
            return argument
        if not isinstance(argument, Name | Index):
            raise_model_error(f"{call.name}() takes a variable", call.where)
        name = referenced_variable(argument)
        variable = self._variables.get(name)
        if variable is None or variable.variability in ("constant", "parameter"):
            return argument
        previous = Name(previous_name(name), call.where)
        return previous if isinstance(argument, Name) else replace(argument, base=previous)


def delay_number(past: Builtin) -> int:
    """Return the number of the delay() that a call of past() belongs to."""
    (number, _) = past.arguments
    assert isinstance(number, Literal)
    return int(number.number)


def _without_events(node: Any) -> Any:
    """Return the node itself if comparisons in it are no events, else None."""
    if isinstance(node, Builtin) and (
        node.name == "noEvent"
        or (node.name == "smooth" and node.arguments[0] != Literal(0, "Integer"))
    ):
        return Literal(True, "Boolean")
    return None


def _is_combined_sample(condition: Expression) -> bool:
    alternatives = getattr(condition, "elements", (condition,))
    return any(has_builtin(c, "sample") and not (is_call(c, "sample")) for c in alternatives)


def _remembered(section: Any) -> set[str]:
    calls = (item for item in walk(section) if is_call(item, *PRE_OPERATORS))
    return {
        referenced_variable(call.arguments[0])
        for call in calls
        if isinstance(call.arguments[0], Name | Index)
    }


#: evaluations of the equations in an event, and events in a communication step
MAX_PASSES, MAX_EVENTS = 100, 100_000
#: events at a distance (s) up to this one are at the same time for clocked sample() operators
SAME_TIME = 1e-9
#: number of stored values of the argument of a delay()
PAST_VALUES = 2048


def iterated_names(hybrid: Hybrid) -> Sequence[str]:
    """Return the variables that can require another evaluation in an event."""
    return list(
        dict.fromkeys((*hybrid.iterated, *(relation.name for relation in hybrid.relations)))
    )


def endless_reason(hybrid: Hybrid, name: str) -> str:
    """Return the message of an event iteration in which a variable changes again and again."""
    condition = next(
        (to_text(relation.condition) for relation in hybrid.relations if relation.name == name),
        name,
    )
    return f"the event iteration does not end: {condition} changes in each evaluation"


def chattering_reason(relation: Relation) -> str:
    """Return the message of too many events in a step, the last one by this relation."""
    return (
        f"too many events in one step (chattering): {to_text(relation.condition)} changes again "
        "and again"
    )
