"""Causality analysis of a flat model: matching, sorting, clocks, continuous states and parameter roles."""
