"""Parts that every exported FMU has: model description, C interface, archive."""
