"""Whether a description that we did not write ourselves is one that importers accept."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

from ..errors import InputError, Problem

DESCRIPTION = "modelDescription.xml"


def validate(description: bytes, source: Path) -> None:
    """Raises InputError with everything that is wrong in a modelDescription.xml; `source` is the file to blame."""
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError

    archive = BytesIO()
    with ZipFile(archive, "w") as file:
        file.writestr(DESCRIPTION, description)
    try:
        read_model_description(archive, validate_variable_names=True, validate_model_structure=True)
    except ValidationError as error:
        raise InputError([Problem(problem, str(source)) for problem in error.problems]) from None
