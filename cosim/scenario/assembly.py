"""From a scenario to a system that can be simulated; everything that is wrong is collected and reported together."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..component import Component
from ..errors import InputError, Problem, did_you_mean
from ..python_component import load_object
from ..simulate import Event, Settings, problems
from ..system import Endpoint, Group, Stage, System
from ..table import read_table
from ..timing import exact
from .document import Document
from .names import Unknown, assign, resolve
from .schema import FunctionSpec, ScenarioSpec, kept
from .sources import Workshop
from .tree import Node, Scenario, load
from .wiring import Wiring

Function = tuple[str, Callable[..., Any], Mapping[str, Any]]

#: full name of the components made from input profiles: PROFILES.1, PROFILES.2, ...
PROFILES = "inputs"


@dataclass(frozen=True)
class Assembly:
    """A scenario ready to run. Its components live until `simulate` or `free`."""

    root: Node
    spec: ScenarioSpec
    system: System
    settings: Settings
    workshop: Workshop

    @property
    def document(self) -> Document:
        """The scenario file, with the changes from outside in its value."""
        return self.root.document

    @property
    def checks(self) -> list[dict[str, Any]]:
        """The scenario's checks as `cosim.kpi.evaluate_checks` takes them."""
        return [check.model_dump(exclude_none=True) for check in self.spec.checks]

    def kpis(self) -> list[Function]:
        """(name, function, arguments) of every KPI."""
        return self._functions(self.spec.kpis)

    def figures(self) -> list[Function]:
        """(name, function, arguments) of every figure."""
        return self._functions(self.spec.figures)

    def _functions(self, specs: Sequence[FunctionSpec]) -> list[Function]:
        return [(spec.name, load_object(spec.python, self.root.folder), spec.arguments) for spec in specs]

    def files(self) -> list[Path]:
        """The scenario, its nested systems and its FMUs."""
        return [*(node.document.file for node in self.root.walk()), *self.workshop.fmus]

    def origin(self, name: str) -> str:
        """Where a component comes from, in words."""
        for node in self.root.walk():
            for own, spec in node.spec.components.items():
                if node.full_name(own) == name:
                    return spec.fmu or spec.python or spec.modelica or ""
        return self.spec.inputs[int(name.rpartition(".")[2])].file

    def free(self) -> None:
        for component in self.system.components.values():
            component.free()


def assemble(scenario: str | Path, settings: Mapping[str, Any] | None = None) -> Assembly:
    """Read, wire and check a scenario; `settings` are changes from outside (see `tree.load`).

    Raises InputError with every problem found, each with file, line and JSON path.
    """
    loaded = load(scenario, settings)
    assembler = _Assembler(loaded)
    try:
        assembler.run()
        if assembler.problems:
            raise InputError(dict.fromkeys(assembler.problems))
    except BaseException:
        for component in assembler.components.values():
            component.free()
        raise
    return Assembly(loaded.root, loaded.spec, assembler.system, assembler.settings, assembler.workshop)


