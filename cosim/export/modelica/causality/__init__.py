"""Causality analysis of a flat model.

Matching, sorting, clocks, continuous states and parameter roles.
"""
