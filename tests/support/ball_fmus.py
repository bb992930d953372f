"""Model Exchange FMUs for tests: a lag, a bouncing ball and a counter
(tests/components/fmi/model_exchange/ball.c).
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from zipfile import ZipFile

import fmpy
import pytest

SOURCE = Path(__file__).parents[1] / "components/fmi/model_exchange/ball.c"
HEADERS = Path(fmpy.__file__).parent / "c-code"

#: name -> value reference, type, further attributes in the words of FMI 3.0
VARIABLES: dict[str, tuple[int, str, str]] = {
    "u": (0, "Float64", 'causality="input" start="0"'),
    "x": (1, "Float64", 'causality="output" initial="exact" start="1"'),
    "der(x)": (2, "Float64", 'causality="local" derivative="1"'),
    "h": (3, "Float64", 'causality="output" initial="exact" start="1"'),
    "der(h)": (4, "Float64", 'causality="local" derivative="3"'),
    "v": (5, "Float64", 'causality="output" initial="exact" start="0"'),
    "der(v)": (6, "Float64", 'causality="local" derivative="5"'),
    "restitution": (7, "Float64", 'causality="parameter" variability="tunable" start="0.7"'),
    "time": (8, "Float64", 'causality="independent"'),
    "i_in": (10, "Int32", 'causality="input" variability="discrete" start="0"'),
    "i_out": (11, "Int32", 'causality="output" variability="discrete"'),
    "count": (12, "Int32", 'causality="output" variability="discrete"'),
    "last_count": (13, "Int32", 'causality="parameter" variability="fixed" start="1000"'),
    "fault": (14, "Int32", 'causality="parameter" variability="fixed" start="0"'),
}
_FMI2_TYPES = {"Float64": "Real", "Int32": "Integer"}
_FMI2_ONLY = ("start", "derivative")


def model_description(version: int) -> str:
    """Return modelDescription.xml of the FMU for an FMI major version."""
    lines = list(_variables_2() if version == 2 else _variables_3())
    flags = f'modelIdentifier="ball" canGetAndSetFMU{"state" if version == 2 else "State"}="true"'
    token = (
        'guid="ball" numberOfEventIndicators="1"' if version == 2 else 'instantiationToken="ball"'
    )
    completes = "" if version == 2 else ' needsCompletedIntegratorStep="true"'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<fmiModelDescription fmiVersion="{version}.0" '
        f'modelName="Ball" {token}>\n'
        f"<ModelExchange {flags}{completes}/>\n"
        '<DefaultExperiment startTime="0" stopTime="2" stepSize="0.01" tolerance="1e-8"/>\n'
        f"<ModelVariables>\n{chr(10).join(lines)}\n</ModelVariables>\n"
        f"<ModelStructure>{_structure(version)}</ModelStructure>\n"
        "</fmiModelDescription>\n"
    )


def _variables_2() -> Iterator[str]:
    names = list(VARIABLES)
    references = {reference: index for index, (reference, _, _) in enumerate(VARIABLES.values(), 1)}
    for name in names:
        reference, kind, text = VARIABLES[name]
        attributes = dict(pair.split("=") for pair in text.split())
        if "derivative" in attributes:
            attributes["derivative"] = (
                f'"{references[int(attributes["derivative"].strip(chr(34)))]}"'
            )
        inner = " ".join(f"{key}={value}" for key, value in attributes.items() if key in _FMI2_ONLY)
        outer = " ".join(
            f"{key}={value}" for key, value in attributes.items() if key not in _FMI2_ONLY
        )
        yield (
            f'<ScalarVariable name="{name}" valueReference="{reference}" '
            f"{outer}><{_FMI2_TYPES[kind]} {inner}/></ScalarVariable>"
        )


def _variables_3() -> Iterator[str]:
    for name, (reference, kind, text) in VARIABLES.items():
        yield f'<{kind} name="{name}" valueReference="{reference}" {text}/>'


def _variables_1() -> Iterator[str]:
    for name, (reference, kind, text) in VARIABLES.items():
        attributes = dict(pair.split("=") for pair in text.split())
        causality = {
            '"parameter"': '"internal"',
            '"local"': '"internal"',
            '"independent"': '"none"',
        }.get(attributes["causality"], attributes["causality"])
        variability = (
            '"parameter"'
            if attributes["causality"] == '"parameter"'
            else attributes.get("variability", '"continuous"')
        )
        start = f" start={attributes['start']}" if "start" in attributes else ""
        yield (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality={causality} '
            f"variability={variability}>"
            f"<{_FMI2_TYPES[kind]}{start}/></ScalarVariable>"
        )
    yield (
        '<ScalarVariable name="minus_x" valueReference="1" causality="output" '
        'alias="negatedAlias"><Real/></ScalarVariable>'
    )


def description_1(interface: str) -> str:
    """Return modelDescription.xml of the FMI 1.0 FMU for "ME" or "CS"."""
    capabilities = (
        "<CoSimulation_StandAlone><Capabilities "
        'canHandleVariableCommunicationStepSize="true"/></CoSimulation_StandAlone>'
    )
    implementation = f"<Implementation>{capabilities}</Implementation>" if interface == "CS" else ""
    return (
        '<?xml version="1.0" encoding="ISO-8859-1"?>\n<fmiModelDescription fmiVersion="1.0" '
        'modelName="Ball" '
        'modelIdentifier="ball" guid="ball" numberOfContinuousStates="3" '
        'numberOfEventIndicators="1">\n'
        '<DefaultExperiment startTime="0" stopTime="2" tolerance="1e-8"/>\n'
        f"<ModelVariables>\n{chr(10).join(_variables_1())}\n</ModelVariables>\n"
        f"{implementation}</fmiModelDescription>\n"
    )


def _structure(version: int) -> str:
    indices = {name: index for index, name in enumerate(VARIABLES, 1)}
    outputs = [name for name, (_, _, text) in VARIABLES.items() if "output" in text]
    derivatives = [name for name in VARIABLES if name.startswith("der(")]
    if version == 3:
        lines = [f'<Output valueReference="{VARIABLES[name][0]}"/>' for name in outputs]
        return "".join(
            [
                *lines,
                *(
                    f'<ContinuousStateDerivative valueReference="{VARIABLES[name][0]}"/>'
                    for name in derivatives
                ),
            ]
        )
    groups = {"Outputs": outputs, "Derivatives": derivatives}
    text = ""
    for group, names in groups.items():
        unknowns = "".join(f'<Unknown index="{indices[name]}"/>' for name in names)
        text += f"<{group}>{unknowns}</{group}>"
    return text


def build_ball_fmu(version: int, folder: Path, interface: str = "ME") -> Path:
    """Build the FMU of an FMI major version; only that of FMI 1.0 has the interface "CS"."""
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library, target = folder / f"ball{version}.so", folder / f"ball{version}{interface}.fmu"
    options = ["-shared", "-fPIC", "-O0", f"-DFMI={version}", f"-I{HEADERS}"]
    subprocess.run([compiler, *options, SOURCE, "-o", library, "-lm"], check=True)
    with ZipFile(target, "w") as archive:
        archive.writestr(
            "modelDescription.xml",
            description_1(interface) if version == 1 else model_description(version),
        )
        archive.write(
            library, f"binaries/{fmpy.platform_tuple if version == 3 else fmpy.platform}/ball.so"
        )
    return target


@pytest.fixture(scope="session")
def balls(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """Paths of the FMUs by FMI major version."""
    folder = tmp_path_factory.mktemp("balls")
    return {version: build_ball_fmu(version, folder) for version in (1, 2, 3)}


@pytest.fixture(params=[1, 2, 3], ids=["FMI1", "FMI2", "FMI3"])
def ball(request: pytest.FixtureRequest, balls: dict[int, Path]) -> Path:
    """Path of the FMU, for each FMI version."""
    path: Path = balls[request.param]
    return path
