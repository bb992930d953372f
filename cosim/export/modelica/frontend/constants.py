"""Replacement of scalar constants by literals, so that they can determine array sizes, slices and loop ranges."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..model.evaluate import Evaluator
from ..model.flat_model import Model, Variable
from ..model.syntax_tree import Literal, Name
from ..model.traversal import rewrite, variable_names


def inline_constants(model: Model) -> Model:
    """Return the model with its scalar constants replaced by their values."""
    constants = {v.name: v for v in model.variables.values() if v.variability == "constant" and not v.shape}
    literals: dict[str, Literal] = {}
    while ready := [v for v in constants.values() if v.name not in literals and variable_names(v.binding) <= set(literals)]:
        evaluate = Evaluator(model.functions, {name: literal.value for name, literal in literals.items()})
        literals |= {v.name: Literal(evaluate(v.binding or Literal(0, v.type)), v.type) for v in ready}

    def replace_constant(node: Any) -> Any:
        return literals.get(node.name, node) if isinstance(node, Name) else node

    def inline_in_variable(variable: Variable) -> Variable:
        expressions = ("start", "binding", "minimum", "maximum")
        return replace(variable, **{key: rewrite(getattr(variable, key), replace_constant) for key in expressions})

    sections = ("equations", "whens", "algorithms", "asserts", "initial_equations", "initial_algorithms")
    return replace(
        model,
        variables={name: inline_in_variable(variable) for name, variable in model.variables.items() if name not in literals},
        **{section: rewrite(getattr(model, section), replace_constant) for section in sections},
    )
