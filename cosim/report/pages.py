"""Pages as single files that open from disk: templates, the built script and style, and data, all in one HTML text."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..results.files import plain

if TYPE_CHECKING:
    from jinja2 import Environment

FOLDER = Path(__file__).with_name("page")

#: a page runs its own script, has its own style and pictures, and asks nobody for anything
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; form-action 'none'"


@cache
def _environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(FOLDER), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


@cache
def _bundle() -> dict[str, Any]:
    script, style = ((FOLDER / "bundle" / f"replay.{kind}").read_text(encoding="utf-8") for kind in ("js", "css"))
    return {"script": markup(script.replace("</script", "<\\/script")), "style": markup(style), "policy": POLICY}


def markup(text: str) -> str:
    """Text that stands in a page as it is; only for what this package has made."""
    from markupsafe import Markup

    return Markup(text)  # noqa: S704


def render(template: str, **values: Any) -> str:
    """A page as text; all `values` are escaped but those that are marked as safe."""
    return _environment().get_template(template).render(**{**_bundle(), **values})


def embedded(data: Any) -> str:
    """Data as JSON that can stand in a script element, whatever texts it contains."""
    text = json.dumps(plain(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return markup(text.replace("<", "\\u003c"))
