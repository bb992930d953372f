"""A small hand-written block with all kinds of variables, and its FMUs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE
from fmpy.fmi3 import FMU3Slave

from cosim.export.fmu.block import Block, BlockVariable
from cosim.export.fmu.package import write_fmu

HEADER = """
#include <stdbool.h>
#include <stdint.h>
typedef struct {
    double gain, limit, doubled_gain;
    double weights[3];
    int32_t repeat, mode, active_mode, steps;
    double input;
    double matrix[2][2];
    bool enabled, saturated;
    double integral, clock;
    double outputs[3];
    double inner_product[2];
} Model;
"""
SOURCE = """
#include "model.h"
#include "export.h"
#include <math.h>
#include <string.h>
enum { HOLD = 1, INTEGRATE = 2, FAIL = 3 };

MODEL_EXPORT double twice(double x) { return 2 * x; }

void model_start(Model *m)
{
    *m = (Model){.gain = 2.0, .limit = 10.0, .weights = {1.0, 0.5, 0.25}, .repeat = 1};
    m->mode = INTEGRATE;
    m->enabled = true;
    m->active_mode = HOLD;
}

void model_parameters(Model *m) { m->doubled_gain = twice(m->gain); }

static void outputs(Model *m)
{
    for (int i = 0; i < 3; ++i) m->outputs[i] = m->weights[i] * m->integral;
    for (int i = 0; i < 2; ++i)
        m->inner_product[i] = m->matrix[i][0] * m->integral + m->matrix[i][1];
    m->saturated = fabs(m->integral) > m->limit;
    m->active_mode = m->mode;
}

const char *model_initialize(Model *m, double time)
{
    if (m->limit <= 0) return "assertion: limit must be positive, not 0 %";
    m->integral = m->doubled_gain * m->input;
    m->clock = time;
    m->steps = 0;
    outputs(m);
    return 0;
}

const char *model_step(Model *m, double time, double step_size)
{
    if (m->mode == FAIL) return "assertion: mode is FAIL (100 % #sure)";
    for (int i = 0; i < m->repeat; ++i)
        if (m->enabled && m->mode == INTEGRATE)
            m->integral += m->doubled_gain * m->input * step_size;
    m->clock = time + step_size;
    m->steps += 1;
    outputs(m);
    return 0;
}
"""
MODES = (
    ("HOLD", "keep the integral"),
    ("INTEGRATE", ""),
    ("FAIL", 'refuse to step, "loudly" & <clearly>'),
)


VARIABLES = (
    BlockVariable(
        "gain",
        "gain",
        "Float64",
        "parameter",
        "tunable",
        2.0,
        "1/s",
        description='gain "k"',
        minimum=0.0,
    ),
    BlockVariable("limit", "limit", "Float64", "parameter", "fixed", 10.0, "m", maximum=1e3),
    BlockVariable(
        "doubled_gain", "doubled_gain", "Float64", "calculatedParameter", "tunable", unit="1/s"
    ),
    BlockVariable(
        "weights", "weights", "Float64", "parameter", "tunable", (1.0, 0.5, 0.25), shape=(3,)
    ),
    BlockVariable("repeat", "repeat", "Int32", "parameter", "tunable", 1, minimum=1, maximum=4),
    BlockVariable("mode", "mode", "Enumeration", "parameter", "tunable", 2, enumeration=MODES),
    BlockVariable("enabled", "enabled", "Boolean", "input", "discrete", True),
    BlockVariable("vehicle.position.x", "input", "Float64", "input", "continuous", 0.0, "m"),
    BlockVariable("matrix", "matrix", "Float64", "input", "continuous", shape=(2, 2)),
    BlockVariable("outputs", "outputs", "Float64", "output", "continuous", unit="m", shape=(3,)),
    BlockVariable("inner_product", "inner_product", "Float64", "output", "discrete", shape=(2,)),
    BlockVariable(
        "active_mode", "active_mode", "Enumeration", "output", "discrete", enumeration=MODES
    ),
    BlockVariable("steps", "steps", "Int32", "output", "discrete"),
    BlockVariable("saturated", "saturated", "Boolean", "output", "discrete"),
    BlockVariable("clock", "clock", "Float64", "local", "continuous", unit="s"),
)


@pytest.fixture(scope="session")
def make_block() -> Callable[..., Block]:
    """Return a function that creates the sample block with replacements in its source:
    `make_block(("old", "new"))`.
    """

    def make(*replacements: tuple[str, str]) -> Block:
        source = SOURCE
        for old, new in replacements:
            assert old in source
            source = source.replace(old, new)
        return Block(
            "sample",
            "an integrator & more",
            VARIABLES,
            0.01,
            {"model.h": HEADER, "model.c": source},
        )

    return make


@pytest.fixture(scope="session")
def block(make_block: Callable[..., Block]) -> Block:
    return make_block()


@pytest.fixture(scope="session", params=[2, 3], ids=["fmi2", "fmi3"])
def version(request: pytest.FixtureRequest) -> int:
    return request.param


@pytest.fixture(scope="session")
def fmu(block: Block, version: int, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the FMU of the sample block."""
    return write_fmu(block, version, tmp_path_factory.mktemp(f"fmi{version}") / "sample.fmu")


