"""`cosim init`: a project of one's own, with everything that keeps a controller good."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path

import click

from .. import __version__, resources
from ..errors import InputError, Problem
from .regression import Regression

_TEMPLATES = Path(__file__).parents[1] / "templates"
#: file of a new project -> what it is made from
_FILES = {
    "README.md": _TEMPLATES / "project/README.md",
    "requirements.txt": _TEMPLATES / "project/requirements.txt",
    "pytest.ini": _TEMPLATES / "project/pytest.ini",
    ".gitignore": _TEMPLATES / "project/gitignore",
    ".github/workflows/ci.yml": _TEMPLATES / "project/ci.yml",
    "controllers/speed_keeper.py": _TEMPLATES / "python/speed_keeper.py",
    "scenarios/course.json": _TEMPLATES / "project/course.json",
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
    present = [directory / name for name in (*_FILES, _PLANT) if (directory / name).exists()]
    if present and not force:
        raise InputError([Problem("exists; --force overwrites it", str(path)) for path in present])
    _write(directory)
    outcome = Regression(directory / "scenarios/course.json", directory / "runs/course", update=True).outcome()
    if outcome.code:
        click.echo("\n".join([f"course: {outcome.summary}", *outcome.details]), err=True)
        return outcome.code
    click.echo(f"{directory / 'scenarios/references/course.csv'}\n\nNext:")
    click.echo(f"  cd {shlex.quote(str(directory))}\n  cosim run scenarios/course.json\n  cosim regress\n  pytest")
    return 0


def _write(directory: Path) -> None:
    name = directory.resolve().name
    for file, template in _FILES.items():
        path = directory / file
        text = template.read_text(encoding="utf-8").replace("NAME", name) if file == "README.md" else template.read_text("utf-8")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace("VERSION", __version__), encoding="utf-8")
        click.echo(path)
    plant = directory / _PLANT
    plant.parent.mkdir(exist_ok=True)
    shutil.copyfile(resources.root() / _PLANT, plant)
    click.echo(plant)
