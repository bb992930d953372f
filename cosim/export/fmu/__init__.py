"""Packaging of a block of C code as an FMU.

Model description, table of variables, compilation and archive.
"""
