"""Plant models: vehicles with their equations, and a world with contact between them."""
