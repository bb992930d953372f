"""Sums over the rows of a table as vectorizable loops in C (SIMD)."""

from __future__ import annotations

import casadi as ca

from .c_code import Callee, ElementAccess, StatementGenerator, densify


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
    common, count = ca.SX.sym("common", term.size1_in(0)), ca.SX.sym("count")
    tables = [ca.SX.sym("table", rows, term.size1_in(i)) for i in range(1, term.n_in())]
    terms = [
        ca.if_else(count > k, term(common, *(table[k, :].T for table in tables)), 0)
        for k in range(rows)
    ]
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
