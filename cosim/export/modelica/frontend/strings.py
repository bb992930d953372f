"""Evaluation of Strings when a model is translated.

The FMU contains them as literals in calls of functions only.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from ..model.evaluate import Evaluator
from ..model.flat_model import Model
from ..model.syntax_tree import Call, Expression, Literal
from ..model.traversal import rewrite, variable_names, walk


def string_parameters(model: Model) -> set[str]:
    """Return the parameters of type String, and those that determine the String arguments of a function."""
    found = {
        v.name
        for v in model.variables.values()
        if v.type == "String" and v.variability == "parameter"
    }
    for call in walk(_expressions(model)):
        if isinstance(call, Call):
            found |= variable_names(
                tuple(a for a, local in _inputs(call, model) if local.type == "String")
            )
    return {
        name
        for name in found
        if name in model.variables and model.variables[name].variability == "parameter"
    }


def fold_strings(model: Model) -> Model:
    """Return the model with its String arguments as literals, and without the parameters and constants of type String.

    Raises:
        EvaluationError: A String cannot be evaluated.
    """

    def fold(node: Any) -> Any:
        if not isinstance(node, Call):
            return node
        pairs = _inputs(node, model)
        return replace(
            node,
            arguments=tuple(
                _literal(a, model) if local.type == "String" else a for a, local in pairs
            ),
        )

    fixed = ("parameter", "constant")
    variables = {
        name: v
        for name, v in model.variables.items()
        if v.type != "String" or v.variability not in fixed
    }
    return replace(
        model,
        variables={
            name: replace(v, binding=rewrite(v.binding, fold), start=rewrite(v.start, fold))
            for name, v in variables.items()
        },
        equations=rewrite(model.equations, fold),
        algorithms=rewrite(model.algorithms, fold),
        whens=rewrite(model.whens, fold),
    )


def _expressions(model: Model) -> tuple[Any, ...]:
    bindings = tuple((v.binding, v.start) for v in model.variables.values())
    return (bindings, model.equations, model.algorithms, model.whens)


def _inputs(call: Call, model: Model) -> list[tuple[Expression, Any]]:
    """Return the arguments of a call with the inputs of the function."""
    function = model.functions.get(call.function)
    return list(zip(call.arguments, function.inputs, strict=True)) if function else []


def _literal(node: Expression, model: Model) -> Expression:
    if isinstance(node, Literal) or variable_names(node):
        return node
    return Literal(Evaluator(model.functions, {})(node), "String")
