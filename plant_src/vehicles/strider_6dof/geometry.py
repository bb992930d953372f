"""Rigid body of the catamaran in six degrees of freedom, whose height is part of the state."""

from __future__ import annotations

from ..strider import geometry

BODY = geometry.BODY._replace(height=0.0)
