"""Vehicle files: their equations, schema and plausibility, and their import from URDF and meshes."""
