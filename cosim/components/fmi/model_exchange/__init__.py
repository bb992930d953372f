"""Instances of Model Exchange FMUs, integrated by the importer."""

from .instance import Fmi2Model, Fmi3Model

__all__ = ["Fmi2Model", "Fmi3Model"]
