"""Construction of scalar expressions without terms and factors that are zero or one."""

from .syntax_tree import Binary, Expression, Literal, Unary
from .traversal import rewrite

ZERO, ONE = Literal(0.0, "Real"), Literal(1.0, "Real")


def add(a: Expression, b: Expression) -> Expression:
    """Return a + b, without terms that are zero."""
    if a == ZERO:
        return b
    return a if b == ZERO else Binary("+", a, b)


def subtract(a: Expression, b: Expression) -> Expression:
    """Return a - b, without terms that are zero."""
    if b == ZERO:
        return a
    return negate(b) if a == ZERO else Binary("-", a, b)


def multiply(a: Expression, b: Expression) -> Expression:
    """Return a * b, simplified if one factor is zero or one."""
    if ZERO in (a, b):
        return ZERO
    if a == ONE:
        return b
    return a if b == ONE else Binary("*", a, b)


def divide(a: Expression, b: Expression) -> Expression:
    """Return a / b, simplified if a is zero or b is one."""
    if a == ZERO:
        return ZERO
    return a if b == ONE else Binary("/", a, b)


def negate(a: Expression) -> Expression:
    """Return -a."""
    if isinstance(a, Literal) and a.type == "Real":
        return Literal(-a.number if a.number else 0.0, "Real")
    return a.operand if isinstance(a, Unary) and a.operator == "-" else Unary("-", a)


def square(x: Expression) -> Expression:
    """Return x^2."""
    return Binary("^", x, Literal(2, "Integer"))


_OPERATIONS = {"+": add, "-": subtract, "*": multiply, "/": divide}


def without_zeros(node: Expression) -> Expression:
    """Return an expression without terms and factors that are zero.

    A division by zero remains.
    """

    def simplify(item: object) -> object:
        if isinstance(item, Unary) and item.operand == ZERO:
            return negate(item.operand)
        if not (isinstance(item, Binary) and ZERO in (item.left, item.right)):
            return item
        operation = _OPERATIONS.get(item.operator.removeprefix("."))
        if operation is None or (item.operator == "/" and item.right == ZERO):
            return item
        return operation(item.left, item.right)

    result: Expression = rewrite(node, simplify)
    return result
