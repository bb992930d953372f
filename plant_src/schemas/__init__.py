"""JSON Schemas of the arguments of a world and of vehicle files, for editors and the reference.

The readers check the values.
"""
