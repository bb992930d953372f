"""`cosim new`: a controller with a scenario in which it runs, a scenario, or a vehicle."""

import json
import keyword
import re
import shlex
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import click

from ...core import resources
from ...core.errors import InputError, Problem, did_you_mean
from ..options import flag_option, new_file_options, refuse_existing
from .new_vehicle import vehicle

TEMPLATES = Path(__file__).parents[1] / "templates"
_MODELICA_TYPES = ("Real", "Integer", "Boolean", "String")
_FIGURES_FILE = "pictures.py"
#: text in the tests that stands for the name of the controller
_TEST_NAME = "CONTROLLER"


@dataclass(frozen=True, slots=True)
class Role:
    """Template of the controllers of a role: its folder below `TEMPLATES` has the name of the role.

    Attributes:
        snake: name of the controller in the template, in files and scenarios; the new controller's
            name replaces it.
        camel: the same name as a class.
        plants: FMUs of the plant in the scenario.
    """

    snake: str
    camel: str
    plants: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Language:
    """Language of a controller; in the texts, SNAKE and CAMEL stand for its names.

    Attributes:
        key: key of the component's source in a scenario.
        component: value of that key.
        source: source for `cosim build`.
        shared: folder below `TEMPLATES` with the files of all roles.
    """

    key: str
    component: str
    source: str
    shared: str = "."


ROLES = {
    "vessel_autopilot": Role("waypoint_follower", "WaypointFollower", ("fmus/strider.fmu",)),
    "uav_controller": Role(
        "deck_follower", "DeckFollower", ("fmus/ar_drone.fmu", "fmus/strider.fmu")
    ),
}
#: role of a controller from a Modelica library (`--library`)
LIBRARY_ROLE = "vessel_speed"
_ALL_ROLES = ROLES | {
    LIBRARY_ROLE: Role(
        "speed_pid", "SpeedPid", ("fmus/waypoint_guidance.fmu", "fmus/heading_controller.fmu")
    )
}
LANGUAGES = {
    "python": Language("python", "SNAKE.py:CAMEL", "SNAKE.py"),
    "modelica": Language("modelica", "CAMEL.mo:CAMEL", "CAMEL.mo"),
    "c": Language("fmu", "SNAKE.fmu", ".", "c"),
}


@click.group()
def command() -> None:
    """Create a controller with a scenario in which it runs, a scenario, or a vehicle."""


command.add_command(vehicle)


@command.command()
@click.argument("name")
@click.option("--language", help=f"Language of the controller: {', '.join(LANGUAGES)}.")
@click.option(
    "--role",
    default=next(iter(ROLES)),
    show_default=True,
    help=f"Role, which determines the variables: {', '.join(ROLES)}.",
)
@flag_option(
    "--library",
    help=(
        "With --language modelica: a speed controller of a vessel around the Standard Library's "
        "LimPID."
    ),
)
@new_file_options("folder")
def controller(
    name: str, language: str | None, role: str, library: bool, directory: Path, force: bool
) -> None:
    """Create the folder NAME with a controller, a scenario in which it runs, and a test.

    A vessel_autopilot passes waypoints. A uav_controller is a quadcopter controller that follows
    the deck of a vessel. The scenario checks it. Change the controller and run the scenario again.
    """
    if language is None:
        raise click.UsageError(f"Missing option '--language': {', '.join(LANGUAGES)}")
    for kind, chosen, known in (("language", language, LANGUAGES), ("role", role, ROLES)):
        if chosen not in known:
            raise InputError(
                f'there is no template for the {kind} "{chosen}"{did_you_mean(chosen, known)}'
            )
    if library and language != "modelica":
        raise InputError(f"--library needs --language modelica, found --language {language}")
    role = LIBRARY_ROLE if library else role
    names, texts = _controller_files(name, role, language)
    folder = directory / names["SNAKE"]
    if folder.is_file():
        raise InputError(Problem("is a file, expected the name of a new folder", str(folder)))
    _write_files(
        {folder / file: text for file, text in texts.items()},
        [folder / plant for plant in _ALL_ROLES[role].plants],
        force,
    )
    _print_next_steps(LANGUAGES[language], folder, names)


