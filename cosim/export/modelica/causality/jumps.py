"""Search for variables whose value can jump at an event, because it depends on discrete variables or on comparisons."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ..model.flat_model import Model
from ..model.syntax_tree import Builtin, Expression, If, referenced_variable
from ..model.traversal import PRE_OPERATORS, assigned_references, has_builtin, variable_names, walk
from .clock_inference import CLOCKED_OPERATORS
from .matching import is_input

_JUMPING = (
    *CLOCKED_OPERATORS,
    *PRE_OPERATORS,
    "sample",
    "initial",
    "delay",
    "floor",
    "ceil",
    "integer",
    "div",
    "mod",
    "rem",
    "sign",
)


class JumpSearch:
    """Dependences of the variables of a model, through all equations that contain them.

    States, inputs and parameters depend on nothing here.
    """

    def __init__(self, model: Model):
        self._model = model
        calls = (
            item
            for item in walk(model.equations)
            if isinstance(item, Builtin) and item.name == "der"
        )
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
        self._assigned = {
            referenced_variable(target)
            for target in assigned_references((model.whens, model.algorithms))
        }
        self._equations: dict[str, list[Any]] = {}
        for equation in model.equations:
            for name in variable_names(equation):
                self._equations.setdefault(name, []).append(equation)

    def may_jump(self, expression: Expression) -> bool:
        """Return whether the value of an expression can jump at an event that is not a change of an input."""
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
        names = variable_names(tree) - self._ends
        discrete = any(
            name in self._assigned or _is_discrete(name, self._model.variables) for name in names
        )
        return (
            discrete
            or has_builtin(tree, *_JUMPING)
            or any(isinstance(item, If) for item in walk(tree))
        )


def _is_discrete(name: str, variables: Mapping[str, Any]) -> bool:
    return name in variables and (
        variables[name].type != "Real" or variables[name].variability != "continuous"
    )
