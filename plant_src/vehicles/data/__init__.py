"""Vehicle files, one for each vehicle (README.md).

The folder is a package, so that copies of the plant, for example in an FMU, contain the files.
"""

from pathlib import Path

FOLDER = Path(__file__).parent
