"""The Bullet side of the world: bodies, contacts, clearance."""
