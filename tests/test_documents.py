"""README and docs are true: their commands run, their tables name what exists."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from cosim_command import run_cosim

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
#: documents whose blocks are executed one by one; `docs/test_tutorials.py` executes the others in
#: order
WITH_SINGLE_BLOCKS = [
    document for document in DOCUMENTS if document.name not in ("analysis.md", "python.md")
]


def blocks(language):
    for document in WITH_SINGLE_BLOCKS:
        for text in re.findall(rf"```{language}\n(.*?)```", document.read_text(), re.DOTALL):
            yield pytest.param(text, id=f"{document.name}: {text.splitlines()[0][:40]}")


def commands():
    """Every command line of the documents that runs cosim or Python, and what the document shows of
    its output.
    """
    for document in WITH_SINGLE_BLOCKS:
        for block, shown in re.findall(
            r"```sh\n(.*?)```\n(?:\n```text\n(.*?)```)?", document.read_text(), re.DOTALL
        ):
            for line in re.split(r"\n|&&", block):
                if line.strip().startswith(("cosim ", "python docs/")) and "build" not in line:
                    yield pytest.param(line.strip(), shown, id=line.strip())


@pytest.mark.parametrize(("command", "shown"), list(commands()))
def test_commands_run_and_print_what_is_shown(command, shown, tmp_path):
    program, *words = (
        str(ROOT / word) if (ROOT / word).is_file() else word for word in shlex.split(command)
    )
    if program == "cosim":
        done = run_cosim(*words, cwd=tmp_path)
    else:
        done = subprocess.run(
            [sys.executable, *words], cwd=tmp_path, capture_output=True, text=True, check=False
        )
    assert done.returncode == 0, done.stderr
    assert missing_lines(shown, done.stdout) == []


def missing_lines(shown, output):
    """Return the lines that a document shows and that were not printed; the last digits of numbers
    may differ.
    """
    printed = [line.split() for line in output.splitlines()]
    missing = []
    for line in shown.splitlines():
        words = line.split()
        if "─" not in line and not any(alike(words, others) for others in printed):
            missing.append(line)
    return missing


def alike(words, others):
    return len(words) == len(others) and all(
        a == b or number(a) == pytest.approx(number(b), rel=1e-3)
        for a, b in zip(words, others, strict=True)
    )


def number(word):
    return float(word) if re.fullmatch(r"-?[\d.]+(e-?\d+)?", word) else float("nan")


@pytest.mark.parametrize("code", list(blocks("python")))
def test_python_examples_run(code, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("text", list(blocks("json")))
def test_json_examples_satisfy_the_schema(text):
    import jsonschema

    example = json.loads(text)
    jsonschema.validate(example, schema(example))


def schema(example):
    """The schema of what an example is."""
    from cosim.scenario.extension_schema import editor_schema
    from cosim.scenario.schema_types import schema_of
    from cosim.studies import schema as sweeps

    for key, kind in (
        ("factors", sweeps.SweepSpec),
        ("minimize", sweeps.TuneSpec),
        ("keep", sweeps.WorstCaseSpec),
    ):
        if key in example:
            return schema_of(kind)
    return editor_schema(nested="ports" in example)


@pytest.mark.parametrize(
    "keeper", ["../controllers/python/course_keeper.py:CourseKeeper", "my_keeper.py:Keeper"]
)
def test_the_example_scenario_runs(tmp_path, keeper):
    """With the KPI and the gust of the same page; also with the page's own component."""
    text = (ROOT / "docs/scenarios.md").read_text()
    (scenario,) = (
        block for block in re.findall(r"```json\n(.*?)```", text, re.DOTALL) if "stop_time" in block
    )
    component, kpi = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    scenario = re.sub(r"[^\"]*course_keeper.py:CourseKeeper", keeper, scenario)
    (tmp_path / "example.json").write_text(scenario.replace("../", f"{ROOT}/"))
    (tmp_path / "my_keeper.py").write_text(component)
    (tmp_path / "my_kpis.py").write_text(kpi)
    (tmp_path / "gust.csv").write_text("time,force\n0,0\n3,0.2\n4,0\n")
    done = run_cosim("run", "example.json", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "course.value" in done.stdout


def is_reachable(document, target):
    """True for an address or a file, so that a link is valid in a clone too."""
    return target.startswith("https://") or (document.parent / target).exists()


FOLDERS_WITH_DOCUMENTS = (
    "cosim",
    "plant_src",
    "controllers",
    "scenarios",
    "docs",
    "tests",
    ".github",
)


def all_documents():
    """Return every Markdown file of the repository."""
    found = set(ROOT.glob("*.md"))
    for folder in FOLDERS_WITH_DOCUMENTS:
        found.update((ROOT / folder).rglob("*.md"))
    return sorted(path for path in found if "node_modules" not in path.parts)


@pytest.mark.parametrize(
    "document", [pytest.param(path, id=str(path.relative_to(ROOT))) for path in all_documents()]
)
def test_links_lead_somewhere(document):
    text = re.sub(r"```.*?```", "", document.read_text(), flags=re.DOTALL)
    targets = re.findall(r"\]\(([^)#]+)", text)
    assert [target for target in targets if not is_reachable(document, target)] == []


def test_every_scenario_is_listed():
    text = (ROOT / "docs/shipped_scenarios.md").read_text()
    missing = [
        path.stem
        for path in sorted((ROOT / "scenarios").glob("*.json"))
        if f"`{path.stem}`" not in text
    ]
    assert missing == []


def test_every_command_is_listed():
    from cosim.cli import COMMANDS

    text = (ROOT / "docs/commands.md").read_text()
    assert re.findall(r"^\| `cosim ([\w-]+)", text, re.MULTILINE) == list(COMMANDS)


@pytest.mark.slow
def test_the_routes_of_values_are_up_to_date():
    command = [sys.executable, ROOT / "tests/support/value_routes.py", "--check"]
    done = subprocess.run(command, capture_output=True, text=True, stdin=subprocess.DEVNULL)
    assert done.returncode == 0, done.stderr
