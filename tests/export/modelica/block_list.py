"""Generation of docs/modelica_blocks.md: the state of each public block of the Modelica Standard
Library.

`MODELICAPATH=... python tests/export/modelica/block_list.py` flattens, translates and compiles
every block of `Modelica.Blocks`. This takes about 5 s for each block that the cache does not
contain.
"""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import date
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory

from cosim.core.errors import CosimError
from cosim.export.fmu.package import write_fmu
from cosim.export.modelica import load_block
from cosim.export.modelica.frontend.libraries import Library, find_libraries, library_folders

PAGE = Path(__file__).parents[3] / "docs" / "modelica_blocks.md"
PACKAGE = "Modelica.Blocks"
_INTERNAL = {"Examples", "Internal", "Icons"}

_TABLE = "table=[0, 0; 1, 2]"
_TABLE_2D = "table=[0, 0, 1; 0, 1, 2; 1, 3, 4]"
_SAMPLED = "samplePeriod=0.1"
_TWO = "nu=2"
#: modifiers of blocks without usable default parameters
ARGUMENTS = {
    "Continuous.Filter": "f_cut=2",
    "Continuous.LimPID": "yMax=1",
    "Discrete.FirstOrderHold": _SAMPLED,
    "Discrete.Sampler": _SAMPLED,
    "Discrete.StateSpace": f"{_SAMPLED}, A=[0.5], B=[1], C=[1], D=[0]",
    "Discrete.TransferFunction": f"{_SAMPLED}, b={{1}}, a={{1, 0.5}}",
    "Discrete.UnitDelay": _SAMPLED,
    "Discrete.ZeroOrderHold": _SAMPLED,
    "Math.Harmonic": "f=50, k=1",
    "Math.Mean": "f=50",
    "Math.MinMax": _TWO,
    "Math.MultiSwitch": _TWO + ", expr={1, 2}",
    "Math.RealFFT": "f_max=4, f_res=0.2",
    "Math.RectifiedMean": "f=50",
    "Math.RootMeanSquare": "f=50",
    "Math.SignalExtrema": _SAMPLED,
    "Math.TotalHarmonicDistortion": "f=50",
    "MathBoolean.And": _TWO,
    "MathBoolean.MultiSwitch": _TWO + ", expr={true, false}",
    "MathBoolean.Nand": _TWO,
    "MathBoolean.Nor": _TWO,
    "MathBoolean.OnDelay": "delayTime=0.1",
    "MathBoolean.Or": _TWO,
    "MathBoolean.Xor": _TWO,
    "MathInteger.MultiSwitch": _TWO + ", expr={1, 2}",
    "Noise.BandLimitedWhiteNoise": _SAMPLED,
    "Noise.NormalNoise": f"{_SAMPLED}, mu=0, sigma=1",
    "Noise.TruncatedNormalNoise": f"{_SAMPLED}, y_min=-1, y_max=1",
    "Noise.UniformNoise": f"{_SAMPLED}, y_min=-1, y_max=1",
    "Nonlinear.FixedDelay": "delayTime=0.1",
    "Nonlinear.PadeDelay": "delayTime=0.1",
    "Nonlinear.VariableDelay": "delayMax=0.1",
    "Sources.BooleanPulse": "period=1",
    "Sources.CombiTimeTable": _TABLE,
    "Sources.IntegerTable": _TABLE,
    "Sources.RadioButtonSource": "buttonTimeTable={1, 2}",
    "Sources.SampleTrigger": "period=0.1",
    "Sources.TimeTable": _TABLE,
    "Tables.CombiTable1Ds": _TABLE,
    "Tables.CombiTable1Dv": _TABLE,
    "Tables.CombiTable2Ds": _TABLE_2D,
    "Tables.CombiTable2Dv": _TABLE_2D,
}
#: inputs of blocks with pre(), edge() or change() of an input, which the front end refuses for
#: inputs of the model itself, or with an input that has a value; such a block is a component, and
#: an equation sets each of its
#: inputs
INPUTS = {
    "Discrete.UnitDelay": ("Real u",),
    "Interaction.Show.BooleanValue": ("Boolean activePort",),
    "Interaction.Show.IntegerValue": ("Integer numberPort",),
    "Logical.Change": ("Boolean u",),
    "Logical.Edge": ("Boolean u",),
    "Logical.Pre": ("Boolean u",),
    "Logical.RSFlipFlop": ("Boolean S", "Boolean R"),
    "Logical.ZeroCrossing": ("Boolean enable", "Real u"),
    "Math.BooleanChange": ("Boolean u",),
    "Math.ContinuousSignalExtrema": ("Real u",),
    "Math.Edge": ("Boolean u",),
    "Math.IntegerChange": ("Integer u",),
    "MathBoolean.ChangingEdge": ("Boolean u",),
    "MathBoolean.OnDelay": ("Boolean u",),
    "MathBoolean.RisingEdge": ("Boolean u",),
    "Routing.Extractor": ("Integer index", "Real u[1]"),
    "Sources.RadioButtonSource": ("Boolean reset[1]",),
}
#: further declarations and the equations of blocks that are only determined together with other
#: blocks
CIRCUITS = {
    "Math.InverseBlockConstraints": (
        "Modelica.Blocks.Math.Gain g(k=2); equation b.u1 = u; g.u = b.y2; b.u2 = g.y;"
    ),
}

_TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"', re.DOTALL)
_CLASS = re.compile(
    r"(?P<partial>\bpartial\s+)?"
    r"\b(?P<kind>block|model|package|function|record|connector|type|class)\s+"
    r"(?P<name>[A-Za-z_]\w*)"
    r"(?P<short>\s*=)?|\bend\s+(?P<end>[A-Za-z_]\w*)\s*;"
)
_WITHIN = re.compile(r"\bwithin\s+([\w.]*)\s*;")


