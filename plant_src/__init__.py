"""The plant: the vehicles' equations of motion and geometry, and the PyBullet world in which they touch each other."""
