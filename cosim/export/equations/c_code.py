"""C code of a CasADi function: one line for each operation, in single assignment form.

CasADi's own generator emits a large interface beside the function; here only the function is wanted, so that the C code is
readable, compiles without warnings and depends on nothing but the C mathematical library.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

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
    # not fmin and fmax: compilers call these, and they hide what is not a number
    ca.OP_FMIN: "{0} < {1} ? {0} : {1}",
    ca.OP_FMAX: "{0} > {1} ? {0} : {1}",
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


_SIGNATURE = "void {}(const double *const in[], double *const out[])"


@dataclass(frozen=True)
class Callee:
    """A function that expressions call, with its body in C.

    `function` says what it computes, with one result. `body` reads `in[i][j]`, writes `out[i][j]` and may call the functions
    that it `needs`. `attributes` stand before its definition.
    """

    function: ca.Function
    body: str
    required_functions: Sequence[ca.Function] = ()
    attributes: str = ""

    def __call__(self, *arguments: ca.SX) -> ca.SX:
        """The result, by a call that stays one in C."""
        return call_in_c(self.function, *arguments)[0]


def call_in_c(function: ca.Function, *arguments: ca.SX) -> list[ca.SX]:
    """The results of a function that is called in C instead of becoming part of the caller."""
    return function.call(list(arguments), False, True)


class ElementAccess(NamedTuple):
    """Where element j of argument i and of result i lie in C."""

    argument: Callable[[int, int], str]
    result: Callable[[int, int], str]


_POINTER_ACCESS = ElementAccess(lambda i, j: f"in[{i}][{j}]", lambda i, j: f"out[{i}][{j}]")


def callee_definitions(functions: Iterable[ca.Function], known: Sequence[Callee] = ()) -> dict[str, str]:
    """Name -> definition of the functions that these call, each after those that it calls itself."""
    given = {callee.function.name(): callee for callee in known}
    found: dict[str, str] = {}
    for function in functions:
        for inner in function.find_functions(0):
            callee = given.get(inner.name())
            found |= callee_definitions([inner] if callee is None else [], known)
            for needed in callee.required_functions if callee else ():
                found |= callee_definitions([needed], known) | {needed.name(): function_definition("static", needed)}
            found[inner.name()] = _callee_definition(callee) if callee else function_definition("static", inner)
    return found


def _callee_definition(callee: Callee) -> str:
    return f"{callee.attributes}static {_SIGNATURE.format(callee.function.name())}\n{callee.body}"


def function_definition(linkage: str, function: ca.Function) -> str:
    """The function in C, after a word about its linkage. Raises ValueError as `c_function` does."""
    return f"{linkage} {_SIGNATURE.format(function.name())}\n{function_body(function)}"


def function_body(function: ca.Function) -> str:
    """The body of the function: reads `in[i][j]` and writes `out[i][j]`, element j of argument and result i.

    What it calls by `called` is called (`callees` has the bodies).
    Raises ValueError for an operation that has no counterpart in C.
    """
    return "{\n" + "".join(f"    {statement};\n" for statement in StatementGenerator(densify(function))) + "}\n"


def densify(function: ca.Function) -> ca.Function:
    """The function without structural zeros and common subexpressions."""
    arguments = [ca.SX.sym(f"a{i}", function.size_in(i)) for i in range(function.n_in())]
    results = ca.cse([ca.densify(result) for result in function.call(arguments)])
    return ca.Function(function.name(), arguments, results)


class StatementGenerator:
    """The statements of a function, each an assignment or a call.

    `_values` maps places in CasADi's work vector to the C expression that holds their present value.
    """

    def __init__(self, function: ca.Function, places: ElementAccess = _POINTER_ACCESS):
        self._function, self._places = function, places
        self._values: dict[int, str] = {}
        self._constants: dict[str, float] = {}
        self._called = {inner.name(): inner for inner in function.find_functions(0)}
        text = function.str(True).partition("Algorithm:\n")[2].splitlines() if self._called else []
        self._names = [line.partition(" = ")[2].partition("(")[0] for line in text]

    def __iter__(self) -> Iterator[str]:
        for k in range(self._function.n_instructions()):
            operation = self._function.instruction_id(k)
            if operation == ca.OP_CALL:
                yield from self._call(k)
            elif operation == ca.OP_INPUT:
                self._load_argument(k)
            elif operation == ca.OP_CONST:
                self._load_constant(k)
            else:
                yield self._assign(k, operation)

    def _load_argument(self, k: int) -> None:
        argument, element = self._function.instruction_input(k)
        self._values[self._function.instruction_output(k)[0]] = self._places.argument(argument, element)

    def _load_constant(self, k: int) -> None:
        value = self._function.instruction_constant(k)
        self._values[self._function.instruction_output(k)[0]] = text = _literal(value)
        self._constants[text] = value

    def _assign(self, k: int, operation: int) -> str:
        targets, operands = self._function.instruction_output(k), self._function.instruction_input(k)
        values = [self._values[place] for place in operands]
        if operation == ca.OP_OUTPUT:
            return f"{self._places.result(*targets)} = {values[0]}"
        self._values[targets[0]] = f"v{k}"
        return f"const double v{k} = {self._expression(operation, values)}"

    def _expression(self, operation: int, operands: list[str]) -> str:
        """The expression of an operation; dividing by a constant takes four times as long as multiplying by its inverse."""
        divisor = self._constants.get(operands[-1]) if operation == ca.OP_DIV else None
        if divisor and math.isfinite(1 / divisor):
            return f"{operands[0]} * {_literal(1 / divisor)}"
        return _operation(self._function, operation).format(*operands)

    def _call(self, k: int) -> Iterator[str]:
        """A call; arguments that lie side by side among those of this function are not copied."""
        callee = self._called[self._names[k]]
        places, arguments = iter(self._function.instruction_input(k)), []
        for i in range(callee.n_in()):
            values = [self._values[place] for place in islice(places, callee.nnz_in(i))]
            arguments.append(pointer := _pointer(values) or f"c{k}_{i}")
            if pointer == f"c{k}_{i}":
                yield f"const double {pointer}[] = {{{', '.join(values)}}}"
        sizes = [callee.nnz_out(i) for i in range(callee.n_out())]
        for i, size in enumerate(sizes):
            yield f"double r{k}_{i}[{size}]"
        results = [f"r{k}_{i}" for i in range(len(sizes))]
        yield (f"{callee.name()}((const double *const[]){{{', '.join(arguments)}}}, (double *const[]){{{', '.join(results)}}})")
        elements = [f"r{k}_{i}[{j}]" for i, size in enumerate(sizes) for j in range(size)]
        self._values |= dict(zip(self._function.instruction_output(k), elements, strict=True))


def _pointer(values: Sequence[str]) -> str | None:
    """The address of consecutive elements of an argument, if these are such."""
    match = re.fullmatch(r"in\[(\d+)\]\[(\d+)\]", values[0])
    if match is None:
        return None
    argument, first = match[1], int(match[2])
    side_by_side = [f"in[{argument}][{first + k}]" for k in range(len(values))]
    return f"in[{argument}] + {first}" if list(values) == side_by_side else None


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
