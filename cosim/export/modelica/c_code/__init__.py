"""Code generation: a flat model with its schedule is lowered to C code."""

from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from ..causality.analysed_model import AnalysedModel
from ..external.c_files import external_files
from .header import HeaderWriter
from .hybrid_code import HybridCode
from .model_code import ModelCode


def generate_c(
    analysed: AnalysedModel, sources: Sequence[str], packages: Mapping[str, Path] | None = None
) -> dict[str, str]:
    """Generate the C files of a model.

    Args:
        analysed: The model with its schedule and default values.
        sources: Names of the Modelica files, for a comment.
        packages: Top-level package -> its folder, for the files of external functions.

    Returns:
        File name -> text.

    Raises:
        InputError: The model uses a feature that is not supported.
    """
    code = (HybridCode if analysed.model.hybrid else ModelCode)(analysed)
    folder = resources.files(__package__ or "")
    texts = {
        name: folder.joinpath(name).read_text(encoding="utf-8")
        for name in ("runtime.h", *code.headers())
    }
    model_c = code.model_c()
    header = HeaderWriter(analysed, sources, len(code.functions.warnings))
    external = external_files(code.functions.external_functions, packages or {})
    return {"model.c": model_c, "model.h": header.text(), **texts, **external}
