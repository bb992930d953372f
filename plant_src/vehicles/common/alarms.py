"""What a vehicle's compiled equations report of a step before it is made."""

from __future__ import annotations

#: a state whose norm (m, m/s, rad, rad/s) is not below this is an explosion
MAX_STATE_NORM = 1e5

#: the vehicle may come near something; an input or the state is not finite, or the state an explosion; zero: neither
LEAVES_SAFE_BOX, INVALID_STATE = 1.0, 2.0
