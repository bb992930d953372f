"""Hooks of MkDocs.

The pages of the repository in their places, and the generated pages of the reference.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from os.path import normpath
from pathlib import Path

from commands import commands_page
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from pages import kpis_page, python_page, scenarios_page, units_page, variables_page
from roles import roles_page
from schema_keys import scenario_keys_page, study_keys_page, world_keys_page

ROOT = Path(__file__).parents[2]
#: documents outside of docs/ that the navigation contains; others are found by links
STARTS = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "plant_src/README.md")
#: files that the theme loads
ASSETS = tuple(
    f"docs/generator/assets/{name}"
    for name in ("iframe-worker.js", "site.css", "names_and_tables.js")
)
#: generated pages
REFERENCE = {
    "commands": commands_page,
    "scenario_keys": scenario_keys_page,
    "study_keys": study_keys_page,
    "world_keys": world_keys_page,
    "python": python_page,
    "variables": variables_page,
    "units": units_page,
    "roles": roles_page,
    "kpis": kpis_page,
    "scenarios": scenarios_page,
}

_LINK = re.compile(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)")
_CODE = re.compile(r"`[^`\n]*`")
#: a server shows the page "404" in place of pages of all folders; a file has no root of the site
_BASE = "location.protocol === 'file:' || document.write('<base href=\"/\">')"
#: first line of a block of code with a word for the tests, such as "fails"
_MANNER = re.compile(r"^(```\w+) \w+$", re.MULTILINE)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Replace the files below docs/ by those of `repository_files`, and add the generated pages."""
    site = Files([file for file in files if file.src_dir != config.docs_dir])
    generated = {f"docs/reference/{name}.md": make_page() for name, make_page in REFERENCE.items()}
    for name, text in generated.items():
        site.append(File.generated(config, name, content=text))
    for name in repository_files(generated):
        site.append(File(name, str(ROOT), config.site_dir, config.use_directory_urls))
    return site


def on_page_markdown(markdown: str, **_: object) -> str:
    """Remove the backslashes before bars in code, and the words for the tests.

    Only GitHub's tables need these backslashes.
    """
    return _MANNER.sub(r"\1", _CODE.sub(lambda code: code[0].replace(r"\|", "|"), markdown))


def on_post_template(output_content: str, template_name: str, **_: object) -> str:
    """Make the links of the page "404" relative, so that it is readable as a file.

    A server shows it at any address.
    """
    if template_name != "404.html":
        return output_content
    relative = re.sub(r'((?:href|src)=")/', r"\1", output_content)
    return relative.replace("<head>", f"<head><script>{_BASE}</script>", 1)


def repository_files(generated: Mapping[str, str]) -> list[str]:
    """Return the documents of the repository and all files that they link to.

    Paths are relative to its root.

    Args:
        generated: texts of the generated pages by path; the files that they link to are returned
            too.

    Raises:
        FileNotFoundError: A document links to another document that does not exist.
    """
    pending = [
        *generated,
        *STARTS,
        *ASSETS,
        *(str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md")),
    ]
    found: set[str] = set()
    while pending:
        name = pending.pop()
        if name in found:
            continue
        found.add(name)
        if name.endswith(".md"):
            text = (
                generated[name] if name in generated else (ROOT / name).read_text(encoding="utf-8")
            )
            pending += [normpath(Path(name).parent / target) for target in _LINK.findall(text)]
    return sorted(found.difference(generated))
