"""Whether a description that we did not write ourselves is one that importers accept."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

from ...core.errors import InputError, Problem

DESCRIPTION_FILE = "modelDescription.xml"


def validate_description(description: bytes, source: Path) -> None:
    """Raises InputError with everything that is wrong in a modelDescription.xml; `source` is the file to blame.

    FMPy reads XML with all its dangers, so it gets only what was found to be without them.
    """
    from fmpy import read_model_description
    from fmpy.model_description import ValidationError

    from ...components.fmi.preflight import DEFAULT_LIMITS
    from ...components.fmi.preflight.findings import FatalFindingError, raise_errors
    from ...components.fmi.preflight.xml import parse_xml

    try:
        parse_xml(description, DESCRIPTION_FILE, DEFAULT_LIMITS)
    except FatalFindingError as flaw:
        raise_errors(source, [flaw.finding])
    archive = BytesIO()
    with ZipFile(archive, "w") as file:
        file.writestr(DESCRIPTION_FILE, description)
    try:
        read_model_description(archive, validate_variable_names=True, validate_model_structure=True)
    except ValidationError as error:
        raise InputError([Problem(problem, str(source)) for problem in error.problems]) from None
