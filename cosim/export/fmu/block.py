"""Intermediate form of the exporter: a block of C code with described variables.

The front ends (Modelica, CasADi equations) produce a `Block`. The C files in `export/shell/` wrap
it with the functions of FMI 2.0 or 3.0. The C code of a block consists of `model.h` and of source
files.

`model.h` defines `typedef struct {...} Model;`. The struct contains no pointers, so that a copy of
it is the FMU state.

The source files define these functions:

    void model_start(Model *m);
        Set every variable to its start value.
    void model_parameters(Model *m);
        Compute the dependent parameters; called after parameters were set.
    const char *model_initialize(Model *m, double time);
        Compute states and outputs at the start time from parameters, start values and inputs. In
        initialization mode it is called when a variable is read after another one was set, and when
        the mode is left: it may run several times.
    const char *model_step(Model *m, double time, double step_size);
        Advance from `time` by `step_size` with constant inputs. Afterwards the outputs of a
        continuous model belong to the new time; those of a sampled model were computed at the last
        tick in [time, time + step_size).

If `model.h` defines MODEL_EXCHANGE, the block is also exported for Model Exchange. Then `model.h`
defines MODEL_STATES and MODEL_INDICATORS, the numbers of continuous states and event indicators;
with indicators, `Model` has a member `double indicator[MODEL_INDICATORS]`. The source files define
these functions:

    void model_states(Model *m, double **states, double **rates);
        Return the addresses of the states and of their derivatives.
    const char *model_continuous(Model *m, double time);
        Compute all continuous variables, the derivatives and the indicators from states, inputs and
        the time.
    const char *model_update(Model *m, double time, double *next);
        Execute an event with its iteration; `next` is the time of the next time event, or infinite.
    void model_accept(Model *m, double time);
        Accept the states as part of the solution, after an integration step.

If `model.h` defines MODEL_FREE, `void model_free(Model *m);` is called before the memory of a model
is freed.

Functions with the result `const char *` return NULL on success, else the reason for the failure, a
text that is valid until the next call. It is logged, and the FMI function returns fmi2Error or
fmi3Error. Functions that other programs load from the binary are marked `MODEL_EXPORT` (defined in
`export.h` of the shell).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...core.component import Causality, Variability


@dataclass(frozen=True, slots=True)
class BlockVariable:
    """A variable of a block: its FMI attributes and the member of `Model` that holds its value.

    An array is one variable with a shape. It becomes one array in FMI 3.0 and the scalars
    "name[1]", "name[2]", ... in FMI 2.0.
    """

    name: str
    #: C expression of the member of `Model`, for example "state[3]": a double, int32_t or bool, or
    #: a row-major array of them
    member: str
    #: "Float64", "Int32", "Boolean" or "Enumeration" (an int32_t in C)
    type: str
    causality: Causality
    variability: Variability
    #: a scalar, or a flat tuple for an array; None means zero, false or the first literal
    start: Any = None
    #: unit in Modelica syntax ("m/s"), or ""
    unit: str = ""
    shape: tuple[int, ...] = ()
    description: str = ""
    minimum: float | None = None
    maximum: float | None = None
    #: (name, description) of the enumeration literals, whose values are 1, 2, ...
    enumeration: tuple[tuple[str, str], ...] = ()
    #: name of the enumeration type; by default it is derived from the name of the first variable
    #: with the same literals
    type_name: str = ""
    #: physical quantity, for example "Mass"
    quantity: str = ""


@dataclass(frozen=True, slots=True)
class Exchange:
    """Description of a block for Model Exchange.

    Attributes:
        states: Name of each continuous state -> name of its derivative.
        indicators: Variables of the event indicators.
        stores_values: True if accepted integration steps must be reported, because the model stores
            past values.
    """

    states: Mapping[str, str]
    indicators: Sequence[BlockVariable]
    stores_values: bool


@dataclass(frozen=True)
class Block:
    """Contents of an FMU that do not depend on the FMI version."""

    #: model identifier, a C identifier
    identifier: str
    description: str
    variables: Sequence[BlockVariable]
    #: sample period or preferred communication step size (s)
    step_size: float
    #: C file name -> text
    files: Mapping[str, str]
    #: name in the FMU's `resources/` folder -> file, for the original sources
    resources: Mapping[str, Path] = field(default_factory=dict)
    #: name -> static library that is linked to the FMU
    archives: Mapping[str, Path] = field(default_factory=dict)
    #: None if the block is only exported for Co-Simulation
    exchange: Exchange | None = None
