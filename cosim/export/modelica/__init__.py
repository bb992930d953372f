"""Compiler from Modelica models to blocks of C code.

The package rumoca parses, checks and flattens a model. The order of computation and the C code are
generated here.

`frontend/`: from text to the flat model

- `rumoca_frontend`, `rumoca_client`, `rumoca_process`: flatten a model with rumoca in a child
  process, with a cache; `libraries`, `model_files`: the libraries and files that it needs
- `reader` (`expression_reader`, `statement_reader`): convert its JSON to the flat model
- `constants`: structural parameters, constants and Strings become literals; `folded_branches`: find
  the parameters with which rumoca has selected equations
- `rumoca_messages`, `class_search`: messages of rumoca with places

`model/`: the flat model

- `flat_model`, `syntax_tree`, `scalars`, `traversal`, `simplification`: the data structure
- `builtin_functions`: one row for each built-in function of Modelica
- `evaluate`, `arithmetic`: evaluation in Python

`causality/`: from equations to the order of computation

- `clocked_partitions` (`clock_inference`): replace clocked equations by sampled ones
- `continuous_states` (`differentiation`): replace der(x) by a variable, and reduce the index
- `hybrid`: variables for pre(), relations and delay() in models with event iteration
- `continuous_equations`: solve the equations that have a variable alone on one side, and all others
  with `equation_systems` (`scalar_equations`, `matching`)
- `computation_order` (`dependency_graph`, `when_conditions`): the order of computation
- `analysed_model`: the result, with roles and default values of parameters

`c_code/`: from the analysed model to C

- `model_code` (`hybrid_code`, `model_step`, `exchange_code`): model.c; `header`: model.h
- `function_lowering`, `statement_lowering`, `expression_lowering`, `builtin_lowering`, `lowering`,
  `c_values`: parts of model.c

`external/`: C code of external functions

- `c_files`: their files, and C functions that call them; `shared_library`: evaluation in Python;
  `external.c`: errors, messages, Strings and external objects

Here: `assemble`: a Modelica file to a block; `fmi_variables`: its FMI variables and units.

Sampled models, in a communication step from t to t + h:

- A clause `when sample(start, period)` is active at every tick t_k = start + k*period in [t, t +
  h), with constant inputs. The first tick is the first one that is not before the start time. Ticks
  are counted as integers.
- All other equations and assertions are computed at every tick and at the initialization.
- At the initialization, when-clauses are inactive unless their condition contains initial().
- A when-clause with another condition is active at the tick at which this condition has become
  true.
- A model without sample() is computed once per step, at t + h.
- pre(x) is the value of x before the tick.
- Declared minima and maxima are written to the model description; they are not enforced.
- Real arithmetic is that of IEEE 754. The step fails, with the reason, if an output or a value used
  by pre() is not finite, and on an Integer overflow, an Integer division by zero, a subscript
  outside its array or a violated assert().

Models with continuous states (`der(x) = ...`):

- The states advance from tick to tick, and from the last tick to t + h. All equations are computed
  once more at t + h, and the outputs belong to this time.
- The integration method is the classical Runge-Kutta method of order 4. The interval d between two
  events is divided into ceil(d/0.005 - 1e-9) equal integration steps. Inputs and sampled values are
  constant between two events.
- Assertions are evaluated at ticks and at t + h only.
- The initial value of a state is its `start` value, whether `fixed` or not, unless initial
  equations determine it. They are solved together with the other equations, by Newton's method
  where they are not linear.

Models with event iteration. These are all models with `pre()`, `edge()`, `change()` or `sample()`
outside when-clauses, with `reinit()` or `delay()`, with continuous states and comparisons (outside
`noEvent()`) of values that change with time, or with continuous states and a library, and library
models with when-clauses whose conditions change with time:

- There is an event at t if an input has changed, at every tick, at t + h, and whenever a comparison
  changes its value. The time of this change is located to 1e-10 s. Between events, comparisons keep
  their value.
- In an event all equations are evaluated again with pre(x) = x, until the discrete variables and
  the comparisons do not change.
- The states are integrated by the method of Dormand and Prince of order 5 with error control
  (relative tolerance 1e-7, absolute tolerance 1e-9).
- Without inputs, the ticks at the start time belong to the initialization.
- delay() interpolates linearly between at most 2048 stored values.

Equations in any form:

- Linear equations are solved symbolically, systems of linear equations by elimination, all others
  by Newton's method from the last values with symbolic derivatives. A step fails if there is no
  solution.
- A variable x in der(x) that equations determine is not a state; its derivative is computed from
  the derivatives of equations. An equation between states must be linear in this variable, and
  derivatives of inputs are refused.
- At the initialization, systems with homotopy() are solved in ten steps from the simplified to the
  actual expressions.
- Structural parameters (those that select equations or sizes) are constants of the FMU.
"""

from .assemble import load_block
from .frontend.rumoca_frontend import ModelicaOptions

__all__ = ["ModelicaOptions", "load_block"]
