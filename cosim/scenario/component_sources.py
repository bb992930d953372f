"""Sources of components: one class for each kind, all of them in one table.

The class of a kind is the data model of a component with such a source. Everything that depends on
the kind is one of its attributes or methods: the keys and their checks, the paths of files, the
creation of the component. Another package adds a kind by an entry point of the group
"cosim.sources": a subclass of `ComponentSource` under the name of its key.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import WithJsonSchema, model_validator

from ..components.fmi import (
    FmuFile,
    InstanceSettings,
    Interface,
    Isolation,
    SolverSettings,
    create_component,
    open_fmu,
)
from ..components.python_import import load_object
from ..core.component import Component, Variable
from ..core.errors import (
    PASS_THROUGH_EXCEPTIONS,
    InputError,
    describe_exception,
    nearest_file,
)
from ..core.integration_methods import METHODS, Method
from ..core.paths import is_file, resolve_path
from ..export.foreign import add_binary
from .schema_types import (
    FilePath,
    FileReference,
    FolderPaths,
    HoldsPaths,
    NameList,
    PathChange,
    Period,
    Spec,
    Value,
    change_path,
    key,
    path_keys,
)

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from ..components.input_table import InputTable

#: group of the entry points by which other packages add kinds of sources
ENTRY_POINTS = "cosim.sources"


@dataclass(frozen=True)
class Creation:
    """Input of a source for the creation of its component.

    Attributes:
        name: Full name of the component, such as "uav.vtol".
        folder: Folder that relative paths start from.
        values: Values of variables that the scenario sets, by name; structural parameters among
            them size the arrays.
        target: Python class or object of a scenario that is a dict, or None.
        factory: Factory of the components of FMUs.
    """

    name: str
    folder: Path
    values: Mapping[str, Any]
    target: Any
    factory: ComponentFactory


class ComponentFactory:
    """Factory of the components of FMUs, however many components use the same file.

    Args:
        isolation: How isolated FMUs run. An FMU is isolated if its component has `isolation`, if
            `isolate_fmus` is set, and from the second instance on if it allows only one instance
            per process.
        isolate_fmus: Isolate every FMU.
        loaded_fmus: FMU files that have already been read, by resolved path.
    """

    def __init__(
        self, isolation: Isolation, isolate_fmus: bool, loaded_fmus: Mapping[Path, FmuFile]
    ) -> None:
        self._isolation, self._isolate_fmus = isolation, isolate_fmus
        self._loaded_fmus = loaded_fmus
        #: FMU files in use, by resolved path and the interface that the scenario demands
        self.fmus: dict[tuple[Path, Interface | None], FmuFile] = {}
        #: solver of each Model Exchange FMU, by full name of its component
        self.solvers: dict[str, dict[str, Any]] = {}

    def instantiate(
        self, creation: Creation, path: Path, settings: InstanceSettings, isolated: bool
    ) -> Component:
        """Create the component of an FMU.

        Args:
            creation: The component.
            path: Path of the FMU.
            settings: Tolerance and solver.
            isolated: Run it in a separate process in any case.
        """
        interface = settings.interface
        key = resolve_path(path), interface
        used = self.fmus.get(key)
        needs_own_process = used is not None and used.description.once_per_process
        if used is None:
            loaded = None if interface else self._loaded_fmus.get(key[0])
            self.fmus[key] = loaded or open_fmu(path, interface, add_binary)
        elif needs_own_process:
            # its process must not inherit the library that is loaded in this one
            self.fmus[key] = open_fmu(path, interface, add_binary)
        file = self.fmus[key]
        settings = settings.with_structural_parameters(file.description, creation.values)
        isolated = isolated or self._isolate_fmus or needs_own_process
        component = create_component(
            file, creation.name, settings, self._isolation if isolated else None
        )
        if file.description.interface == "model-exchange":
            experiment = file.description.default_experiment
            self.solvers[creation.name] = settings.describe_solver(experiment)
        return component


class Source(Spec):
    """Base of everything in a scenario that provides the signals of a component."""

    #: key of the source
    KEY: ClassVar[str]

    @property
    def reference(self) -> Any:
        """Value of the key of the source."""
        return getattr(self, self.KEY)

    def label(self, change: PathChange) -> str:
        """Return the source as run.json shows it, with changed paths."""
        mark = path_keys(type(self)).get(self.KEY)
        return str(mark.change(self.reference, change) if mark else self.reference)

    def files(self, folder: Path) -> Iterable[Path]:
        """Return the files that the source names, whether they exist or not."""
        return [folder / path for path in self.paths]

    def used_files(self, folder: Path) -> Iterable[Path]:
        """Return all files that the component, which has been created, depends on."""
        return self.files(folder)


class ComponentSource(Source):
    """A component; subclasses are the kinds of its source."""

    #: end of the names of source files, and noun for what is named after them ("file.py:Class")
    SUFFIX: ClassVar[str] = ""
    MEMBER: ClassVar[str] = ""
    #: keys that a component keeps if an extending file gives it a source of this kind
    KEPT_KEYS: ClassVar[tuple[str, ...]] = ("period",)
    #: end of the message about a key of this kind in a component of another kind, by key
    MISPLACED: ClassVar[Mapping[str, str]] = {}

    parameters: dict[str, Value] = key(
        "values of parameters and start values, by variable name; a list sets an array, nested "
        "lists one of several dimensions; "
        "a Binary is a text of hexadecimal digits",
        {"speed_command": 1.0, "waypoint_x": [3.0, 3.0, -3.0]},
        default={},
    )
    period: Period | None = key(
        "time between two steps; default: every macro step", 0.02, unit="s", default=None
    )

    @property
    def nested_system(self) -> str | dict[str, Any] | None:
        """Path or content of a nested system; None for other sources."""
        return None

    def create(self, creation: Creation) -> Component:
        """Create the component.

        Raises:
            InputError: The source does not exist or cannot be used.
        """
        raise NotImplementedError

    def texts(self) -> Iterator[str]:
        """Yield the texts of the component that may be paths of files, also those in its values."""
        yield from self.paths
        yield from texts_in(self.parameters)

    def preload(self, folder: Path) -> None:
        """Import the code of the component, for processes from which runs are forked."""

    @classmethod
    def python_class(cls, entry: Mapping[str, Any], folder: Path) -> Any:  # noqa: ARG003
        """Return the Python class of a component as in a scenario file, or None."""
        return None


class _FmuBased(ComponentSource):
    """A component that is an FMU."""

    KEPT_KEYS = ("period", "isolation")

    isolation: Literal["fmu"] | None = key("run the FMU in a separate process", "fmu", default=None)


class SolverSpec(Spec):
    """Integration of a Model Exchange FMU."""

    method: Method = key(
        "; ".join(f'"{name}": {info.description}' for name, info in METHODS.items()),
        "euler",
    )
    step_size: Period | None = key(
        "largest step size of a method with fixed step size; default: that of the FMU's default "
        "experiment, "
        "or else the time between two steps of the component",
        0.001,
        unit="s",
        default=None,
    )

    @model_validator(mode="after")
    def _check_step_size(self) -> SolverSpec:
        if self.step_size is not None and METHODS[self.method].variable_step:
            raise ValueError(
                '"step_size" is for methods with fixed step size; '
                f'"{self.method}" has a "tolerance"'
            )
        return self


class FmuSource(_FmuBased):
    """A component that is the FMU of a file."""

    KEY = "fmu"
    SUFFIX = ".fmu"

    fmu: FilePath = key("path of an FMU", "../fmus/strider_autopilot.fmu")
    solver: SolverSpec | None = key(
        "simulate by Model Exchange with this solver; default: by Co-Simulation if the FMU has "
        "it, else cvode",
        {"method": "euler", "step_size": 0.001},
        default=None,
    )
    tolerance: float | None = key(
        "relative tolerance of the FMU and of its solver; default: that of the FMU's default "
        "experiment",
        1e-6,
        default=None,
        gt=0,
        allow_inf_nan=False,
    )

    def create(self, creation: Creation) -> Component:
        """Create an instance of the FMU."""
        for kind in component_kinds().values():
            if kind.MEMBER and re.search(rf"{re.escape(kind.SUFFIX)}(?::\w+)?$", self.fmu):
                raise InputError(
                    f'"{self.fmu}" is not an FMU; it is named by "{kind.KEY}" instead of "fmu"'
                )
        solver = SolverSettings(self.solver.method, self.solver.step_size) if self.solver else None
        return creation.factory.instantiate(
            creation,
            creation.folder / self.fmu,
            InstanceSettings(self.tolerance, solver),
            self.isolation is not None,
        )


class PythonSource(ComponentSource):
    """A component that is an object of a Python class."""

    KEY = "python"
    SUFFIX = ".py"
    MEMBER = "Class"
    MISPLACED = {"arguments": '; variables are set with "parameters"'}

    python: FileReference = key(
        '"file.py:Class": a PythonFMU class or a component class of cosim',
        "my_autopilot.py:Autopilot",
    )
    arguments: dict[str, Any] = key(
        "arguments of the constructor; only for Python components",
        {"environment": {"seed": 1}},
        default={},
    )

    def create(self, creation: Creation) -> Component:
        """Import the class and construct the object."""
        from ..components.python_class import create_python_component, load_component
        from ..process.journal import calling_component

        with calling_component(creation.name, "loading the class", "load"):
            if creation.target is not None:
                return create_python_component(
                    creation.target, self.python, creation.name, self.arguments
                )
            return load_component(self.python, creation.folder, creation.name, self.arguments)

    def texts(self) -> Iterator[str]:
        """Yield the texts that may be paths, also those in the arguments."""
        yield from super().texts()
        yield from texts_in(self.arguments)

    def preload(self, folder: Path) -> None:
        """Import the class, and call its static method `warm` with the arguments if it has one."""
        if warm := getattr(load_object(self.python, folder), "warm", None):
            warm(**self.arguments)

    @classmethod
    def python_class(cls, entry: Mapping[str, Any], folder: Path) -> Any:
        """Return the class; None for a Python class or object of a scenario that is a dict."""
        reference = entry["python"]
        is_file_name = isinstance(reference, str) and ".py:" in reference
        return load_object(reference, folder) if is_file_name else None


class ModelicaSource(_FmuBased):
    """A component that is a Modelica model, of which an FMU is built."""

    KEY = "modelica"
    SUFFIX = ".mo"
    MEMBER = "Model"

    modelica: FileReference = key(
        '"file.mo:Model"; built when needed (requires the extra "build")',
        "MyAutopilot.mo:MyAutopilot",
    )
    libraries: FolderPaths = key(
        "folders of Modelica libraries, searched before those of MODELICAPATH; only for "
        "Modelica models",
        ["../modelica"],
        default=[],
    )

    def create(self, creation: Creation) -> Component:
        """Create an instance of the FMU in the user's cache, built again if it is out of date."""
        from ..export.build import cached_fmu

        file, _, model = self.modelica.rpartition(":")
        if not file.endswith(self.SUFFIX):
            raise InputError(f'expected "file.mo:Model", found "{self.modelica}"')
        path = creation.folder / file
        if not is_file(path):
            raise InputError(f'file "{file}" does not exist{nearest_file(path)}')
        fmu = cached_fmu(path, model, [creation.folder / library for library in self.libraries])
        return creation.factory.instantiate(
            creation, fmu, InstanceSettings(None, None), self.isolation is not None
        )

    @property
    def paths(self) -> list[str]:
        """Path of the Modelica file; libraries are folders."""
        return [self.modelica.rpartition(":")[0]]

    def used_files(self, folder: Path) -> Iterable[Path]:
        """Return the Modelica file, and those from which its model was built."""
        from ..export.modelica.frontend.model_files import needed_files

        files = list(self.files(folder))
        return [*files, *needed_files(files[0])]


