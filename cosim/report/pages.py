"""Self-contained HTML pages.

Template, script, style and data in one file that opens from disk without a network.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..results.files import to_json_types

if TYPE_CHECKING:
    from jinja2 import Environment

TEMPLATE_FOLDER = Path(__file__).with_name("page")

#: allows the scripts, styles and pictures inside the page and forbids all network requests
CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; "
    "form-action 'none'"
)

_ABSOLUTE_PATH = re.compile(r"(?<![\w./:])(?:/[\w.+@ -]*[\w.+@-])+")
#: a path to a folder that has little in common with the one it starts from
_DISTANT_PATH = re.compile(r"(?<![\w./])(?:\.\./){3,}[\w.+@/ -]*[\w.+@-]")


@cache
def _jinja_environment() -> Environment:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(TEMPLATE_FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_hide_folders,
    )
    environment.filters["breakable"] = _breakable
    return environment


def _breakable(name: str) -> str:
    """Return a dotted name as HTML that may be broken after its points and underscores."""
    from markupsafe import escape

    return safe_markup(re.sub(r"(?<=[._])(?=\w)", "<wbr>", str(escape(name))))


def _hide_folders(value: Any) -> Any:
    """Return a text of a page without folders of this machine, because pages are shared.

    Other values are returned unchanged.

    A path below the working directory becomes relative. Another one, also one that climbs three
    folders or more, is replaced by its file name.
    """
    from markupsafe import Markup

    if isinstance(value, Markup) or not isinstance(value, str | Path):
        return value
    text = _ABSOLUTE_PATH.sub(lambda found: _shown_path(Path(found[0])), str(value))
    return _DISTANT_PATH.sub(lambda found: Path(found[0]).name, text)


def _shown_path(path: Path) -> str:
    folder = Path.cwd()
    if path.is_relative_to(folder):
        return str(path.relative_to(folder))
    return path.name if len(path.parts) > 2 and Path(*path.parts[:2]).is_dir() else str(path)


@cache
def _page_assets() -> dict[str, Any]:
    names = ("replay.js", "tables.js", "replay.css")
    script, table_script, style = (
        (TEMPLATE_FOLDER / "bundle" / name).read_text(encoding="utf-8") for name in names
    )
    return {
        "script": safe_markup(script.replace("</script", "<\\/script")),
        "table_script": safe_markup(table_script),
        "style": safe_markup(style),
        "policy": CONTENT_SECURITY_POLICY,
    }


def safe_markup(text: str) -> str:
    """Mark text as HTML that is not escaped; only for text that this package has generated."""
    from markupsafe import Markup

    return Markup(text)  # noqa: S704


def render_page(template: str, **values: Any) -> str:
    """Return a page as HTML.

    All `values` are escaped, and freed from folders of this machine, except those of `safe_markup`.
    """
    return _jinja_environment().get_template(template).render(**{**_page_assets(), **values})


def embed_json(data: Any) -> str:
    """Return data as JSON that is safe inside a script element, whatever texts it contains."""
    text = json.dumps(
        to_json_types(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False
    )
    return safe_markup(text.replace("<", "\\u003c"))
