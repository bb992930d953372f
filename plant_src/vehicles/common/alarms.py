"""What a vehicle's compiled equations report of a step before it is made."""

from __future__ import annotations

#: a state whose norm (m, m/s, rad, rad/s) is not below this is an explosion
LARGEST_STATE = 1e5

#: the vehicle may come near something; an input or the state is not finite, or the state an explosion; zero: neither
ADRIFT, UNSOUND = 1.0, 2.0
