"""Status codes of a predicted step, which the compiled equations report before anything has moved.

INVALID_STATE stands alone; LEAVES_SAFE_BOX and MAY_FAIL are added if both apply.
"""

from __future__ import annotations

#: norm of the state (m, m/s, rad, rad/s) from which the motion counts as diverged
MAX_STATE_NORM = 1e5

#: valid; the vehicle leaves the box in which it cannot meet anything; an input or the state is not
#: finite, or too large
VALID, LEAVES_SAFE_BOX, INVALID_STATE = 0.0, 1.0, 2.0

#: the vehicle ends upside down, or a multirotor where the water surface may be
MAY_FAIL = 4.0
