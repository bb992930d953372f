"""`cosim init`: a new project with a controller, a scenario, its reference, tests and CI."""

import json
import shlex
import shutil
from collections.abc import Mapping
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

import click

from ...core import __version__, resources
from ...core.errors import abbreviate_names
from ...studies.regression import Regression
from ..options import PATH, flag_option, refuse_existing

_TEMPLATES = Path(__file__).parents[1] / "templates"
#: template of each file of a new project
_PROJECT_FILES = {
    "README.md": _TEMPLATES / "project/README.md",
    "requirements.txt": _TEMPLATES / "project/requirements.txt",
    "pytest.ini": _TEMPLATES / "project/pytest.ini",
    ".gitignore": _TEMPLATES / "project/gitignore",
    ".github/workflows/ci.yml": _TEMPLATES / "project/ci.yml",
    "controllers/speed_keeper.py": _TEMPLATES / "project/speed_keeper.py",
    "scenarios/course.json": _TEMPLATES / "project/course.json",
    "scenarios/pictures.py": _TEMPLATES / "vessel_autopilot/pictures.py",
    "tests/test_controller.py": _TEMPLATES / "project/test_controller.py",
}
_PLANT = "fmus/strider.fmu"


@click.command()
@click.argument("directory", type=PATH)
@flag_option("--force", help="Overwrite existing files.")
def command(directory: Path, force: bool) -> int:
    """Create a project in DIRECTORY with a controller, a scenario, its reference, tests and CI.

    Runs the scenario to write the reference. The new project passes its tests.
    """
    refuse_existing((directory / name for name in (*_PROJECT_FILES, _PLANT)), force)
    untouched = _other_entries(directory)
    _write_project(directory)
    if untouched:
        click.echo(f"left as they are: {abbreviate_names(untouched)}")
    scenario = directory / "scenarios/course.json"
    outcome = Regression(scenario, directory / "runs/course", update=True).run()
    for folder in {(directory / name).parent for name in _PROJECT_FILES}:
        shutil.rmtree(folder / "__pycache__", ignore_errors=True)
    if outcome.code:
        click.echo("\n".join([f"course: {outcome.summary}", *outcome.details]), err=True)
        return outcome.code
    click.echo(f"{directory / 'scenarios/references/course.csv'}\n\nNext:")
    commands = (
        "pip install -r requirements.txt",
        "cosim run scenarios/course.json",
        "cosim regress",
        "python -m pytest",
    )
    click.echo("\n".join(f"  {line}" for line in (f"cd {shlex.quote(str(directory))}", *commands)))
    return 0


def _other_entries(directory: Path) -> list[str]:
    """Return the files and folders beside those of the project, in the same folders."""
    own = {Path(name) for name in (*_PROJECT_FILES, _PLANT)}
    folders: set[Path] = set()
    for path in own:
        folders.update(path.parents)
    others = []
    for folder in sorted(folders):
        if not (directory / folder).is_dir():
            continue
        for path in sorted((directory / folder).iterdir()):
            name = path.relative_to(directory)
            if name not in own | folders:
                others.append(f"{name.as_posix()}{'/' if path.is_dir() else ''}")
    return others


def _write_project(directory: Path) -> None:
    from ...results.files import write_file

    placeholders = {
        "README.md": ("NAME", directory.resolve().name),
        "requirements.txt": ("COSIM", pip_requirement(pip_origin())),
    }
    for file, template in _PROJECT_FILES.items():
        path = directory / file
        text = template.read_text(encoding="utf-8")
        write_file(path, text.replace(*placeholders[file]) if file in placeholders else text)
        click.echo(path)
    plant = directory / _PLANT
    write_file(plant, (resources.root() / _PLANT).read_bytes())
    click.echo(plant)


def pip_origin() -> Mapping[str, Any] | None:
    """Return the origin of the installed cosim from its direct_url.json (PEP 610).

    None if it is from an index.
    """
    texts = (
        distribution.read_text("direct_url.json")
        for distribution in distributions(name="fmi-cosim")
    )
    return next(
        (json.loads(text) for text in texts if text), None
    )  # a checkout is a second distribution, without origin


def pip_requirement(source: Mapping[str, Any] | None) -> str:
    """Return the line of requirements.txt by which pip installs the same cosim again."""
    if source is None:
        return f"fmi-cosim=={__version__}"
    url = source["url"]
    if vcs := source.get("vcs_info"):
        return f"fmi-cosim @ {vcs['vcs']}+{url}@{vcs['commit_id']}"
    return f"-e {url}" if source.get("dir_info", {}).get("editable") else f"fmi-cosim @ {url}"
