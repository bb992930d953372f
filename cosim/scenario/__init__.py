"""Scenario files: reading, checking, and assembling them into systems."""

from .assembly import PreparedRun, prepare
from .nested_systems import find_scenario, load_scenario
from .schema import json_schema

__all__ = ["PreparedRun", "prepare", "find_scenario", "json_schema", "load_scenario"]
