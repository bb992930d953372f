"""Result of one finished run."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypedDict

import numpy as np

from ..core.errors import InputError, pattern_hint
from ..core.recording import Recording
from ..core.text import count_noun
from .checks import kpi_hint
from .csv_files import read_csv, write_csv
from .files import write_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .checks import CheckOutcome


class SignalError(InputError, KeyError):
    """Access to a signal that was not recorded; also a KeyError."""

    __str__ = Exception.__str__  # KeyError.__str__ would return the repr


class KpiError(InputError, KeyError):
    """Access to a KPI that was not computed; also a KeyError."""

    __str__ = Exception.__str__


class Kpis(dict[str, float | int | bool]):
    """Values of KPIs by name, such as `result.kpis["landing.lateral_error"]`.

    An unknown name raises KpiError (an InputError and a KeyError). Its message contains the most
    similar name, or the KPIs.
    """

    def __missing__(self, name: str) -> float | int | bool:
        raise KpiError(f'no KPI "{name}" was computed{kpi_hint(name, self)}')


class Presentation:
    """Functions that show a result.

    The package `api` sets them, because they belong to a higher layer than results.

    Attributes:
        plot: Draws the signals with these names.
        html: Returns the HTML for a cell of a notebook.
    """

    plot: ClassVar[Callable[[Result, Sequence[str]], Figure]]
    html: ClassVar[Callable[[Result], str]]
    write_report: ClassVar[Callable[[Path], None]]


class RunMetadata(TypedDict, total=False):
    """Description of a run, as in run.json: how it was made and how it ended.

    A result that was read from a file has only the keys of the file.

    Attributes:
        name: Name of the scenario.
        scenario: Expanded scenario.
        scenario_file: Absolute path of its file.
        parameters: Values of variables that the caller has set, by JSON pointer.
        system: Components, connections and stages (see `cosim.scenario.overview`).
        versions: Versions of cosim and of packages that influence results.
        machine: Operating system and processor.
        sha256: Hashes of all files by name.
        macro_steps: Number of completed macro steps.
        terminated_by: Arguments of `describe_termination`; None: the run reached its stop time.
        failure: Error that ended the run early; None for none.
        non_finite: Time (s) of the first NaN or infinity of each signal.
        real_time: Statistics of the lateness; None for a run without pacing.
        kpi_units: Unit of each KPI.
        kpi_senses: "lower" or "higher" for each KPI that is better so.
        kpi_notes: Reasons of missing KPIs, and signals that optional KPIs took.
        check_notes: Reasons of missing KPIs with a check.
        warnings: Messages of the run.
        live_events: Events that a live view has set.
        deviation: Deviation from the reference.
    """

    name: str
    scenario: dict[str, Any]
    scenario_file: str
    parameters: dict[str, Any]
    system: dict[str, Any]
    versions: dict[str, str]
    machine: dict[str, str]
    sha256: dict[str, str]
    macro_steps: int
    terminated_by: dict[str, Any] | None
    failure: str | None
    non_finite: dict[str, float]
    real_time: Mapping[str, Any] | None
    kpi_units: dict[str, str]
    kpi_senses: dict[str, str]
    kpi_notes: Sequence[str]
    check_notes: Sequence[str]
    warnings: Sequence[str]
    live_events: Sequence[Any]
    deviation: Any


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """Recorded run: a read-only mapping from names of signals to their values.

        result["plant.uav.position.z"]  # shape (rows,)

    Attributes:
        recording: The recorded signals.
        kpis: KPIs by name, such as "landing.lateral_error".
        timing: Wall time by name (s), such as "loop_seconds" for the stepping loop alone.
        metadata: Description of the run: scenario, versions, hashes, failure.
        checks: Outcomes of the scenario's checks, each with `check`, `value` and `passed`; empty if
            the result was read from a file.
        failure: The error that ended the run early; None if there was none, or if the result was
            read from a file.
    """

    recording: Recording
    kpis: Mapping[str, float | int | bool] = field(default_factory=dict)
    timing: dict[str, float] = field(default_factory=dict)
    metadata: RunMetadata = field(default_factory=RunMetadata)
    checks: Sequence[CheckOutcome] = ()
    failure: BaseException | None = None

    @property
    def time(self) -> np.ndarray:
        """Time of each row (s), shape (rows,)."""
        return self.recording.time

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal in Modelica syntax; "" if unknown."""
        return self.recording.units

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the values of one signal, shape (rows,).

        Args:
            name: Name of the signal.

        Raises:
            SignalError: The signal was not recorded; also an InputError and a KeyError.
        """
        try:
            return self.recording.columns[name]
        except KeyError:
            hint = (
                "; the time of each row is in `result.time`"
                if name == "time"
                else pattern_hint(name, self)
            )
            raise SignalError(f'no signal "{name}" was recorded{hint}') from None

    def __contains__(self, name: object) -> bool:
        return name in self.recording.columns

    def __iter__(self) -> Iterator[str]:
        return iter(self.recording.columns)

    def __len__(self) -> int:
        """Return the number of signals."""
        return len(self.recording.columns)

    @property
    def termination(self) -> str:
        """Sentence that names what ended the run before the stop time; "" if nothing did."""
        terminated_by = self.metadata.get("terminated_by")
        return describe_termination(**terminated_by) if terminated_by else ""

    @property
    def crashed(self) -> bool:
        """True if a condition with the outcome "crash" ended the run."""
        return (self.metadata.get("terminated_by") or {}).get("outcome") == "crash"

    def __repr__(self) -> str:
        """Return name, size, failure, termination, failed checks and KPIs, in several lines."""
        rows = f"{count_noun(len(self.time), 'row')} of {count_noun(len(self), 'signal')}"
        span = f", {self.time[0]:g} s to {self.time[-1]:g} s" if len(self.time) else ""
        failure, units = self.metadata.get("failure"), self.metadata.get("kpi_units", {})
        lines = [
            f"{self.metadata.get('name', 'Result')}: {rows}{span}",
            *([f"ended early: {failure}"] if failure else []),
        ]
        lines += [self.termination] if self.termination else []
        lines += self._summarize_checks(units)
        width = max(map(len, self.kpis), default=0)
        for name, value in self.kpis.items():
            text = str(value) if isinstance(value, bool) else f"{value:.6g}"
            lines.append(f"  {name:{width}}  {text} {units.get(name, '')}".rstrip())
        return "\n".join(lines)

    def _summarize_checks(self, units: Mapping[str, str]) -> list[str]:
        if not self.checks:
            return []
        failed = [f"  {outcome.text(units)}" for outcome in self.checks if not outcome.passed]
        return [
            (
                f"{len(self.checks) - len(failed)} of {count_noun(len(self.checks), 'check')} "
                f"passed{':' * bool(failed)}"
            ),
            *failed,
        ]

    def signals(self, pattern: str = "*") -> list[str]:
        """Return the names of signals that match a pattern, in recorded order.

        Args:
            pattern: `*` matches any text, also dots and brackets.
        """
        matches = re.compile(".*".join(map(re.escape, pattern.split("*")))).fullmatch
        return [name for name in self if matches(name)]

    def to_csv(self, path: str | Path) -> None:
        """Write all signals to a CSV file.

        Args:
            path: The file; missing folders are created, an existing file is replaced.

        Raises:
            InputError: The path cannot be written.
            OutputError: The disk is full or defective.
        """
        write_csv(self.recording, path)

    def to_parquet(self, path: str | Path) -> None:
        """Write all signals to a Parquet file.

        Args:
            path: The file; missing folders are created, an existing file is replaced.

        Raises:
            InputError: The path cannot be written, or the package pyarrow is not installed.
            OutputError: The disk is full or defective.
        """
        from .parquet_files import write_parquet

        write_parquet(self.recording, path)

    def to_dataframe(self) -> Any:
        """Return a pandas DataFrame with a column for each signal; the index is the time (s).

        The attribute `attrs["units"]` holds the unit of each signal.

        Raises:
            InputError: The package pandas is not installed (extra `dataframe`).
        """
        from .parquet_files import to_dataframe

        return to_dataframe(self.recording)

    def plot(self, *signals: str) -> Figure:
        """Draw signals over time, with one diagram for each unit.

        Args:
            signals: Names of signals; `*` matches any text.

        Returns:
            A matplotlib figure, which a notebook shows. `figure.savefig(path)` writes it to a file.

        Raises:
            InputError: A name matches no numeric signal, or there are too many signals.
        """
        return Presentation.plot(self, signals)

    def _repr_html_(self) -> str:
        """Return the table of KPIs and the report with figures and replay, for a notebook."""
        return Presentation.html(self)

    def write(self, folder: str | Path) -> None:
        """Write a folder like `cosim run`: result.csv, kpis.json, run.json and report.html.

        Args:
            folder: The folder; it is created if it is missing, and existing files are replaced.

        Raises:
            InputError: The folder cannot be written, or a figure cannot be drawn.
            OutputError: The disk is full or defective.
        """
        write_run(self, folder)
        Presentation.write_report(Path(folder))

    def to_mcap(self, path: str | Path, scene: Mapping[str, Any] | None = None) -> None:
        """Write poses, signals and scene to an MCAP file (topics: see `cosim.results.mcap_files`).

        Args:
            path: The file; missing folders are created, an existing file is replaced.
            scene: Scene in the format of `cosim.report.scene`; None for no scene.

        Raises:
            InputError: The path cannot be written, or the package foxglove-sdk is not installed.
            OutputError: The disk is full or defective.
        """
        from .mcap_files import write_mcap

        about = {
            key: value
            for key, value in self.metadata.items()
            if key in ("name", "versions", "sha256")
        }
        write_mcap(self.recording, path, scene, about)

    @classmethod
    def from_csv(cls, path: str | Path) -> Result:
        """Read a result from a CSV file, which contains only signals.

        Args:
            path: The file.

        Raises:
            InputError: The file cannot be read.
        """
        return cls(read_csv(path))


def describe_termination(
    time: float,
    component: str = "",
    condition: str = "",
    outcome: str = "",
    cause: str = "",
    since: float = 0.0,
) -> str:
    """Return a sentence that says what ended the run at `time` (s).

    A component, or a condition met since `since` (s).
    """
    if component:
        return f"{component} requested the end of the simulation at t = {time:.12g} s"
    end = "crashed" if outcome == "crash" else "decided"
    return f"{end} at t = {since:.12g} s, ended at t = {time:.12g} s: {condition} ({cause})"


def write_run(result: Result, directory: str | Path) -> None:
    """Write `result.csv`, `kpis.json` and `run.json` (metadata, timing, units), each atomically.

    Args:
        result: The result.
        directory: Folder of the files; created if missing.

    Raises:
        InputError: The folder cannot be written.
        OutputError: The disk is full or defective.
    """
    directory = Path(directory)
    result.to_csv(directory / "result.csv")
    write_json(result.kpis, directory / "kpis.json")
    write_json(
        {**result.metadata, "timing": result.timing, "units": result.units}, directory / "run.json"
    )
