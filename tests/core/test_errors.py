"""Texts of exceptions that the code of users and libraries raises."""

import json
import runpy
from concurrent.futures import ThreadPoolExecutor

import pytest

from cosim.core.errors import describe_exception


def test_an_exception_inside_a_library_has_the_line_of_the_user_who_called_it(tmp_path):
    script = tmp_path / "settings.py"
    script.write_text('import json\n\nGAINS = json.loads("{")\n')
    with pytest.raises(json.JSONDecodeError) as raised:
        runpy.run_path(str(script))
    assert describe_exception(raised.value).endswith(" (settings.py:3)")


def test_an_exception_without_a_user_has_the_innermost_line_of_the_library():
    with ThreadPoolExecutor() as threads:
        error = threads.submit(json.loads, "{").exception()
    assert " (decoder.py:" in describe_exception(error)