@dataclass(frozen=True)
class State:
    """Result of building a block; `reason` is "" if it builds."""

    block: str
    reason: str


def public_blocks(library: Library) -> list[str]:
    """Return the names, below PACKAGE, of all blocks that are neither partial nor in internal
    packages.
    """
    files = [file for file in library.files if file.suffix == ".mo"]
    names = chain.from_iterable(map(_blocks_in, files))
    return sorted(
        name.removeprefix(f"{PACKAGE}.") for name in names if name.startswith(f"{PACKAGE}.")
    )


def _blocks_in(file: Path) -> Iterator[str]:
    text = _TEXT.sub(" ", file.read_text(encoding="utf-8"))
    within = _WITHIN.search(text)
    outer = [*(within[1].split(".") if within else [])]
    stack: list[str] = []
    for match in _CLASS.finditer(text):
        if match["end"]:
            if stack and stack[-1] == match["end"]:
                stack.pop()
            continue
        path = [*outer, *stack, match["name"]]
        if match["kind"] == "block" and not match["partial"] and not _INTERNAL & set(path):
            yield ".".join(path)
        if not match["short"]:
            stack.append(match["name"])


def build(block: str, folder: Path) -> State:
    """Build a block with default parameters, or with ARGUMENTS, as an FMU."""
    name = "Use" + block.replace(".", "")
    path = folder / name / f"{name}.mo"
    path.parent.mkdir()
    path.write_text(_model(name, block))
    try:
        write_fmu(load_block(path), 3, path.with_suffix(".fmu"))
    except CosimError as error:
        return State(block, _shorten(str(error), folder))
    finally:
        shutil.rmtree(path.parent, ignore_errors=True)
    return State(block, "")


def _model(name: str, block: str) -> str:
    """Return the text of a model with the block."""
    arguments = f"({ARGUMENTS[block]})" if block in ARGUMENTS else ""
    if block in CIRCUITS:
        return f"block {name} input Real u; {PACKAGE}.{block} b; {CIRCUITS[block]} end {name};"
    if block not in INPUTS:
        return f"block {name}\n  extends {PACKAGE}.{block}{arguments};\nend {name};\n"
    inputs = [declaration.split() for declaration in INPUTS[block]]
    declarations = "".join(f"  {PACKAGE}.Interfaces.{kind}Input {port};\n" for kind, port in inputs)
    ports = [port.partition("[")[0] for _, port in inputs]
    equations = "".join(f"  b.{port} = {port};\n" for port in ports)
    return (
        f"block {name}\n{declarations}  {PACKAGE}.{block} b{arguments};\nequation\n{equations}end "
        f"{name};\n"
    )


def _shorten(message: str, folder: Path) -> str:
    """Return the first line of a message, with file names instead of paths."""
    line = message.strip().splitlines()[0]
    line = re.sub(rf"{re.escape(str(folder))}/\w+/(\w+\.mo)(:\d+)?", "", line)
    return re.sub(r"/\S*/", "", line).replace("|", "\\|").replace("[", "\\[").strip(" :")


def page(library: Library, states: Sequence[State]) -> str:
    """Return the text of the page."""
    good = [state for state in states if not state.reason]
    groups: dict[str, list[State]] = {}
    for state in states:
        groups.setdefault(state.block.partition(".")[0], []).append(state)
    lines = [
        "# Blocks of the Modelica Standard Library",
        "",
        f"State of each public block of `{PACKAGE}` in Modelica {library.version}, "
        f"{date.today().isoformat()}: "
        f"{len(good)} of {len(states)} blocks build.",
        "",
        (
            "A block builds if cosim exports an FMU of a model that extends it with default "
            "parameters or with those in parentheses."
        ),
        "Blocks with `pre()`, `edge()` or `change()` of an input, or with an input that has a "
        "value, are components `b` with an "
        "equation `b.u = u` for each input.",
        (
            "`InverseBlockConstraints` is built around a gain, because it is only determined "
            "together with another block."
        ),
        "[Modelica](modelica.md) explains what to write instead of blocks that do not build.",
        "",
        "This page is generated by `MODELICAPATH=... python tests/export/modelica/block_list.py`.",
    ]
    for group, members in groups.items():
        refused = [state for state in members if state.reason]
        lines += [
            "",
            f"## {group}",
            "",
            f"{len(members) - len(refused)} of {len(members)} blocks build: ",
        ]
        lines[-1] += (
            ", ".join(_entry(state.block, group) for state in members if not state.reason) + "."
        )
        if refused:
            lines += ["", "| block | reason |", "|---|---|"]
            lines += [f"| {_entry(state.block, group)} | {state.reason} |" for state in refused]
    return "\n".join(lines) + "\n"


def _entry(block: str, group: str) -> str:
    arguments = f"({ARGUMENTS[block]})" if block in ARGUMENTS else ""
    return f"`{block.removeprefix(f'{group}.')}{arguments}`"


def main() -> None:
    """Build all blocks and write the page."""
    with TemporaryDirectory(prefix="cosim-blocks-") as temporary:
        folder = Path(temporary)
        (folder / "Uses.mo").write_text(f"model Uses\n  {PACKAGE}.Math.Gain gain;\nend Uses;\n")
        libraries = find_libraries([folder / "Uses.mo"], library_folders([]), [])
        library = next(each for each in libraries if each.name == "Modelica")
        with ThreadPoolExecutor(int(os.environ.get("JOBS", "1"))) as pool:
            states = list(pool.map(lambda block: build(block, folder), public_blocks(library)))
    PAGE.write_text(page(library, states), encoding="utf-8")


if __name__ == "__main__":
    main()
