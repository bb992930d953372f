"""Presentation of results: figures, tables, videos and HTML pages."""
