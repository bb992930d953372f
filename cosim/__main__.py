"""Entry point of `python -m cosim`."""

from .cli import main

main()
