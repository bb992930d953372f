"""Code generation: a flat model with its schedule is lowered to C code."""
