"""cosim from a wheel in its own environment, where the plant is a package like any other."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from collections.abc import Callable
from pathlib import Path

import pytest

from cosim.core import resources

ROOT = resources.root()
#: what a wheel is built from
SOURCES = (
    *("cosim", "controllers", "fmus", "plant_src", "scenarios"),
    *("pyproject.toml", "setup.py", "README.md", "LICENSE", "MANIFEST.in"),
)

Run = Callable[..., str]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A function that runs a program of an environment with the wheel, in an empty folder."""
    folder = tmp_path_factory.mktemp("wheel")
    (source := folder / "source").mkdir()
    ignored = shutil.ignore_patterns("__pycache__", "*.so")
    for name in SOURCES:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, source / name, ignore=ignored)
        else:
            shutil.copy(ROOT / name, source)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    built = subprocess.run(
        [*pip, "wheel", "-q", "--no-deps", "-w", str(folder), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    if "No matching distribution found for setuptools" in built.stderr:
        pytest.skip("building a wheel needs a package index")
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("*.whl")
    environment = folder / "environment"
    venv.create(environment)
    variables = {"base": str(environment), "platbase": str(environment)}
    packages = Path(sysconfig.get_path("purelib", "venv", vars=variables))
    # the dependencies of this environment, without its editable cosim, which its own .pth file adds
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    python = environment / "bin" / "python"
    install = [*pip, "--python", str(python), "install", "-q", "--no-deps", str(wheel)]
    subprocess.run(install, check=True)
    (work := folder / "work").mkdir()
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}

    def run_program(*command: str) -> str:
        program = [str(python), *command]
        if command[0] == "cosim":
            program = [str(environment / "bin" / "cosim"), *command[1:]]
        done = subprocess.run(
            program, cwd=work, env=clean, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run_program


SAME_CLASS = """
import gc
import cosim
from plant_src.world import World

assert "site-packages" in cosim.__file__, cosim.__file__
with cosim.load("demo1_box") as simulation:
    simulation.step()
    (world,) = [found for found in gc.get_objects() if type(found).__name__ == "World"]
    assert isinstance(world, World), type(world).__module__
print(World.__module__)
"""


def test_the_component_of_a_run_is_an_instance_of_the_imported_class(run: Run) -> None:
    assert run("-c", SAME_CLASS) == "plant_src.world\n"


def test_shipped_scenarios_run(run: Run) -> None:
    assert "5 of 5 checks passed" in run("cosim", "run", "demo1_box", "--no-report")


OWN_COPY = """
import shutil
from pathlib import Path
import cosim
import plant_src.world
from cosim.components.python_import import load_object

shipped = Path(plant_src.world.__file__).parent
shutil.copytree(shipped, "own/plant_src", dirs_exist_ok=True)
own = load_object("own/plant_src/world.py:World", Path())
assert not issubclass(own, plant_src.world.World)
scenario = {"name": "own", "extends": "cosim:scenarios/demo1_box.json", "stop_time": 1}
scenario["components"] = {"plant": {"python": "own/plant_src/world.py:World"}}
cosim.run(scenario)
print(own.__module__)
"""


def test_a_copy_of_the_plant_elsewhere_works_beside_it(run: Run) -> None:
    assert run("-c", OWN_COPY).startswith("_cosim_")


def test_a_vehicle_file_becomes_an_fmu(run: Run) -> None:
    text = run("cosim", "new", "vehicle", "own", "--from", "x500")
    assert "own.json" in text
    assert "own.fmu" in run("cosim", "build", "own.json", "--output", "own.fmu")
    assert "rotor_speed" in run("cosim", "info", "own.fmu")


def test_a_sweep_runs_in_parallel(run: Run) -> None:
    seed = "/components/plant/arguments/environment/seed"
    factors = [{"name": "noise", "levels": {"first": {seed: 1}, "second": {seed: 2}}}]
    sweep = {"name": "seeds", "scenario": "demo1_box", "factors": factors}
    code = f"from pathlib import Path; Path('sweep.json').write_text({json.dumps(sweep)!r})"
    run("-c", code)
    run("cosim", "sweep", "sweep.json", "--workers", "2", "--output-dir", "sweep")
