"""Packaging of a block of C code as an FMU: model description, table of variables, compilation and archive."""
