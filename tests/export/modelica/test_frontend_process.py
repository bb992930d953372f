"""Front end of Modelica in a child process: a crash, a hang and excessive memory are one error that
names the file.
"""

from __future__ import annotations

import os
import re
import threading
from pathlib import Path

import pytest

from cosim.core.errors import InputError
from cosim.export.modelica import load_block
from cosim.export.modelica.frontend import model_files, rumoca_client

pytestmark = pytest.mark.slow

pytest.importorskip("rumoca")


def model(folder: Path, equation: str, declarations: str = "", name: str = "m") -> Path:
    path = folder / f"{name}.mo"
    path.write_text(
        f"model {name}\n  input Real u;\n  output Real y;\n{declarations}equation\n{equation}\nend "
        f"{name};\n"
    )
    return path


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as refused:
        load_block(path)
    assert len(refused.value.problems) == 1
    return str(refused.value)


def nested(count: int, begin: str, end: str) -> str:
    return f"  y = {begin * count}u{end * count};"


@pytest.mark.parametrize("equation", [nested(20_000, "(", ")"), nested(20_000, "-(", ")")])
def test_a_crash_of_the_front_end_names_the_file(tmp_path, equation):
    path = model(tmp_path, equation)
    words = (
        "the Modelica front end failed on this file: the process was ended by signal 11 (SIGSEGV, "
        "segmentation fault)"
    )
    assert refusal(path) == f"{path}: {words}"


def test_a_crash_over_a_package_names_the_file_of_the_model(tmp_path):
    package = tmp_path / "P"
    package.mkdir()
    (package / "package.mo").write_text("package P\nend P;\n")
    deep = model(package, nested(20_000, "(", ")"), name="Deep")
    deep.write_text("within P;\n" + deep.read_text())
    path = model(tmp_path, "  d.u = u;\n  y = d.y;", "  P.Deep d;\n")
    assert refusal(path).startswith(f"{path}: the Modelica front end failed on this file")


@pytest.mark.parametrize(
    "equation", [nested(500, "-(", ")"), nested(500, "abs(", ")"), "  y = u" + "+u" * 500 + ";"]
)
def test_an_expression_too_deep_for_the_compiler_is_refused(tmp_path, equation):
    path = model(tmp_path, equation)
    assert (
        refusal(path)
        == f"{path}: an expression or statement is nested too deeply; divide it into several"
    )


def test_ordinary_depth_is_compiled(tmp_path):
    assert load_block(model(tmp_path, nested(1000, "(", ")"))).identifier == "m"


def test_a_hang_ends_at_the_deadline(tmp_path, monkeypatch):
    monkeypatch.setattr(rumoca_client, "CPU_LIMIT", 1)
    path = model(
        tmp_path,
        "  y = a[1];\n  for i in 1:1000000 loop a[i] = u; end for;",
        "  Real a[1000000];\n",
    )
    assert re.search(
        r"failed on this file: (it did not end within 1 s|.* signal \d+ )", refusal(path)
    )


def test_excessive_memory_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(rumoca_client, "MEMORY_LIMIT", 100 << 20)
    path = model(
        tmp_path,
        "  y = a[1];\n  for i in 1:100000000 loop a[i] = u; end for;",
        "  Real a[100000000];\n",
    )
    assert "the Modelica front end failed on this file: it needs more than" in refusal(path)


def test_a_large_answer_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(rumoca_client, "OUTPUT_LIMIT", 1000)
    assert "the Modelica front end failed on this file" in refusal(model(tmp_path, "  y = u;"))


@pytest.mark.parametrize("size", ["1000001", "1000, 1001", "1000000000"])
def test_a_model_with_too_many_values_is_refused(tmp_path, size):
    path = model(tmp_path, "  y = u;", f"  parameter Real a[{size}];\n")
    assert "a: the model has more than 1000000 values" in refusal(path)


def test_a_file_that_is_too_large_or_no_text_is_refused(tmp_path, monkeypatch):
    path = model(tmp_path, "  y = u;")
    path.write_bytes(b"model m // \xe9\nend m;")
    assert (
        refusal(path) == f"{path}: the file is not UTF-8 text: invalid continuation byte at byte 11"
    )
    monkeypatch.setattr(model_files, "MAX_SOURCE_SIZE", 10)
    assert refusal(path) == f"{path}: the file has 19 bytes, expected at most 10"


def test_a_package_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "P").mkdir()
    (tmp_path / "P" / "package.mo").write_bytes(
        b"package P // \xe9\n constant Real k = 2;\nend P;\n"
    )
    message = refusal(model(tmp_path, "  y = P.k*u;"))
    assert message.startswith(f"{tmp_path}/P/package.mo:1: the file cannot be read: 'utf-8' codec")


def test_models_are_compiled_in_threads_and_after_a_fork(tmp_path):
    path, found = model(tmp_path, "  y = u;"), []
    threads = [
        threading.Thread(target=lambda: found.append(load_block(path).identifier)) for _ in range(3)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == ["m"] * 3
    child = os.fork()
    if child == 0:
        os._exit(load_block(path).identifier != "m")
    assert os.waitpid(child, 0)[1] == 0