class NestedSystem(ComponentSource):
    """A component that is a nested system."""

    KEY = "system"
    SUFFIX = ".json"

    system: Annotated[
        str | dict[str, Any],
        HoldsPaths(change_path),
        WithJsonSchema({"anyOf": [{"type": "string"}, {"ref": "NestedSpec"}]}),
    ] = key(
        "path of the JSON file of a nested system, or its content",
        "systems/strider_autopilot.json",
    )

    @property
    def nested_system(self) -> str | dict[str, Any]:
        """Path or content of the system."""
        return self.system

    @property
    def paths(self) -> list[str]:
        """Path of the file; the components of an inline system have their own."""
        return [self.system] if isinstance(self.system, str) else []


class InputTableSource(Source):
    """An input profile over time from a CSV file."""

    KEY = "file"

    file: FilePath = key(
        'path of the CSV file; its first column is "time" (s)', "profiles/accelerations.csv"
    )
    to: dict[str, NameList] = key("the inputs that each column is connected to", {"ax": "uav.ax"})
    interpolation: Literal["linear", "hold"] = key(
        "value between two rows; hold: that of the last row", "hold", default="linear"
    )

    def create(self, folder: Path, targets: Mapping[str, Variable | None]) -> InputTable:
        """Read the table; `targets` are the first inputs that its columns feed."""
        from ..components.input_table import read_input_table

        return read_input_table(folder / self.file, targets, self.interpolation)


