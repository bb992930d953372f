"""Surfaces above which multirotors fly.

Decks of vessels and tops of platforms, as a table for the compiled equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..vehicles.common.interface import SURFACE_COLUMNS

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform

_CENTRE, _ORIENTATION = slice(2, 5), slice(5, 9)  # columns


class SurfaceTable:
    """Table of all decks and platforms, see `vehicles/multirotor/surroundings.py`.

    The deck of a vessel is the top of its highest box, centred at the output `deck.position`.

    Attributes:
        rows: Rectangles, shape (n, SURFACE_COLUMNS), at least one row; those without edges are
            below nothing.
        count: Number of rows, shape (1,).
    """

    def __init__(self, vessels: Sequence[ContactBody], platforms: Sequence[Platform]):
        self.count = np.full(1, float(len(vessels) + len(platforms)))
        self.rows = np.zeros((max(len(vessels) + len(platforms), 1), SURFACE_COLUMNS))
        self._decks: list[tuple[Any, Any, Any, Any]] = []
        for row, vessel in zip(self.rows, vessels, strict=False):
            deck = max(
                vessel.model.body.boxes, key=lambda box: box.position[2] + box.half_extents[2]
            )
            row[:2] = deck.half_extents[:2]
            self._decks.append((row[_CENTRE].data, row[_ORIENTATION].data, *_deck_pose(vessel)))
        for row, platform in zip(self.rows[len(vessels) :], platforms, strict=False):
            x, y, z = platform.position
            edge_x, edge_y, edge_z = platform.size
            row[:] = edge_x / 2, edge_y / 2, x, y, z + edge_z / 2, 1.0, 0.0, 0.0, 0.0

    def update(self) -> None:
        """Copy the poses of the decks."""
        for centre, orientation, deck_centre, deck_orientation in self._decks:
            centre[:] = deck_centre
            orientation[:] = deck_orientation


def _deck_pose(vessel: ContactBody) -> tuple[Any, Any]:
    """Return views of the outputs with the position and the orientation of the deck."""
    slots = vessel.model.slots("output")
    position, orientation = slots.index("deck.position.x"), slots.index("orientation.w")
    return vessel.outputs[position : position + 3].data, vessel.outputs[
        orientation : orientation + 4
    ].data
