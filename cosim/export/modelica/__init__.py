"""Modelica to a Block of C: rumoca parses, checks and flattens; sorting and the C are made here.

    front       runs rumoca, finds the files            sort        order of computation (matching, triggers)
    reader      its JSON as frozen data (flat)          emit        C (header, statements, expressions, functions)
    roles       which parameters can be set             interpret   the same model in plain Python

Semantics. Models are sampled: `when sample(start, period)` runs at every tick t_k = start + k*period that lies in
[t, t + h), in order, with held inputs; ticks are counted as integers, the first one is not before the start time. All other
equations and assertions are computed at every tick, and once for the initialization, where when-clauses are inactive unless
they name initial(). A when-clause on a condition runs at the tick at which the condition has become true. A model without
any sample() is computed once per step at t + h. pre(x) is the value before the tick. Declared min and max are described,
not applied. Real arithmetic is IEEE 754; an output or remembered value that is not finite, an Integer overflow, an Integer
division by zero, a subscript outside its array and a violated assert() make the step fail, with the reason.
"""

from .assemble import interpreter, load

__all__ = ["interpreter", "load"]
