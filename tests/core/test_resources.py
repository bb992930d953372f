"""The cache folder, also where no home folder can be written."""

import os
from pathlib import Path

import pytest

from cosim.core import resources


@pytest.fixture(params=["/proc/none", None], ids=["unwritable", "unknown"])
def homeless(request, tmp_path, monkeypatch):
    """Return the folder for temporary files of a user without a home folder."""
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(resources, "gettempdir", lambda: str(tmp_path))
    home = request.param
    monkeypatch.setattr(
        os.path, "expanduser", lambda path: path.replace("~", home) if home else path
    )
    resources._default_cache.cache_clear()
    yield tmp_path
    resources._default_cache.cache_clear()


def test_the_cache_is_in_the_home_folder(tmp_path, monkeypatch):
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert resources.cache_directory() == tmp_path / ".cache/cosim"
    assert (tmp_path / ".cache/cosim").is_dir()


def test_without_a_home_folder_the_cache_is_private(homeless):
    folder = resources.cache_directory()
    assert folder.parent == homeless
    assert folder.stat().st_mode & 0o777 == 0o700
    assert not Path("~").exists()
    resources._default_cache.cache_clear()
    assert resources.cache_directory() == folder


@pytest.mark.parametrize("kind", ["open", "link", "file"])
def test_a_folder_that_others_can_write_is_no_cache(homeless, kind):
    taken = homeless / f"cosim-{os.getuid()}"
    if kind == "open":
        taken.mkdir()
        taken.chmod(0o777)
    elif kind == "link":
        (homeless / "other").mkdir(0o700)
        taken.symlink_to("other")
    else:
        taken.touch()
    assert resources.cache_directory() != taken


def test_a_folder_that_the_user_names_is_not_replaced(homeless, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/none")
    assert resources.cache_directory() == Path("/proc/none/cosim")
    assert not list(homeless.iterdir())
