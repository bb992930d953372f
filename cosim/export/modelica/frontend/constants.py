"""Scalar constants of the model become literals, so that they can stand where a number must be known: sizes, slices, loops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..model.evaluate import Evaluator
from ..model.flat_model import Literal, Model, Name, Variable
from ..model.traversal import rewrite, variable_names


def inline_constants(model: Model) -> Model:
    """The same model without its scalar constants."""
    constants = {v.name: v for v in model.variables.values() if v.variability == "constant" and not v.shape}
    known: dict[str, Literal] = {}
    while ready := [v for v in constants.values() if v.name not in known and variable_names(v.binding) <= set(known)]:
        values = {name: literal.value for name, literal in known.items()}
        known |= {v.name: Literal(Evaluator(model.functions, values)(v.binding or Literal(0, v.type)), v.type) for v in ready}

    def literal(node: Any) -> Any:
        return known.get(node.name, node) if isinstance(node, Name) else node

    def inlined(variable: Variable) -> Variable:
        expressions = ("start", "binding", "minimum", "maximum")
        return replace(variable, **{key: rewrite(getattr(variable, key), literal) for key in expressions})

    sections = ("equations", "whens", "algorithms", "asserts", "initial_equations", "initial_algorithms")
    return replace(
        model,
        variables={name: inlined(variable) for name, variable in model.variables.items() if name not in known},
        **{section: rewrite(getattr(model, section), literal) for section in sections},
    )
