"""What Bullet knows of the survey hexacopter, in the principal-axis frame at the centre of mass."""

from __future__ import annotations

from ..shapes import Body, standing_box
from .parameters import AIRFRAME

#: distance of the landing skids' ends along x and y, assumed: the skids of this class of frame (m)
TRACK = (0.30, 0.36)

#: bottom of the skids and top of the frame from the centre of mass, assumed (m)
FEET_HEIGHT, TOP_HEIGHT = -0.22, 0.12

BODY = Body(
    AIRFRAME.mass,
    tuple(AIRFRAME.principal_axes()[0].tolist()),
    (standing_box(AIRFRAME.principal_axes()[1], TRACK, FEET_HEIGHT, TOP_HEIGHT),),
)