class FmuInstance:
    """An FMPy instance with the same methods for FMI 2.0 and 3.0; arrays are accessed by name, log
    messages are recorded.
    """

    def __init__(self, folder: str, guid: str | None = None, messages: list[str] | None = None):
        self.description = read_model_description(folder)
        self.version = int(self.description.fmiVersion[0])
        self.variables = {variable.name: variable for variable in self.description.modelVariables}
        self.messages: list[str] = [] if messages is None else messages
        slave_class = FMU2Slave if self.version == 2 else FMU3Slave
        token = self.description.guid if guid is None else guid
        self.fmu = slave_class(
            guid=token, unzipDirectory=folder, modelIdentifier="sample", instanceName="one"
        )
        if self.version == 2:
            # FMPy's own logger would format the messages
            self._callbacks = fmi2CallbackFunctions()
            self._callbacks.logger = fmi2CallbackLoggerTYPE(
                lambda _e, _name, _status, _category, text: self._log(text)
            )
            self.fmu.instantiate(callbacks=self._callbacks)
        else:
            self.fmu.instantiate(
                logMessage=lambda _environment, _status, _category, text: self._log(text)
            )

    def _log(self, text: bytes) -> None:
        self.messages.append(text.decode())

    def initialize(
        self, start: float = 0.0, stop: float | None = None, **values: Any
    ) -> FmuInstance:
        self.enter(start, stop)
        for name, value in values.items():
            self.set(name, value)
        self.fmu.exitInitializationMode()
        return self

    def enter(self, start: float = 0.0, stop: float | None = None) -> None:
        if self.version == 2:
            self.fmu.setupExperiment(startTime=start, stopTime=stop)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=start, stopTime=stop)

    def step(self, time: float, step_size: float = 0.01) -> None:
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=step_size)

    def set(self, name: str, value: Any) -> None:
        kind, references = self._address(name)
        getattr(self.fmu, f"set{kind}")(references, value if isinstance(value, list) else [value])

    def get(self, name: str) -> Any:
        kind, references = self._address(name)
        count = [self._size(name)] if self.version == 3 else []
        values = list(getattr(self.fmu, f"get{kind}")(references, *count))
        return values if self._size(name) > 1 else values[0]

    def _address(self, name: str) -> tuple[str, list[int]]:
        if self.version == 3:
            variable = self.variables[name]
            return {"Enumeration": "Int64"}.get(variable.type, variable.type), [
                variable.valueReference
            ]
        scalars = [v for v in self.variables.values() if v.name.partition("[")[0] == name]
        return {"Enumeration": "Integer"}.get(scalars[0].type, scalars[0].type), [
            v.valueReference for v in scalars
        ]

    def _size(self, name: str) -> int:
        return {"weights": 3, "outputs": 3, "matrix": 4, "inner_product": 2}.get(name, 1)

    def save(self) -> Any:
        return self.fmu.getFMUstate() if self.version == 2 else self.fmu.getFMUState()

    def restore(self, state: Any) -> None:
        (self.fmu.setFMUstate if self.version == 2 else self.fmu.setFMUState)(state)

    def serialize(self, state: Any) -> bytes:
        return (self.fmu.serializeFMUstate if self.version == 2 else self.fmu.serializeFMUState)(
            state
        )

    def deserialize(self, content: bytes) -> Any:
        return (
            self.fmu.deSerializeFMUstate if self.version == 2 else self.fmu.deserializeFMUState
        )(content)

    def all_values(self) -> dict[str, Any]:
        names = {name.partition("[")[0] for name in self.variables}
        return {name: self.get(name) for name in sorted(names - {"time"})}


@pytest.fixture
def instantiate_sample(fmu: Path, tmp_path: Path) -> Iterator[Callable[..., FmuInstance]]:
    """Return a function that instantiates the sample FMU; free all instances at the end."""
    folder = extract(str(fmu), str(tmp_path / "extracted"))
    instances: list[FmuInstance] = []

    def instantiate(**arguments: Any) -> FmuInstance:
        instances.append(FmuInstance(folder, **arguments))
        return instances[-1]

    yield instantiate
    for instance in instances:
        instance.fmu.freeInstance()


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache of the user."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"
