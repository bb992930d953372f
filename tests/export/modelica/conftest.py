"""Execution of Modelica models by the generated C code (ctypes) and by the interpreter, with
bitwise comparison.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from frontend_server import run_forked
from modelica_interpreter import Interpreter, load_interpreter

from cosim.export.fmu.block import Block, BlockVariable
from cosim.export.modelica import assemble, load_block
from cosim.export.modelica.frontend import rumoca_client

CTYPES = {
    "Float64": ctypes.c_double,
    "Int32": ctypes.c_int32,
    "Enumeration": ctypes.c_int32,
    "Boolean": ctypes.c_bool,
}
GCC = [
    "gcc",
    "-std=c11",
    "-O0",
    "-ffp-contract=off",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-fPIC",
    "-shared",
]  #: for the C code of external functions
LENIENT_GCC = ["gcc", "-std=c11", "-O0", "-ffp-contract=off", "-fPIC", "-w", "-c"]
GENERATED = ("model.c", "layout.c", "external.c", "external_calls.c")

TICKS = 500  # default number of steps with random inputs


class CompiledBlock:
    """An instance of a compiled block, which is accessed like by the FMI shells: struct offsets and
    four functions.
    """

    def __init__(self, block: Block, folder: Path):
        self.block = block
        self.variables: Mapping[str, BlockVariable] = {v.name: v for v in block.variables}
        for name, text in block.files.items():
            (folder / name).write_text(text)
        layout = ", ".join(
            ["sizeof(Model)", *(f"offsetof(Model, {v.member})" for v in block.variables)]
        )
        (folder / "layout.c").write_text(
            f'#include <stddef.h>\n#include "model.h"\nsize_t layout[] = {{{layout}}};\n'
        )
        library = folder / "block.so"
        sources = [name for name in (*block.files, "layout.c") if name.endswith(".c")]
        foreign = [name for name in sources if name not in GENERATED]
        if foreign:
            subprocess.run([*LENIENT_GCC, *foreign], check=True, cwd=folder)
        objects = [name.replace(".c", ".o") if name in foreign else name for name in sources]
        subprocess.run([*GCC, "-o", str(library), *objects, "-lm"], check=True, cwd=folder)
        self._library = ctypes.CDLL(str(library))
        size, *offsets = (ctypes.c_size_t * (1 + len(block.variables))).in_dll(
            self._library, "layout"
        )
        self._offsets = dict(zip(self.variables, offsets, strict=True))
        self._memory = ctypes.create_string_buffer(size)
        for function in (self._library.model_initialize, self._library.model_step):
            function.restype = ctypes.c_char_p
        self._library.model_start(self._memory)

    def _array(self, name: str) -> Any:
        variable = self.variables[name]
        count = int(np.prod(variable.shape, dtype=int))
        return (CTYPES[variable.type] * count).from_buffer(self._memory, self._offsets[name])

    def set(self, name: str, value: Any) -> None:
        array = self._array(name)
        array[:] = [array._type_(x).value for x in np.asarray(value).flat]
        if "arameter" in self.variables[name].causality:
            self._library.model_parameters(self._memory)

    def get(self, name: str) -> Any:
        values = list(self._array(name))
        shape = self.variables[name].shape
        return np.array(values).reshape(shape) if shape else values[0]

    def initialize(self, time: float = 0.0) -> str | None:
        return self._reason(self._library.model_initialize(self._memory, ctypes.c_double(time)))

    def step(self, time: float, step_size: float) -> str | None:
        """Step the block; return None or the reason for its failure."""
        return self._reason(
            self._library.model_step(
                self._memory, ctypes.c_double(time), ctypes.c_double(step_size)
            )
        )

    @staticmethod
    def _reason(text: bytes | None) -> str | None:
        return text.decode() if text else None


class CompiledAndInterpreted:
    """The compiled block and the interpreter of one model, stepped together and compared bit for
    bit.
    """

    def __init__(self, c: CompiledBlock, python: Interpreter):
        self.c, self.python = c, python
        self.outputs = [
            v.name for v in c.block.variables if v.causality in ("output", "calculatedParameter")
        ]
        self.inputs = [v for v in c.block.variables if v.causality == "input"]

    def set(self, **values: Any) -> None:
        """Set variables; `__` in a name is replaced by a dot."""
        for name, value in values.items():
            self.c.set(name.replace("__", "."), value)
            self.python.set(name.replace("__", "."), value)

    def initialize(self, time: float = 0.0) -> None:
        assert self.c.initialize(time) is None
        self.python.initialize(time)
        self.compare(time)

    def step(self, time: float, step_size: float = 0.01) -> None:
        assert self.c.step(time, step_size) is None
        self.python.step(time, step_size)
        self.compare(time)

    def compare(self, time: float) -> None:
        for name in self.outputs:
            assert _same(self.c.get(name), self.python.get(name)), f"{name} at {time}"

    def get(self, name: str) -> Any:
        return self.c.get(name)

    def randomize(
        self, seed: int, variables: list[BlockVariable] | None = None, scale: float = 3.0
    ) -> dict[str, Any]:
        """Set all inputs (or the given variables) to random values and return these."""
        rng = np.random.default_rng(seed)
        values = {v.name: _random(rng, v, scale) for v in variables or self.inputs}
        for name, value in values.items():
            self.c.set(name, value)
            self.python.set(name, value)
        return values

    def simulate(
        self, ticks: int = TICKS, **parameters: Any
    ) -> Iterator[tuple[int, dict[str, Any]]]:
        """Set parameters, initialize, and step like `run`."""
        self.set(**parameters)
        self.initialize()
        yield from self.run(ticks)

    def run(
        self, ticks: int = TICKS, seed: int = 0, period: float = 0.01
    ) -> Iterator[tuple[int, dict[str, Any]]]:
        """Step with random inputs; yield the number of the tick and its inputs after each step."""
        for k in range(ticks):
            values = self.randomize(seed * 100_000 + k)
            self.step(k * period, period)
            yield k, values


def _same(a: Any, b: Any) -> bool:
    return np.array_equal(np.asarray(a, float), np.asarray(b, float), equal_nan=True)


def _random(rng: np.random.Generator, variable: BlockVariable, scale: float) -> Any:
    if variable.type == "Boolean":
        return rng.random(variable.shape or None) < 0.5
    if variable.type == "Enumeration":
        return rng.integers(1, len(variable.enumeration) + 1, variable.shape or None)
    low, high = variable.minimum, variable.maximum
    if variable.type == "Int32":
        return rng.integers(
            -5 if low is None else low, (5 if high is None else high) + 1, variable.shape or None
        )
    return rng.uniform(
        -scale if low is None else low, scale if high is None else high, variable.shape or None
    )


@pytest.fixture(autouse=True)
def forked_front_end(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fork front ends from a process that has imported rumoca, except in the tests of their
    processes.
    """
    if request.path.stem != "test_frontend_process":
        monkeypatch.setattr(rumoca_client, "_run_process", run_forked)


@pytest.fixture
def write_model(tmp_path: Path) -> Callable[[str], Path]:
    """Return a function that writes Modelica text to a file with the name of its last class."""

    def write_file(text: str) -> Path:
        path = tmp_path / f"{text.rsplit('end ', 1)[1].split(';')[0]}.mo"
        path.write_text(text)
        return path

    return write_file


@pytest.fixture
def compile_both(
    tmp_path: Path, write_model: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> Callable[..., CompiledAndInterpreted]:
    """Return a function that compiles and interprets a model, given as text or as a file.

    Front end and analysis, which take most of the time, run once for both.
    """

    if shutil.which("gcc") is None:
        pytest.skip("needs gcc")

    def open_model(source: str | Path, model: str | None = None) -> CompiledAndInterpreted:
        path = write_model(source) if isinstance(source, str) else source
        folder = tmp_path / "c" / path.stem
        folder.mkdir(parents=True)
        with monkeypatch.context() as patch:
            analysed = assemble.analyse_file(path, model)
            patch.setattr(assemble, "analyse_file", lambda *_arguments: analysed)
            return CompiledAndInterpreted(
                CompiledBlock(load_block(path, model), folder), load_interpreter(path, model)
            )

    return open_model
