"""The AR.Drone 2.0 quadcopter."""
