"""Modules of floating vessels that are given by data: hull form, interface, equations, reader of vehicle files."""
