"""Runs of a study as data: jobs for a runner, and records of finished runs."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, NewType, Protocol

from ...core.json_values import is_number, parse_object
from ...results.checks import Number

#: messages between the worker pool and its fork server
READY, FORK_REQUEST = b"ready", b"fork"

#: identifies a run by the content of its files and its settings; equal for equal runs
RunKey = NewType("RunKey", str)


@dataclass(frozen=True)
class Job:
    """A run to be made: its key and its settings, as of `--set`."""

    key: RunKey
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Record:
    """Outcome of a run.

    Attributes:
        key: key of the run.
        kpis: KPIs by name; empty after a failure.
        units: units of the KPIs that have one.
        failure: cause of a failure; empty: the run reached its end.
        seconds: wall time (s).
        output: end of the text that components printed, of a failed run.
    """

    key: RunKey
    kpis: Mapping[str, Number] = field(default_factory=dict)
    failure: str = ""
    seconds: float = 0.0
    output: str = ""
    units: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> str:
        """Return the record as one line of JSON without its empty fields."""
        return json.dumps(
            {name: value for name, value in vars(self).items() if value or name == "key"}
        )

    @classmethod
    def from_json(cls, text: str | bytes) -> Record:
        """Read a record from a line of JSON.

        Raises:
            ValueError: The line is not a record.
        """
        fields = parse_object(text)
        if fields.keys() - _FIELD_TYPES.keys() or "key" not in fields:
            raise ValueError("expected the fields of a record")
        record = cls(**fields)
        if not all(isinstance(value, _FIELD_TYPES[name]) for name, value in vars(record).items()):
            raise ValueError("a field of the record has another type")
        if not all(map(is_number, record.kpis.values())):
            raise ValueError("a KPI of the record is not a number")
        if not all(isinstance(unit, str) for unit in record.units.values()):
            raise ValueError("a unit of the record is not a text")
        bytes.fromhex(record.key)
        return record


_FIELD_TYPES: Mapping[str, Any] = {
    "key": str,
    "kpis": dict,
    "failure": str,
    "seconds": float | int,
    "output": str,
    "units": dict,
}


@dataclass(frozen=True)
class StudyContext:
    """Properties that all runs of a study share.

    Attributes:
        scenario: the scenario's file.
        root: folder of all files that the runs need; messages show paths relative to it.
        deadline: largest wall time of a run (s); None: no limit.
        fmus: paths below `root` of the FMUs that the runs use.
    """

    scenario: Path
    root: Path
    deadline: float | None = None
    fmus: tuple[str, ...] = ()


class Runner(Protocol):
    """Executor of jobs, several at a time."""

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Run the jobs and yield their records in the order in which the runs end."""
        ...


def run_key(digest: str, settings: Mapping[str, Any]) -> RunKey:
    """Return the key of a run.

    A hash of its settings and of the `digest` of all files that it depends on.
    """
    return RunKey(sha256(json.dumps([digest, settings], sort_keys=True).encode()).hexdigest()[:32])
