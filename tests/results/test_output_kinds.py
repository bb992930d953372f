"""Outputs that are links, devices, FIFOs, sockets and folders."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from cosim.core.errors import InputError
from cosim.results.files import check_output_file, remove_files, write_file

root_only = pytest.mark.skipif(os.geteuid() != 0, reason="only root creates device nodes")


@pytest.fixture
def target(tmp_path: Path) -> Path:
    """A file with the text "old"."""
    target = tmp_path / "data" / "target.csv"
    target.parent.mkdir()
    target.write_text("old")
    return target


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_link_is_kept_and_its_target_written(tmp_path: Path, target: Path) -> None:
    link = tmp_path / "link.csv"
    link.symlink_to("data/target.csv")
    write_file(link, "new")
    assert link.readlink() == Path("data/target.csv")
    assert target.read_text() == "new"
    assert names(target.parent) == ["target.csv"]


def test_a_link_to_a_link_is_followed(tmp_path: Path, target: Path) -> None:
    (tmp_path / "first").symlink_to("second")
    (tmp_path / "second").symlink_to(target)
    write_file(tmp_path / "first", "new")
    assert (tmp_path / "first").is_symlink()
    assert (tmp_path / "second").is_symlink()
    assert target.read_text() == "new"


def test_a_dangling_link_gets_its_target(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("missing/folder/target")
    write_file(link, "new")
    assert link.is_symlink()
    assert (tmp_path / "missing/folder/target").read_text() == "new"


def test_a_failure_keeps_link_and_target(tmp_path: Path, target: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(target)
    with pytest.raises(UnicodeEncodeError):
        write_file(link, "\udc80")
    assert target.read_text() == "old"
    assert names(target.parent) == ["target.csv"]


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("folder", "Is a directory"),
        ("link to a folder", "Is a directory"),
        ("loop", "symbolic links"),
        ("socket", "Is a socket; expected a file, a FIFO or a character device"),
        ("block device", "Is a block device"),
    ],
)
def test_what_is_refused_stays(tmp_path: Path, kind: str, message: str) -> None:
    output = tmp_path / "output"
    connection = socket.socket(socket.AF_UNIX)
    match kind:
        case "folder":
            output.mkdir()
        case "link to a folder":
            output.symlink_to(".")
        case "loop":
            output.symlink_to("other")
            (tmp_path / "other").symlink_to("output")
        case "socket":
            connection.bind(str(output))
        case _:
            if os.geteuid() != 0:
                pytest.skip("only root creates device nodes")
            os.mknod(output, 0o060600, os.makedev(250, 250))
    before = names(tmp_path), output.lstat().st_mode, output.lstat().st_ino
    for use in (lambda: write_file(output, "new"), lambda: check_output_file(output)):
        with pytest.raises(InputError, match=f'cannot write .*output"?: .*{message}'):
            use()
    with pytest.raises(InputError, match=f"cannot replace .*{message}"):
        remove_files(tmp_path, "output")
    assert (names(tmp_path), output.lstat().st_mode, output.lstat().st_ino) == before
    connection.close()


def test_a_fifo_with_a_reader_is_written(tmp_path: Path) -> None:
    fifo, received = tmp_path / "fifo", []
    os.mkfifo(fifo)
    reader = threading.Thread(target=lambda: received.append(fifo.read_text()))
    reader.start()
    while not received:
        try:
            write_file(fifo, "x" * 100_000)  # more than the buffer of a pipe
        except InputError:  # the reader has not opened it yet
            continue
        reader.join()
    assert received == ["x" * 100_000]
    assert fifo.is_fifo()


def test_a_fifo_without_a_reader_is_refused_at_once(tmp_path: Path) -> None:
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    assert check_output_file(fifo) is None
    remove_files(tmp_path, "fifo")
    with pytest.raises(InputError, match=r"No process reads this FIFO: .*fifo"):
        write_file(fifo, "text")
    assert fifo.is_fifo()


@root_only
def test_a_device_is_written_and_not_replaced(tmp_path: Path) -> None:
    null = tmp_path / "null"
    os.mknod(null, 0o020666, os.makedev(1, 3))  # the numbers of the null device
    link = tmp_path / "link"
    link.symlink_to(null)
    for output in (null, link):
        write_file(output, "text")
        remove_files(tmp_path, output.name)
        assert check_output_file(output) is None
    assert null.is_char_device()
    assert link.is_symlink()
    assert names(tmp_path) == ["link", "null"]


@root_only
def test_a_full_device_is_an_error(tmp_path: Path) -> None:
    full = tmp_path / "full"
    os.mknod(full, 0o020666, os.makedev(1, 7))
    with pytest.raises(Exception, match="No space left on device"):
        write_file(full, "text")


def run_python(code: str, folder: Path, **options: object) -> subprocess.CompletedProcess[str]:
    start = "from cosim.results.files import *; from cosim.core.paths import *\n"
    return subprocess.run(
        [sys.executable, "-c", start + code],
        cwd=folder,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},  # type: ignore[call-overload]
    )


def test_standard_output_continues_where_it_is(tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.write_text("first\n")
    code = "print('second', flush=True); write_file('/dev/stdout', 'third\\n'); print('fourth')"
    with log.open("a") as output:
        run_python(code, tmp_path, stdout=output)
    assert log.read_text() == "first\nsecond\nthird\nfourth\n"
    assert run_python("write_file('/dev/fd/1', 'text')", tmp_path).stdout == "text"


def test_a_duplicate_survives_a_redirection(tmp_path: Path) -> None:
    code = "path = duplicate_descriptor(Path('/dev/stdout')); os.dup2(2, 1); write_file(path, 'x')"
    assert run_python(code, tmp_path).stdout == "x"


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that every user can reach, unlike `tmp_path`."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o777)
        yield folder


def error_as_other_user(function: Callable[[], object]) -> str:
    """Call a function in a process that is not root, and return the text of its InputError."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            if os.geteuid() == 0:
                os.setuid(65534)
            function()
        except InputError as error:
            os.write(writer, str(error).encode())
        finally:
            os._exit(0)
    os.close(writer)
    os.waitpid(child, 0)
    with os.fdopen(reader) as stream:
        return stream.read()


def test_a_file_in_a_read_only_folder_is_refused(open_folder: Path) -> None:
    """A link leads out of such a folder."""
    folder, outside = open_folder / "folder", open_folder / "outside"
    folder.mkdir()
    file, link = folder / "file", folder / "link"
    file.write_text("old")
    file.chmod(0o666)
    link.symlink_to(outside)
    folder.chmod(0o555)
    expected = "cannot write .*Permission denied"
    assert re.match(expected, error_as_other_user(lambda: write_file(file, "new")))
    assert re.match(expected, error_as_other_user(lambda: check_output_file(file)))
    assert error_as_other_user(lambda: write_file(link, "new")) == ""
    folder.chmod(0o755)
    assert file.read_text() == "old"
    assert outside.read_text() == "new"
    assert names(folder) == ["file", "link"]
