"""C code of a sorted flat model."""
