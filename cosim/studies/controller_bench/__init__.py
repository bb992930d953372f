"""Controller benchmark.

A candidate replaces the shipped controller in every scenario with its role.
"""
