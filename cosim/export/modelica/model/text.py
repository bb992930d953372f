"""Modelica text of expressions, for messages."""

from __future__ import annotations

from . import syntax_tree
from .syntax_tree import Colon, Expression


def to_text(node: Expression | Colon) -> str:
    """Return an expression as Modelica text.

    Operands that are operations themselves are in parentheses.
    """
    if isinstance(node, syntax_tree.Literal):
        return str(node.value).lower() if isinstance(node.value, bool) else str(node.value)
    if isinstance(node, syntax_tree.Name):
        return node.name
    if isinstance(node, syntax_tree.Index):
        return f"{to_text(node.base)}[{', '.join(map(to_text, node.subscripts))}]"
    if isinstance(node, syntax_tree.Binary):
        return f"{_operand(node.left)} {node.operator} {_operand(node.right)}"
    if isinstance(node, syntax_tree.Unary):
        return f"{node.operator}{' ' * (node.operator == 'not')}{_operand(node.operand)}"
    if isinstance(node, syntax_tree.Builtin):
        return f"{node.name}({', '.join(map(to_text, node.arguments))})"
    if isinstance(node, syntax_tree.Call):
        return f"{node.function}({', '.join(map(to_text, node.arguments))})"
    if isinstance(node, syntax_tree.Array):
        return f"{{{', '.join(map(to_text, node.elements))}}}"
    return ":" if isinstance(node, Colon) else "..."


def _operand(node: Expression) -> str:
    return f"({to_text(node)})" if isinstance(node, syntax_tree.Binary) else to_text(node)
