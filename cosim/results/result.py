"""`Result`: everything that is known about one finished run."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import InputError, did_you_mean
from ..core.recording import Recording
from .csv_files import read_csv, write_csv
from .files import write_json
from .mcap_files import write_mcap
from .parquet_files import write_parquet

if TYPE_CHECKING:
    from .checks import CheckOutcome


class SignalError(InputError, KeyError):
    """A signal was asked for that was not recorded."""

    __str__ = Exception.__str__  # KeyError would print the repr


class KpiError(InputError, KeyError):
    """A KPI was asked for that was not computed."""

    __str__ = Exception.__str__


class Kpis(dict[str, float | int | bool]):
    """KPIs by their names; asking for another one raises KpiError (an InputError and a KeyError) with the nearest name."""

    def __missing__(self, name: str) -> float | int | bool:
        raise KpiError(f'no KPI "{name}" was computed{did_you_mean(name, self)}')


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """A recorded run; `result["plant.uav.position.z"]` are the values of one signal, shape (rows,).

    `kpis` maps "landing.lateral_error" to a number or Boolean, `timing` names of durations to wall time in s
    ("loop_seconds": the stepping loop alone), `metadata` whatever describes the run: versions, hashes, seeds. `checks` are the
    scenario's checks held against the KPIs, each with its `check`, `value` and `passed`: one that is not met raises nothing. A
    result that was read from files has none.
    """

    recording: Recording
    kpis: Mapping[str, float | int | bool] = field(default_factory=dict)
    timing: dict[str, float] = field(default_factory=dict)
    metadata: dict[str, Any] = field(default_factory=dict)
    checks: Sequence[CheckOutcome] = ()

    @property
    def time(self) -> np.ndarray:
        """Time of each row in s, shape (rows,)."""
        return self.recording.time

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal in Modelica syntax, "" where it is unknown."""
        return self.recording.units

    def __getitem__(self, name: str) -> np.ndarray:
        """Values of one signal; raises SignalError (an InputError and a KeyError) for a name that was not recorded."""
        try:
            return self.recording.columns[name]
        except KeyError:
            hint = "; the time of each row is in `result.time`" if name == "time" else did_you_mean(name, self)
            raise SignalError(f'no signal "{name}" was recorded{hint}') from None

    def __contains__(self, name: object) -> bool:
        return name in self.recording.columns

    def __iter__(self) -> Iterator[str]:
        return iter(self.recording.columns)

    def __len__(self) -> int:
        """Number of signals."""
        return len(self.recording.columns)

    def __repr__(self) -> str:
        """What ran, how far, which checks it did not meet, and the KPIs."""
        rows = f"{len(self.time)} rows of {len(self)} signals"
        span = f", {self.time[0]:g} s to {self.time[-1]:g} s" if len(self.time) else ""
        failure, units = self.metadata.get("failure"), self.metadata.get("kpi_units", {})
        lines = [f"{self.metadata.get('name', 'Result')}: {rows}{span}", *([f"ended early: {failure}"] if failure else [])]
        lines += self._summarize_checks()
        width = max(map(len, self.kpis), default=0)
        for name, value in self.kpis.items():
            text = str(value) if isinstance(value, bool) else f"{value:.6g}"
            lines.append(f"  {name:{width}}  {text} {units.get(name, '')}".rstrip())
        return "\n".join(lines)

    def _summarize_checks(self) -> list[str]:
        if not self.checks:
            return []
        failed = [f"  {outcome}" for outcome in self.checks if not outcome.passed]
        return [f"{len(self.checks) - len(failed)} of {len(self.checks)} checks passed{':' * bool(failed)}", *failed]

    def signals(self, pattern: str = "*") -> list[str]:
        """Names that match `pattern`, in recorded order; `*` stands for any text, dots and brackets included."""
        matches = re.compile(".*".join(map(re.escape, pattern.split("*")))).fullmatch
        return [name for name in self if matches(name)]

    def to_csv(self, path: str | Path) -> None:
        """Write all signals to a CSV file (see `cosim.results.csv_files`)."""
        write_csv(self.recording, path)

    def to_parquet(self, path: str | Path) -> None:
        """Write all signals to a Parquet file (see `cosim.results.parquet_files`)."""
        write_parquet(self.recording, path)

    def to_mcap(self, path: str | Path, scene: Mapping[str, Any] | None = None) -> None:
        """Write poses, signals and the scene, when it is given, to an MCAP file (see `cosim.results.mcap_files`)."""
        about = {key: value for key, value in self.metadata.items() if key in ("name", "versions", "sha256")}
        write_mcap(self.recording, path, scene, about)

    @classmethod
    def from_csv(cls, path: str | Path) -> Result:
        """A result with the signals of a CSV file and nothing else; raises InputError when it cannot be read."""
        return cls(read_csv(path))


def write_run(result: Result, directory: str | Path) -> None:
    """Write `result.csv`, `kpis.json` and `run.json` (metadata, timing, units) to `directory`, each of them atomically."""
    directory = Path(directory)
    result.to_csv(directory / "result.csv")
    write_json(result.kpis, directory / "kpis.json")
    write_json({**result.metadata, "timing": result.timing, "units": result.units}, directory / "run.json")
