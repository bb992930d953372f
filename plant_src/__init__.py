"""Plant models: vehicles with equations of motion and geometry, and the PyBullet world with contact between them."""