class _Assembler:
    """The steps of assembling, each adding to `problems`."""

    def __init__(self, scenario: Scenario):
        self.root, self.spec, self.outside = scenario.root, scenario.spec, scenario.assignments
        self.problems: list[Problem] = list(scenario.problems)
        self.workshop = Workshop()
        self.components: dict[str, Component] = {}
        self.start_values: dict[str, dict[str, Any]] = defaultdict(dict)

    def run(self) -> None:
        self._make_components()
        self._set_start_values()
        aliases = self._aliases()
        connections = list(self._connections())
        self.system = System(
            self.components,
            connections,
            (*self._stages(self.root), *([tuple(self.profiles)] if self.profiles else [])),
            dict(self._periods(self.root)),
            self.start_values,
            aliases,
        )
        self.settings = Settings(
            self.spec.start_time,
            self.spec.stop_time,
            self.spec.step_size,
            self._columns(aliases),
            self.spec.record.interval,
            list(self._events()),
        )
        self.problems += [self._located(problem) for problem in problems(self.system, self.settings)]
        self._check_functions()

    # -- components and their start values -----------------------------------------------------------------------------

    def _make_components(self) -> None:
        for node in self.root.walk():
            for name, component in node.spec.components.items():
                if component.system is not None or name in node.broken:
                    continue
                try:
                    self.components[node.full_name(name)] = self.workshop.make(node, name)
                except InputError as error:
                    node.broken.add(name)
                    self._report(error, node, "components", name)
        self.profiles = [f"{PROFILES}.{i}" for i, _ in kept(self.spec.inputs)]
        for i, spec in kept(self.spec.inputs):
            try:
                table = read_table(self.root.folder / spec.file, list(spec.to), spec.interpolation)
                self.components[f"{PROFILES}.{i}"] = table
            except InputError as error:
                self.profiles.remove(f"{PROFILES}.{i}")
                self._report(error, self.root, "inputs", i)

    def _set_start_values(self) -> None:
        """Nested systems first, so that outer values win; those from outside come last."""
        for node in self.root.walk():
            for name, spec in node.spec.components.items():
                for variable, value in spec.parameters.items():
                    where = node.where("components", name, "parameters", variable)
                    self._assign(self.start_values, node, f"{name}.{variable}", value, where)
        for name, value in self.outside.items():
            self._assign(self.start_values, self.root, name, value, f"--set {name}")

    def _assign(self, values: dict[str, dict[str, Any]], node: Node, name: str, value: Any, where: str) -> None:
        try:
            for target in resolve(node, name, ("parameters", "inputs"), hidden=True):
                if target.component in self.components:
                    component = self.components[target.component]
                    values[target.component] |= assign(target.component, component, target.prefix, value)
        except (Unknown, ValueError) as error:
            if str(error):
                self.problems.append(Problem(str(error), where))

    # -- wiring --------------------------------------------------------------------------------------------------------

    def _connections(self) -> Iterator[Any]:
        given = {
            Endpoint(name, slot)
            for name, values in self.start_values.items()
            for variable in self.components[name].variables
            if variable.name in values
            for slot in variable.slots
        }
        wiring = Wiring(self.components, given)
        for node in self.root.walk():
            wiring.connect(node)
        for i, spec in kept(self.spec.inputs):
            if f"{PROFILES}.{i}" in self.components:
                for column, names in spec.to.items():
                    for name in names:
                        where = self.root.where("inputs", i, "to", column)
                        wiring.feed(self.root, Endpoint(f"{PROFILES}.{i}", column), name, where)
        yield from wiring.connections()
        self.problems += wiring.problems

    def _stages(self, node: Node) -> tuple[Stage, ...]:
        """Names that mean nothing, stand twice or are missing are left to the system's own checks."""
        listed = node.spec.algorithm.stages if node.spec.algorithm else [[name] for name in node.spec.components]
        return tuple(tuple(self._member(node, name) for name in stage if name not in node.broken) for stage in listed if stage)

    def _member(self, node: Node, name: str) -> str | Group:
        if name in node.children:
            return Group(node.full_name(name), self._stages(node.children[name]))
        return node.full_name(name)

    def _periods(self, node: Node, inherited: Any = None) -> Iterator[tuple[str, Any]]:
        for name, spec in node.spec.components.items():
            period = spec.period or inherited
            if name in node.children:
                yield from self._periods(node.children[name], period)
            elif period and node.full_name(name) in self.components:
                yield node.full_name(name), period

    def _aliases(self) -> dict[str, Endpoint]:
        """Outputs of nested systems under the names of their ports."""
        aliases: dict[str, Endpoint] = {}
        for node in self.root.walk():
            for name, child in node.children.items():
                for port, inner in child.spec.ports.outputs.items():  # type: ignore[attr-defined]
                    try:
                        (target,) = resolve(child, inner, ("outputs",))
                    except Unknown as error:
                        if str(error):
                            self.problems.append(Problem(str(error), child.where("ports", "outputs", port)))
                        continue
                    aliases |= self._below(target.component, target.prefix, f"{node.full_name(name)}.{port}")
        return aliases

    def _below(self, component: str, prefix: str, alias: str) -> dict[str, Endpoint]:
        from .names import under

        if component not in self.components:
            return {}
        slots = under(self.components[component], prefix, "output")
        return {alias + rest: Endpoint(component, slot) for rest, slot in slots.items()}

    # -- what is recorded, set and computed ----------------------------------------------------------------------------

    def _columns(self, aliases: Mapping[str, Endpoint]) -> dict[str, Endpoint]:
        outputs: dict[str, Endpoint] = {}
        others: dict[str, Endpoint] = {}
        for name, component in self.components.items():
            for variable in component.variables:
                names = {f"{name}.{slot}": Endpoint(name, slot) for slot in variable.slots}
                (outputs if variable.causality == "output" else others).update(names if variable.causality != "input" else {})
        outputs |= aliases
        chosen: dict[str, Endpoint] = {}
        for i, pattern in enumerate(self.spec.record.signals):
            matches = _matching(pattern, outputs) or _matching(pattern, others)
            if not matches and not self._concerns_broken(pattern):
                where = self.root.where("record", "signals", i)
                self.problems.append(Problem(f'no output matches "{pattern}"{did_you_mean(pattern, outputs)}', where))
            chosen |= matches
        return {name: end for name, end in {**outputs, **others}.items() if name in chosen}

    def _concerns_broken(self, pattern: str) -> bool:
        """Whether a pattern may mean variables of a component that was refused."""
        head = pattern.partition("*")[0]
        broken = [node.full_name(name) for node in self.root.walk() for name in node.broken]
        return any(head.startswith(name) or name.startswith(head) for name in broken)

    def _events(self) -> Iterator[Event]:
        for i, spec in kept(self.spec.events):
            values: dict[str, dict[str, Any]] = defaultdict(dict)
            for name, value in spec.values.items():
                self._assign(values, self.root, name, value, self.root.where("events", i, "set", name))
            yield Event(spec.time, values, self.root.where("events", i))

    def _check_functions(self) -> None:
        for kind in ("kpis", "figures"):
            for i, spec in kept(getattr(self.spec, kind)):
                if text := _missing_function(spec, self.root.folder):
                    self.problems.append(Problem(text, self.root.where(kind, i, "python")))
        names = [spec.name for _, spec in kept(self.spec.kpis)]
        for i, check in kept(self.spec.checks):
            if check.kpi.partition(".")[0] not in names:
                text = f'no KPI "{check.kpi}"{did_you_mean(check.kpi.partition(".")[0], names)}'
                self.problems.append(Problem(text, self.root.where("checks", i, "kpi")))

    # -- reporting -----------------------------------------------------------------------------------------------------

    def _report(self, error: InputError, node: Node, *path: str | int) -> None:
        self.problems += [
            replace(problem, where=node.where(*path, *problem.subject), subject=()) if not problem.where else problem
            for problem in error.problems
        ]

    def _located(self, problem: Problem) -> Problem:
        """A problem of the system, with the place in the file of the setting it is about."""
        if problem.where or not problem.subject:
            return problem
        return replace(problem, where=self.root.where(*problem.subject), subject=())


def _matching(pattern: str, names: Mapping[str, Endpoint]) -> dict[str, Endpoint]:
    expression = re.compile(".*".join(map(re.escape, pattern.split("*"))))
    return {name: end for name, end in names.items() if expression.fullmatch(name)}


def _missing_function(spec: FunctionSpec, folder: Path) -> str:
    """Why `file.py:function` cannot be called later; "" when it can. The file is read, not run."""
    file, _, name = spec.python.rpartition(":")
    path = folder / file
    if not file.endswith(".py") or not name.isidentifier():
        return f'expected "file.py:function", found "{spec.python}"'
    if not path.is_file():
        return f'file "{file}" does not exist'
    try:
        tree = ast.parse(path.read_bytes())
    except SyntaxError as error:
        return f'"{file}" is no Python: {error.msg} (line {error.lineno})'
    functions: Sequence[str] = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    return "" if name in functions else f'"{file}" defines no function "{name}"{did_you_mean(name, functions)}'


def seconds(value: float | int | str) -> Any:
    """A time given outside of a scenario file, exact. Raises InputError."""
    try:
        return exact(value)
    except (ValueError, ZeroDivisionError):
        raise InputError(f'expected seconds, found "{value}"') from None
