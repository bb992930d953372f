"""C code of a CasADi function: one line for each operation, in single assignment form.

CasADi's own generator emits a large interface beside the function; here only the function is wanted, so that the C code is
readable, compiles without warnings and depends on nothing but the C mathematical library.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import casadi as ca

_OPERATIONS = {
    ca.OP_ASSIGN: "{}",
    ca.OP_ADD: "{} + {}",
    ca.OP_SUB: "{} - {}",
    ca.OP_MUL: "{} * {}",
    ca.OP_DIV: "{} / {}",
    ca.OP_NEG: "-{}",
    ca.OP_INV: "1.0 / {}",
    ca.OP_TWICE: "2.0 * {}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_SQRT: "sqrt({})",
    ca.OP_POW: "pow({}, {})",
    ca.OP_CONSTPOW: "pow({}, {})",
    ca.OP_EXP: "exp({})",
    ca.OP_LOG: "log({})",
    ca.OP_SIN: "sin({})",
    ca.OP_COS: "cos({})",
    ca.OP_TAN: "tan({})",
    ca.OP_ASIN: "asin({})",
    ca.OP_ACOS: "acos({})",
    ca.OP_ATAN: "atan({})",
    ca.OP_ATAN2: "atan2({}, {})",
    ca.OP_SINH: "sinh({})",
    ca.OP_COSH: "cosh({})",
    ca.OP_TANH: "tanh({})",
    ca.OP_HYPOT: "hypot({}, {})",
    ca.OP_FABS: "fabs({})",
    ca.OP_FLOOR: "floor({})",
    ca.OP_CEIL: "ceil({})",
    ca.OP_FMOD: "fmod({}, {})",
    ca.OP_FMIN: "fmin({}, {})",
    ca.OP_FMAX: "fmax({}, {})",
    ca.OP_SIGN: "(double)({0} > 0) - (double)({0} < 0)",
    ca.OP_COPYSIGN: "copysign({}, {})",
    ca.OP_LT: "{} < {}",
    ca.OP_LE: "{} <= {}",
    ca.OP_EQ: "{} == {}",
    ca.OP_NE: "{} != {}",
    ca.OP_NOT: "!{}",
    ca.OP_AND: "{} && {}",
    ca.OP_OR: "{} || {}",
    ca.OP_IF_ELSE_ZERO: "{} != 0 ? {} : 0",
}


def c_function(function: ca.Function) -> str:
    """The body of the function: reads `in[i][j]` and writes `out[i][j]`, element j of argument and result i.

    Raises ValueError for an operation that has no counterpart in C.
    """
    arguments = [ca.SX.sym(f"a{i}", function.size_in(i)) for i in range(function.n_in())]
    results = ca.cse([ca.densify(result) for result in function.call(arguments)])
    dense = ca.Function(function.name(), arguments, results)
    return "{\n" + "".join(f"    {statement};\n" for statement in _statements(dense)) + "}\n"


def _statements(function: ca.Function) -> Iterator[str]:
    names: dict[int, str] = {}  # place in CasADi's work vector -> the variable that holds its present value
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        targets, operands = function.instruction_output(k), function.instruction_input(k)
        if operation == ca.OP_OUTPUT:
            yield f"out[{targets[0]}][{targets[1]}] = {names[operands[0]]}"
            continue
        if operation == ca.OP_INPUT:
            value = f"in[{operands[0]}][{operands[1]}]"
        elif operation == ca.OP_CONST:
            value = _literal(function.instruction_constant(k))
        else:
            value = _operation(function, operation).format(*(names[place] for place in operands))
        names[targets[0]] = f"v{k}"
        yield f"const double v{k} = {value}"


def _operation(function: ca.Function, operation: int) -> str:
    if operation not in _OPERATIONS:
        raise ValueError(f"{function.name()}: CasADi operation {operation} cannot be written in C")
    return _OPERATIONS[operation]


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(value)
