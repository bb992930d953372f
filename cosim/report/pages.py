"""Self-contained HTML pages: template, script, style and data in one file that opens from disk without a network."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..results.files import to_json_types

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATE_FOLDER = Path(__file__).with_name("page")

#: allows the scripts, styles and pictures inside the page and forbids all network requests
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; form-action 'none'"
)


@cache
def _jinja_environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(TEMPLATE_FOLDER), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


@cache
def _page_assets() -> dict[str, Any]:
    script, style = ((TEMPLATE_FOLDER / "bundle" / f"replay.{kind}").read_text(encoding="utf-8") for kind in ("js", "css"))
    return {
        "script": safe_markup(script.replace("</script", "<\\/script")),
        "style": safe_markup(style),
        "policy": CONTENT_SECURITY_POLICY,
    }


def safe_markup(text: str) -> str:
    """Mark text as HTML that is not escaped; only for text that this package has generated."""
    from markupsafe import Markup

    return Markup(text)  # noqa: S704


def render_page(template: str, **values: Any) -> str:
    """Return a page as HTML; all `values` are escaped except those of `safe_markup`."""
    return _jinja_environment().get_template(template).render(**{**_page_assets(), **values})


def embed_json(data: Any) -> str:
    """Return data as JSON that is safe inside a script element, whatever texts it contains."""
    text = json.dumps(to_json_types(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return safe_markup(text.replace("<", "\\u003c"))
