"""`cosim init`: a project of one's own, with everything that keeps a controller good."""

from __future__ import annotations

import json
import shlex
import shutil
from collections.abc import Mapping
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import click

from ...core import resources
from ...core.errors import InputError, Problem
from ...core.version import __version__
from ...studies.regression import Regression

_TEMPLATES = Path(__file__).parents[1] / "templates"
#: file of a new project -> what it is made from
_PROJECT_FILES = {
    "README.md": _TEMPLATES / "project/README.md",
    "requirements.txt": _TEMPLATES / "project/requirements.txt",
    "pytest.ini": _TEMPLATES / "project/pytest.ini",
    ".gitignore": _TEMPLATES / "project/gitignore",
    ".github/workflows/ci.yml": _TEMPLATES / "project/ci.yml",
    "controllers/speed_keeper.py": _TEMPLATES / "python/speed_keeper.py",
    "scenarios/course.json": _TEMPLATES / "project/course.json",
    "scenarios/pictures.py": _TEMPLATES / "vessel/pictures.py",
    "tests/test_controller.py": _TEMPLATES / "project/test_controller.py",
}
_PLANT = "fmus/strider.fmu"


@click.command()
@click.argument("directory", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="Overwrite files.")
def command(directory: Path, force: bool) -> int:
    """Make a project in DIRECTORY that passes at once: a controller, a scenario, its reference, tests, a CI workflow.

    The reference is made by flying the scenario.
    """
    present = [directory / name for name in (*_PROJECT_FILES, _PLANT) if (directory / name).exists()]
    if present and not force:
        raise InputError([Problem("exists; --force overwrites it", str(path)) for path in present])
    _write_project(directory)
    outcome = Regression(directory / "scenarios/course.json", directory / "runs/course", update=True).run()
    if outcome.code:
        click.echo("\n".join([f"course: {outcome.summary}", *outcome.details]), err=True)
        return outcome.code
    click.echo(f"{directory / 'scenarios/references/course.csv'}\n\nNext:")
    commands = ("pip install -r requirements.txt", "cosim run scenarios/course.json", "cosim regress", "python -m pytest")
    click.echo("\n".join(f"  {line}" for line in (f"cd {shlex.quote(str(directory))}", *commands)))
    return 0


def _write_project(directory: Path) -> None:
    marks = {"README.md": ("NAME", directory.resolve().name), "requirements.txt": ("COSIM", pip_requirement(pip_origin()))}
    for file, template in _PROJECT_FILES.items():
        path = directory / file
        text = template.read_text(encoding="utf-8")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace(*marks[file]) if file in marks else text, encoding="utf-8")
        click.echo(path)
    plant = directory / _PLANT
    plant.parent.mkdir(exist_ok=True)
    shutil.copyfile(resources.root() / _PLANT, plant)
    click.echo(plant)


def pip_origin() -> Mapping[str, Any] | None:
    """Where pip got this cosim from, as its direct_url.json says (PEP 610); None when from an index, or not by pip."""
    found = (made.read_text("direct_url.json") for made in distributions(name="fmi-cosim"))  # a clone has a record of its own
    return next((json.loads(text) for text in found if text), None)


def pip_requirement(source: Mapping[str, Any] | None) -> str:
    """The line by which pip gets the same cosim again."""
    if source is None:
        return f"fmi-cosim=={__version__}"
    url = source["url"]
    if vcs := source.get("vcs_info"):
        return f"fmi-cosim @ {vcs['vcs']}+{url}@{vcs['commit_id']}"
    return f"-e {url}" if source.get("dir_info", {}).get("editable") else f"fmi-cosim @ {url}"
