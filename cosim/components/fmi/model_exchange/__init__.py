"""Instances of Model Exchange FMUs, integrated by the importer."""

from .instance import Fmi1Model, Fmi2Model, Fmi3Model

__all__ = ["Fmi1Model", "Fmi2Model", "Fmi3Model"]
