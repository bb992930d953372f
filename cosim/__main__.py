"""`python -m cosim`."""

from .cli import main

main()
