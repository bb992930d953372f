"""The seam of the exporter: a block of C code with described variables.

Front ends (Modelica, CasADi equations, hand-written C) produce a `Block`; the FMI shells wrap it, for FMI 2.0 and 3.0 alike.
Its C code consists of `model.h`, which defines `typedef struct {...} Model;` (flat memory, no pointers: a copy of the struct is
the FMU state), and of sources that define

    void model_start(Model *m);                       every variable to its start value
    void model_parameters(Model *m);                  dependent parameters; called after parameters were set
    const char *model_initialize(Model *m, double time);
        states and outputs from parameters, start values and inputs at the start time; called whenever something is read
        in initialization mode after something was set, and when that mode is left: so it may run several times
    const char *model_step(Model *m, double time, double step_size);
        advance with held inputs; outputs afterwards belong to the new time (continuous models) or are those computed at the
        last tick in [time, time + step_size) (sampled models)

The functions that return text return NULL when all is well, else the reason of the failure (static text), which becomes
fmi?Error and a log message. Symbols that others load from the binary are marked `MODEL_EXPORT` (from the shell's `export.h`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...core.component import Causality, Variability


@dataclass(frozen=True, slots=True)
class BlockVariable:
    """One variable: its FMI side, and the member of `Model` that holds it (`double`, `int32_t` or `bool`).

    Arrays are one variable with a shape: one FMI 3.0 array, or the FMI 2.0 scalars "name[1]", "name[2]" (in C row-major).
    `start` is a scalar, or a flat tuple for arrays. `unit` is Modelica syntax ("m/s"), "" for none.
    `enumeration` lists (name, description) of the literals, whose values are 1, 2, ...
    """

    name: str
    member: str
    type: str  # "Float64", "Int32", "Boolean" or "Enumeration" (an int32_t)
    causality: Causality
    variability: Variability
    start: Any = None
    unit: str = ""
    shape: tuple[int, ...] = ()
    description: str = ""
    minimum: float | None = None
    maximum: float | None = None
    enumeration: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Block:
    """Everything an FMU is made of, but for the FMI version.

    `identifier` is a C identifier and the name of the FMU file; `step_size` (s) is the sample period or the preferred
    communication step; `files` maps names of C files to their text; `resources` are the original sources, put into the
    FMU's `resources/` folder under the given names.
    """

    identifier: str
    description: str
    variables: Sequence[BlockVariable]
    step_size: float
    files: Mapping[str, str]
    resources: Mapping[str, Path] = field(default_factory=dict)
