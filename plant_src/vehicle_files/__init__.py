"""Vehicle files: their summary, and their import from URDF and meshes."""
