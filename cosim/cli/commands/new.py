"""`cosim new`: a new controller with a scenario in which it runs."""

from __future__ import annotations

import keyword
import re
import shlex
import shutil
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean
from . import new_scenario

TEMPLATES = Path(__file__).parents[1] / "templates"
#: name of the controller in the templates, as a file and as a class; the new controller's name replaces it
_SNAKE, _CAMEL = "speed_keeper", "SpeedKeeper"
_MODELICA_TYPES = ("Real", "Integer", "Boolean", "String")
_FIGURES_FILE, _PLANT = "pictures.py", "fmus/strider.fmu"


@dataclass(frozen=True, slots=True)
class Language:
    """Template of a controller in one language.

    Attributes:
        folder: folder of the template.
        key: key of the component's source in a scenario.
        component: value of that key.
        source: source for `cosim build`.
    """

    folder: Path
    key: str
    component: str
    source: str


LANGUAGES = {
    "python": Language(TEMPLATES / "python", "python", f"{_SNAKE}.py:{_CAMEL}", f"{_SNAKE}.py"),
    "modelica": Language(TEMPLATES / "modelica", "modelica", f"{_CAMEL}.mo:{_CAMEL}", f"{_CAMEL}.mo"),
    "c": Language(resources.root() / "controllers/c" / _SNAKE, "fmu", f"{_SNAKE}.fmu", "."),
}


@click.group()
def command() -> None:
    """Create a controller with a scenario in which it runs, or a scenario."""


command.add_command(new_scenario.command, "scenario")


@command.command()
@click.argument("name")
@click.option("--language", required=True, help=f"Language of the controller: {', '.join(LANGUAGES)}.")
@click.option(
    "--directory",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Parent of the folder NAME; default: the working directory.",
)
@click.option("--force", is_flag=True, help="Overwrite existing files.")
def controller(name: str, language: str, directory: Path, force: bool) -> None:
    """Create the folder NAME with a vessel autopilot and a scenario in which it keeps a speed and a course.

    The scenario checks both. Change the controller and run the scenario again.
    """
    if language not in LANGUAGES:
        raise InputError(f'there is no language "{language}"{did_you_mean(language, LANGUAGES)}')
    chosen = LANGUAGES[language]
    template = _read_template(chosen)
    names = _template_names(name, template.values())
    folder = directory / names[_SNAKE]
    files = {folder / _substitute_names(file, names): _substitute_names(text, names) for file, text in template.items()}
    files[folder / f"{names[_SNAKE]}.json"] = _scenario_text(chosen, names)
    files[folder / _FIGURES_FILE] = (TEMPLATES / "vessel" / _FIGURES_FILE).read_text()
    _write_files(files, folder / _PLANT, force)
    _print_next_steps(chosen, folder, names)


def _read_template(language: Language) -> dict[str, str]:
    """Return the texts of a template's files by file name."""
    return {path.name: path.read_text() for path in sorted(language.folder.iterdir()) if path.is_file()}


def _template_names(name: str, texts: Iterable[str]) -> dict[str, str]:
    """Map names in the template to names of the controller; raise InputError if a language does not allow one of them."""
    from ...export.sources import snake_case

    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(f'"{name}" is not a valid name of a controller: expected a letter, then letters, digits and underscores')
    snake = snake_case(name)
    camel = "".join(word[:1].upper() + word[1:] for word in snake.split("_"))
    taken = {*_MODELICA_TYPES, *(word for text in texts for word in re.findall(r"\w+", text))} - {_CAMEL}
    modules = {*sys.stdlib_module_names, "pythonfmu", Path(_FIGURES_FILE).stem}
    if camel in taken or snake in modules or keyword.iskeyword(snake) or keyword.iskeyword(camel):
        raise InputError(f'"{name}" is already used for something else; choose another name')
    return {_SNAKE: snake, _CAMEL: camel}


def _substitute_names(text: str, names: Mapping[str, str]) -> str:
    return re.sub("|".join(names), lambda match: names[match[0]], text)


def _scenario_text(language: Language, names: Mapping[str, str]) -> str:
    placeholders = {"SOURCE": language.key, "FILE": _substitute_names(language.component, names)}
    return _substitute_names((TEMPLATES / "scenario.json").read_text(), {**names, **placeholders})


def _write_files(files: Mapping[Path, str], plant: Path, force: bool) -> None:
    present = [path for path in (*files, plant) if path.exists()]
    if present and not force:
        raise InputError([Problem("exists; --force overwrites it", str(path)) for path in present])
    for path, text in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        click.echo(path)
    plant.parent.mkdir(exist_ok=True)
    shutil.copyfile(resources.root() / _PLANT, plant)
    click.echo(plant)


def _print_next_steps(language: Language, folder: Path, names: Mapping[str, str]) -> None:
    name = names[_SNAKE]
    run = shlex.join(["cosim", "run", str(folder / f"{name}.json")])
    source, fmu = folder / _substitute_names(language.source, names), folder / f"{name}.fmu"
    build = shlex.join(["cosim", "build", str(source), "--output", str(fmu)])
    click.echo(
        f"\nBuild and run it:\n  {build}\n  {run}" if language.key == "fmu" else f"\nRun it:\n  {run}\nAs an FMU:\n  {build}"
    )
