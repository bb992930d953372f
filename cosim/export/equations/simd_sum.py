"""Sums over the rows of a table in the equations: loops in C that compute rows side by side."""

from __future__ import annotations

import casadi as ca

from .c_code import Callee, ElementAccess, StatementGenerator, densify


def sum_over_rows(name: str, term: ca.Function, rows: int) -> Callee:
    """The sum of `term` over the rows of a table, in C a loop.

    `term` maps (common, row) to a vector. The function of the result maps (common, count, table), with a table (rows, columns)
    of which only the first `count` rows are used, to the sum of the terms. `rows` is a multiple of 8: so many terms are computed
    side by side, which compilers make use of if the term is plain arithmetic, and so many sums, which are added in the end.
    """
    common, table = ca.SX.sym("common", term.size1_in(0)), ca.SX.sym("table", rows, term.size1_in(1))
    count = ca.SX.sym("count")
    terms = [ca.if_else(count > k, term(common, table[k, :].T), 0) for k in range(rows)]
    total = ca.Function(name, [common, count, table], [sum(terms)])
    places = ElementAccess(lambda i, j: f"row[{rows * j} + k]" if i else f"common[{j}]", lambda i, j: f"value[{j}][k]")
    statements = "".join(f"            {statement};\n" for statement in StatementGenerator(densify(term), places))
    sizes = {"size": term.size1_out(0), "rows": rows, "common": term.size1_in(0)}
    return Callee(total, _SUM_TEMPLATE % {**sizes, "statements": statements}, attributes=_TARGET_CLONES)


#: compiled for each width of registers; the processor it runs on chooses. The bits are the same: every row has the same
#: operations in the same order, whatever is computed beside it. Not for 512 bits: many processors run slower after these
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
        const double *const row = in[2] + first;
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