def _controller_files(name: str, role: str, language: str) -> tuple[dict[str, str], dict[str, str]]:
    """Return the names of a controller (SNAKE and CAMEL) and the texts of its files."""
    template, chosen = _ALL_ROLES[role], LANGUAGES[language]
    texts = _read_texts(TEMPLATES / role / language) | _read_texts(TEMPLATES / chosen.shared)
    test = texts.pop("test_controller.py")
    names = _controller_names(name, template, texts.values())
    replaced = {template.snake: names["SNAKE"], template.camel: names["CAMEL"]}
    files = {
        _substitute(file, replaced): _substitute(text, replaced) for file, text in texts.items()
    }
    source = {"SOURCE": chosen.key, "FILE": _substitute(chosen.component, names)}
    files[f"{names['SNAKE']}.json"] = _substitute(
        (TEMPLATES / role / "scenario.json").read_text(), replaced | source
    )
    files[f"test_{names['SNAKE']}.py"] = _substitute(test, {_TEST_NAME: names["SNAKE"]})
    if (TEMPLATES / role / _FIGURES_FILE).exists():
        files[_FIGURES_FILE] = (TEMPLATES / role / _FIGURES_FILE).read_text()
    return names, files


def _read_texts(folder: Path) -> dict[str, str]:
    """Return the texts of a folder's files by file name."""
    return {path.name: path.read_text() for path in sorted(folder.iterdir()) if path.is_file()}


def _controller_names(name: str, template: Role, texts: Iterable[str]) -> dict[str, str]:
    """Return the names of the controller.

    Raise InputError if a language does not allow one of them.
    """
    from ...export.fmu_sources import snake_case

    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
        raise InputError(
            f'"{name}" is not a valid name of a controller: expected a letter, then letters, '
            "digits and underscores"
        )
    snake = snake_case(name)
    camel = "".join(word[:1].upper() + word[1:] for word in snake.split("_"))
    taken = {*_MODELICA_TYPES, *re.findall(r"\w+", "\n".join(texts))} - {template.camel}
    modules = {*sys.stdlib_module_names, "pythonfmu", Path(_FIGURES_FILE).stem}
    if camel in taken or snake in modules or keyword.iskeyword(snake) or keyword.iskeyword(camel):
        raise InputError(f'"{name}" is already used for something else; choose another name')
    return {"SNAKE": snake, "CAMEL": camel}


def _substitute(text: str, names: Mapping[str, str]) -> str:
    return re.sub("|".join(names), lambda match: names[match[0]], text)


def _write_files(files: Mapping[Path, str], plants: Iterable[Path], force: bool) -> None:
    from ...results.files import write_file

    refuse_existing((*files, *plants), force)
    for path, text in files.items():
        write_file(path, text)
        click.echo(path)
    for plant in plants:
        write_file(plant, (resources.root() / "fmus" / plant.name).read_bytes())
        click.echo(plant)


def _print_next_steps(language: Language, folder: Path, names: Mapping[str, str]) -> None:
    name = names["SNAKE"]
    run = shlex.join(["cosim", "run", str(folder / f"{name}.json")])
    source, fmu = folder / _substitute(language.source, names), folder / f"{name}.fmu"
    build = shlex.join(["cosim", "build", str(source), "--output", str(fmu)])
    click.echo(
        f"\nBuild and run it:\n  {build}\n  {run}"
        if language.key == "fmu"
        else f"\nRun it:\n  {run}\nAs an FMU:\n  {build}"
    )


@command.command()
@click.argument("name")
@click.option(
    "--from",
    "base",
    required=True,
    metavar="SCENARIO",
    help="Scenario file, or name of a shipped scenario.",
)
@new_file_options()
def scenario(name: str, base: str, directory: Path, force: bool) -> None:
    """Create NAME.json, a scenario that extends SCENARIO.

    It runs at once; add the keys that differ.

    A shipped scenario is extended by its name, so that the new file runs wherever cosim is
    installed.
    """
    from ...results.files import write_file
    from ...scenario.file_paths import find_scenario
    from ...scenario.nested_systems import extending_scenario, load_scenario
    from ...scenario.schema import SCENARIO_NAME

    if not re.match(SCENARIO_NAME, name):
        raise InputError(
            f'"{name}" is not a name of a scenario: expected letters, digits, "_", ".", "-" and '
            "spaces"
        )
    file, found = directory / f"{name}.json", find_scenario(base)
    refuse_existing([file], force)
    if problems := load_scenario(found).problems:
        raise InputError(problems)
    content = extending_scenario(base, directory, name, f"{found.stem} with changes")
    write_file(file, json.dumps(content, indent=1) + "\n")
    path = shlex.quote(str(file))
    click.echo(
        f"{file}\n\nPrint all keys that it can change:\n  cosim check {path} --expanded\nRun it:\n "
        f" cosim run {path}"
    )
