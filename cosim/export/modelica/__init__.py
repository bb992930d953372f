"""Modelica to a Block of C: rumoca parses, checks and flattens; sorting and the C are made here.

    front       runs rumoca, finds the files            sort        order of computation (matching, triggers)
    reader      its JSON as frozen data (flat)          emit        C (header, statements, expressions, functions)
    states      der(x) as a variable                    steps       C of model_step: ticks, integration
    roles       which parameters can be set             interpret   the same model in plain Python
    omc         another way: export by OpenModelica

Semantics. Sampled models: `when sample(start, period)` runs at every tick t_k = start + k*period that lies in
[t, t + h), in order, with held inputs; ticks are counted as integers, the first one is not before the start time. All other
equations and assertions are computed at every tick, and once for the initialization, where when-clauses are inactive unless
they name initial(). A when-clause on a condition runs at the tick at which the condition has become true. A model without
any sample() is computed once per step at t + h. pre(x) is the value before the tick. Declared min and max are described,
not applied. Real arithmetic is IEEE 754; an output or remembered value that is not finite, an Integer overflow, an Integer
division by zero, a subscript outside its array and a violated assert() make the step fail, with the reason.

Continuous states (der(x) = ...) advance from tick to tick and to t + h, where everything is computed once more: outputs belong
to t + h. The method is the classical Runge-Kutta method of order 4, between two events of distance d in ceil(d/0.005 - 1e-9)
equal steps; continuous equations are computed at each of its stages, with held inputs and held sampled values. There are no
state events: if-expressions are evaluated as they are at each stage, and when-clauses on conditions (with reinit(), too) act at
ticks and at the ends of steps only; assertions are checked there. States begin with `start`, fixed or not, or with an initial
equation `x = ...`.
"""

from .assemble import load_block, load_interpreter

__all__ = ["load_block", "load_interpreter"]
