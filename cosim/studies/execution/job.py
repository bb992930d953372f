"""What an engine is asked to do, and what it answers."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any, Protocol

from ...results.checks import Number


@dataclass(frozen=True)
class Job:
    """One run: its settings, and a key that is the same exactly when the same run is meant."""

    key: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Record:
    """What became of a run: its KPIs or the cause of its failure, the wall time (s), and what its components printed last."""

    key: str
    kpis: Mapping[str, Number] = field(default_factory=dict)
    failure: str = ""
    seconds: float = 0.0
    output: str = ""

    def to_json(self) -> str:
        """One line; what is empty is left out."""
        return json.dumps({name: value for name, value in vars(self).items() if value or name == "key"})

    @classmethod
    def from_json(cls, text: str | bytes) -> Record:
        return cls(**json.loads(text))


@dataclass(frozen=True)
class StudyContext:
    """What all runs have in common: the scenario's file, the folder its messages are relative to, and a run's deadline (s).

    `fmus` are the paths below that folder of all FMUs that some run uses.
    """

    scenario: Path
    root: Path
    deadline: float | None = None
    fmus: tuple[str, ...] = ()


class Runner(Protocol):
    """Runs jobs, several at a time, and answers in whatever order they end."""

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]: ...


def run_key(digest: str, settings: Mapping[str, Any]) -> str:
    """The key of the run that scenario files of this digest make with these settings."""
    return sha256(json.dumps([digest, settings], sort_keys=True).encode()).hexdigest()[:32]
