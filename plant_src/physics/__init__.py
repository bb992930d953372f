"""Contact between vehicles by Bullet: bodies, contact outputs, clearance."""
