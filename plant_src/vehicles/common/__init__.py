"""Parts that all vehicles share: interface, kinematics, shapes, contact equations."""
