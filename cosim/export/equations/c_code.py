"""C code generation for CasADi functions.

One statement per operation, in static single assignment form.

CasADi's own code generator also emits a large interface around each function. This one emits the
function only. The code is readable, compiles without warnings and depends only on the C
mathematical library.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import NamedTuple

import casadi as ca
from casadi import SX

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
    ca.OP_POW: "pow({}, {})",
    ca.OP_CONSTPOW: "pow({}, {})",
    # not fmin and fmax: compilers do not inline them, and they suppress NaN
    ca.OP_FMIN: "{0} < {1} ? {0} : {1}",
    ca.OP_FMAX: "{0} > {1} ? {0} : {1}",
    ca.OP_SIGN: "(double)({0} > 0) - (double)({0} < 0)",
    ca.OP_LT: "{} < {}",
    ca.OP_LE: "{} <= {}",
    ca.OP_EQ: "{} == {}",
    ca.OP_NE: "{} != {}",
    ca.OP_NOT: "!{}",
    ca.OP_AND: "{} && {}",
    ca.OP_OR: "{} || {}",
    ca.OP_IF_ELSE_ZERO: "{} != 0 ? {} : 0",
}
_TRIGONOMETRIC_FUNCTIONS = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh")
_UNARY_FUNCTIONS = (*_TRIGONOMETRIC_FUNCTIONS, "sqrt", "exp", "log", "fabs", "floor", "ceil")
_OPERATIONS |= {getattr(ca, f"OP_{name.upper()}"): f"{name}({{}})" for name in _UNARY_FUNCTIONS}
_OPERATIONS |= {
    getattr(ca, f"OP_{name.upper()}"): f"{name}({{}}, {{}})"
    for name in ("atan2", "hypot", "fmod", "copysign")
}

_SIGNATURE = "void {}(const double *const in[], double *const out[])"


@dataclass(frozen=True)
class Callee:
    """A function with a hand-written C body that expressions call."""

    #: the same function in CasADi, with one result
    function: ca.Function
    #: C body, in braces: reads `in[i][j]` and writes `out[i][j]`, element j of argument i and of
    #: result i
    body: str
    #: functions that the body calls
    required_functions: Sequence[ca.Function] = ()
    #: C text in front of the definition
    attributes: str = ""

    def __call__(self, *arguments: SX) -> SX:
        """Return the result as an expression that stays a function call in the C code."""
        return call_in_c(self.function, *arguments)[0]


def call_in_c(function: ca.Function, *arguments: SX) -> list[SX]:
    """Return the results of a function, which is called and not inlined in the C code."""
    results: list[SX] = function.call(list(arguments), False, True)
    return results


class ElementAccess(NamedTuple):
    """C expressions of element j of argument i and of result i, as functions of (i, j)."""

    argument: Callable[[int, int], str]
    result: Callable[[int, int], str]


_POINTER_ACCESS = ElementAccess(lambda i, j: f"in[{i}][{j}]", lambda i, j: f"out[{i}][{j}]")


def callee_definitions(
    functions: Iterable[ca.Function], callees: Sequence[Callee] = ()
) -> dict[str, str]:
    """Generate the C functions that the given functions call, directly or indirectly.

    Args:
        functions: The calling functions.
        callees: The called functions with a hand-written C body; the body of all others is
            generated.

    Returns:
        Function name -> C definition, each after the functions that it calls.

    Raises:
        ValueError: An operation has no counterpart in C.
    """
    hand_written = {callee.function.name(): callee for callee in callees}
    definitions: dict[str, str] = {}
    for function in functions:
        for called in function.find_functions(0):
            callee = hand_written.get(called.name())
            definitions |= callee_definitions([called] if callee is None else [], callees)
            for required in callee.required_functions if callee else ():
                definitions |= callee_definitions([required], callees)
                definitions |= {required.name(): function_definition("static", required)}
            if callee:
                signature = _SIGNATURE.format(callee.function.name())
                definition = f"{callee.attributes}static {signature}\n{callee.body}"
            else:
                definition = function_definition("static", called)
            definitions[called.name()] = definition
    return definitions


def function_definition(linkage: str, function: ca.Function) -> str:
    """Generate the C definition of a function.

    Args:
        linkage: Specifiers in front of the definition, for example "static".
        function: The function, with scalar operations only (SX).

    Raises:
        ValueError: An operation has no counterpart in C.
    """
    return f"{linkage} {_SIGNATURE.format(function.name())}\n{function_body(function)}"


def function_body(function: ca.Function) -> str:
    """Generate the C body of a function, which reads `in[i][j]` and writes `out[i][j]`.

    Element j of argument and result i.

    Calls made by `call_in_c` remain calls; `callee_definitions` generates the called functions.

    Raises:
        ValueError: An operation has no counterpart in C.
    """
    return (
        "{\n"
        + "".join(f"    {statement};\n" for statement in StatementGenerator(densify(function)))
        + "}\n"
    )


def densify(function: ca.Function) -> ca.Function:
    """Return the function with dense results and without common subexpressions."""
    arguments = [SX.sym(f"a{i}", function.size_in(i)) for i in range(function.n_in())]
    results = ca.cse([ca.densify(result) for result in function.call(arguments)])
    return ca.Function(function.name(), arguments, results)


class StatementGenerator:
    """Iterable of the C statements of a function, each an assignment or a call, without semicolons.

    Args:
        function: The function, without structural zeros (see `densify`).
        access: C expressions of its arguments and results.
    """

    def __init__(self, function: ca.Function, access: ElementAccess = _POINTER_ACCESS):
        self._function, self._access = function, access
        #: index in CasADi's work vector -> C expression of its current value
        self._values: dict[int, str] = {}
        self._constants: dict[str, float] = {}
        self._called = {called.name(): called for called in function.find_functions(0)}
        # CasADi gives the name of the function that an instruction calls only in its listing of the
        # algorithm
        listing = (
            function.str(True).partition("Algorithm:\n")[2].splitlines() if self._called else []
        )
        self._callee_names = [line.partition(" = ")[2].partition("(")[0] for line in listing]

    def __iter__(self) -> Iterator[str]:
        """Generate the statements in order of execution."""
        for k in range(self._function.n_instructions()):
            operation = self._function.instruction_id(k)
            if operation == ca.OP_CALL:
                yield from self._call(k)
            elif operation == ca.OP_INPUT:
                target = self._function.instruction_output(k)[0]
                self._values[target] = self._access.argument(*self._function.instruction_input(k))
            elif operation == ca.OP_CONST:
                value = self._function.instruction_constant(k)
                self._values[self._function.instruction_output(k)[0]] = text = _literal(value)
                self._constants[text] = value
            else:
                yield self._assign(k, operation)

    def _assign(self, k: int, operation: int) -> str:
        targets, operands = (
            self._function.instruction_output(k),
            self._function.instruction_input(k),
        )
        values = [self._values[index] for index in operands]
        if operation == ca.OP_OUTPUT:
            return f"{self._access.result(*targets)} = {values[0]}"
        self._values[targets[0]] = f"v{k}"
        return f"const double v{k} = {self._expression(operation, values)}"

    def _expression(self, operation: int, operands: list[str]) -> str:
        """Return the C expression of an operation.

        A division by a constant becomes a multiplication, which is faster.
        """
        divisor = self._constants.get(operands[-1]) if operation == ca.OP_DIV else None
        if divisor and math.isfinite(1 / divisor):
            return f"{operands[0]} * {_literal(1 / divisor)}"
        if operation not in _OPERATIONS:
            raise ValueError(
                f"{self._function.name()}: the CasADi operation {operation} has no counterpart in C"
            )
        return _OPERATIONS[operation].format(*operands)

    def _call(self, k: int) -> Iterator[str]:
        """Generate a call.

        Arguments that are consecutive elements of an argument of this function are not copied.
        """
        callee = self._called[self._callee_names[k]]
        operands, arguments = iter(self._function.instruction_input(k)), []
        for i in range(callee.n_in()):
            values = [self._values[index] for index in islice(operands, callee.nnz_in(i))]
            arguments.append(pointer := _pointer(values) or f"c{k}_{i}")
            if pointer == f"c{k}_{i}":
                yield f"const double {pointer}[] = {{{', '.join(values)}}}"
        sizes = [callee.nnz_out(i) for i in range(callee.n_out())]
        for i, size in enumerate(sizes):
            yield f"double r{k}_{i}[{size}]"
        results = [f"r{k}_{i}" for i in range(len(sizes))]
        yield (
            f"{callee.name()}((const double *const[]){{{', '.join(arguments)}}}, (double "
            f"*const[]){{{', '.join(results)}}})"
        )
        elements = [f"r{k}_{i}[{j}]" for i, size in enumerate(sizes) for j in range(size)]
        self._values |= dict(zip(self._function.instruction_output(k), elements, strict=True))


def _pointer(values: Sequence[str]) -> str | None:
    """Return the C address of values that are consecutive elements of one argument, else None."""
    match = re.fullmatch(r"in\[(\d+)\]\[(\d+)\]", values[0])
    if match is None:
        return None
    argument, first = match[1], int(match[2])
    consecutive = [f"in[{argument}][{first + k}]" for k in range(len(values))]
    return f"in[{argument}] + {first}" if list(values) == consecutive else None


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(value)


def sum_over_rows(name: str, term: ca.Function, rows: int) -> Callee:
    """Create a function that sums a term over the first rows of tables.

    Eight terms at a time are computed in one loop, which compilers vectorize if the term is plain
    arithmetic. They are accumulated in eight partial sums, which are added at the end.

    Args:
        name: The name of the function, a C identifier.
        term: (common, row of the first table, row of the second table, ...) -> vector; `common` are
            the arguments that all rows share.
        rows: The number of rows of each table, a multiple of 8.

    Returns:
        The function (common, count, *tables) -> sum of the terms, where a table has the shape
        (rows, columns) and only the first `count` rows are used.
    """
    common, count = SX.sym("common", term.size1_in(0)), SX.sym("count")
    tables = [SX.sym("table", rows, term.size1_in(i)) for i in range(1, term.n_in())]
    terms = []
    for k in range(rows):
        row = [table[k, :].T for table in tables]
        terms.append(ca.if_else(count > k, term(common, *row), 0))
    total = ca.Function(name, [common, count, *tables], [sum(terms)])
    access = ElementAccess(
        lambda i, j: f"in[{i + 1}][{rows * j} + first + k]" if i else f"common[{j}]",
        lambda _, j: f"value[{j}][k]",
    )
    statements = "".join(
        f"            {statement};\n" for statement in StatementGenerator(densify(term), access)
    )
    sizes = {"size": term.size1_out(0), "rows": rows, "common": term.size1_in(0)}
    return Callee(
        total, _SUM_TEMPLATE % {**sizes, "statements": statements}, attributes=_TARGET_CLONES
    )


#: The function is compiled for several SIMD widths; the processor at run time determines which one
#: is called. The results are bit-identical, because the operations of each row and their order do
#: not depend on the width.
#: AVX-512 is omitted: many processors lower their clock frequency for it.
_TARGET_CLONES = """#ifndef WIDE
#if defined __x86_64__ && defined __GLIBC__ && !defined __clang__
#define WIDE __attribute__((target_clones("avx2", "default")))
#else
#define WIDE
#endif
#endif
WIDE """

_SUM_TEMPLATE = """{
    const double count = in[1][0];
    double common[%(common)d], sums[%(size)d][8] = {{0}};
    for (int i = 0; i < %(common)d; ++i) common[i] = in[0][i];
    for (int first = 0; first < %(rows)d && first < count; first += 8) {
        double value[%(size)d][8];
        for (int k = 0; k < 8; ++k) {
%(statements)s        }
        for (int k = 7; first + k >= count; --k)
            for (int i = 0; i < %(size)d; ++i) value[i][k] = 0;
        for (int i = 0; i < %(size)d; ++i)
            for (int k = 0; k < 8; ++k) sums[i][k] += value[i][k];
    }
    for (int i = 0; i < %(size)d; ++i) {
        const double *const s = sums[i];
        out[0][i] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}
"""