#: all kinds of sources of cosim; those of components by their keys
SOURCES: tuple[type[Source], ...] = (
    FmuSource,
    PythonSource,
    ModelicaSource,
    NestedSystem,
    InputTableSource,
)
_COMPONENT_KINDS = {kind.KEY: kind for kind in SOURCES if issubclass(kind, ComponentSource)}
_OWN_KEYS = frozenset().union(*(kind.model_fields for kind in _COMPONENT_KINDS.values()))


def component_kinds(keys: Iterable[str] | None = ()) -> Mapping[str, type[ComponentSource]]:
    """Return the kinds of sources of components by key.

    Those of other packages are only looked up, which takes time, if one of `keys` is no key of a
    kind of cosim, or if `keys` is None. One that cannot be used is left out.

    Raises:
        InputError: One of `keys` belongs to a kind that cannot be used.
    """
    if keys is not None and _OWN_KEYS.issuperset(keys):
        return _COMPONENT_KINDS
    kinds, problems = _kinds_of_packages()
    for name in keys or ():
        if name in problems:
            raise InputError(problems[name])
    return _COMPONENT_KINDS | kinds


@cache
def _kinds_of_packages() -> tuple[dict[str, type[ComponentSource]], dict[str, str]]:
    """Return the kinds that the entry points of installed packages name, and why others are none.

    A fault in one package does not keep scenarios without its key from being read.
    """
    from importlib.metadata import entry_points

    kinds: dict[str, type[ComponentSource]] = {}
    problems: dict[str, str] = {}
    for entry in entry_points(group=ENTRY_POINTS):
        who = f'the kind of sources "{entry.name}" of the package {entry.dist and entry.dist.name}'
        try:
            kinds[entry.name] = _load_kind(entry, entry.name in kinds)
        except PASS_THROUGH_EXCEPTIONS:
            raise
        except InputError as error:
            problems[entry.name] = f"{who}: {error}"
        except BaseException as error:  # a package that is imported may end the program
            problems[entry.name] = f"{who} cannot be imported: {describe_exception(error)}"
    for name, problem in problems.items():
        kinds.pop(name, None)
        logging.getLogger("cosim").warning("%s; it is left out", problem)
    return kinds, problems


def _load_kind(entry: EntryPoint, is_taken: bool) -> type[ComponentSource]:
    """Import a kind of another package and check it."""
    kind = entry.load()
    if not (isinstance(kind, type) and issubclass(kind, ComponentSource)):
        raise InputError(f"expected a subclass of ComponentSource, found {kind!r}")
    if entry.name != getattr(kind, "KEY", "") or entry.name not in kind.model_fields:
        raise InputError(f'expected KEY = "{entry.name}", and a field of this name')
    if entry.name in _OWN_KEYS or is_taken:
        raise InputError("this key is taken")
    return kind


def kind_of(entry: Mapping[str, Any]) -> type[ComponentSource]:
    """Return the kind of a component as in a scenario file; the base class if it has no source."""
    for name, kind in component_kinds(entry).items():
        if entry.get(name) is not None:
            return kind
    return ComponentSource


def texts_in(value: Any) -> Iterator[str]:
    """Yield the texts in a JSON value that can be paths."""
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from texts_in(item)
    elif isinstance(value, str) and value and "\0" not in value:
        yield value
