"""What Bullet knows of the catamaran: as in the plane, but that its height is part of its motion."""

from __future__ import annotations

from ..strider import geometry

BODY = geometry.BODY._replace(height=0.0)
