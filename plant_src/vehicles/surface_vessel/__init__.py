"""Modules of floating vessels that are given by data.

Hull form, interface, equations, reader of vehicle files.
"""
