"""Scenario files: reading, checking, and assembling them into systems."""

from .assembly import Assembly, assemble
from .nested_systems import find, load
from .schema import json_schema

__all__ = ["Assembly", "assemble", "find", "json_schema", "load"]
