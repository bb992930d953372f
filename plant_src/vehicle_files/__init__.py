"""Vehicle files: their equations and plausibility, and their import from URDF and meshes."""
