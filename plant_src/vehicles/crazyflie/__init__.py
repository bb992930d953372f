"""The Crazyflie 2.x nano quadcopter."""
