"""Scenario files: read, validate and build them into systems that are ready to run."""

from .file_paths import find_scenario
from .nested_systems import load_scenario
from .prepared_run import IsolationMode, PreparedRun, load
from .schema import json_schema

__all__ = [
    "IsolationMode",
    "PreparedRun",
    "find_scenario",
    "json_schema",
    "load",
    "load_scenario",
]
