"""Modelica libraries: search in folders, required versions, and a digest of their contents.

A library is a folder with `package.mo` or a file `NAME.mo`. The name may contain a version
(`Modelica 4.1.0`). Libraries are searched in the given folders and then in those of the environment
variable MODELICAPATH (Modelica Language Specification 3.6, section 13.3.4). The annotation `uses`
requires versions. The annotation `conversion(noneFromVersion=...)` of a library names older
versions that it replaces without changes (section 18.8).
"""

import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path

from ....core.errors import InputError, Problem, did_you_mean, join_alternatives

_PATH_VARIABLE = "MODELICAPATH"
_PACKAGE_FILE = "package.mo"
#: library whose absence is reported even without the annotation `uses`
_STANDARD_LIBRARY = "Modelica"
_FOLDER_NAME = re.compile(r"(?P<name>[A-Za-z_]\w*)( (?P<version>\d.*))?")
#: comments and strings; the strings of an annotation that are needed have no quotation marks inside
_COMMENT_OR_STRING = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"', re.DOTALL)
_REFERENCE = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\s*\.\s*[A-Za-z_]")
_WORD = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?=\s*[\w(\[])")
_ARGUMENT = re.compile(r"\s*([\w.]+)\s*(=|\()\s*")
_LIBRARY_FILES = (".mo", ".c", ".h")


@dataclass(frozen=True)
class Library:
    """A library found on this machine.

    Attributes:
        name: Name of its package.
        path: Its folder, or its file.
    """

    name: str
    path: Path

    @property
    def package_file(self) -> Path:
        """File with the package itself."""
        return self.path / _PACKAGE_FILE if self.path.is_dir() else self.path

    @property
    def link_name(self) -> str:
        """Name of a link to the library, without a version."""
        return self.name if self.path.is_dir() else f"{self.name}.mo"

    @property
    def version(self) -> str:
        """Version of its annotation or of its folder's name; "" if it has none."""
        annotation = top_annotation(self.package_file)
        return _string(annotation.get("version", "")) or _version_in_name(self.path.name)

    @property
    def uses(self) -> dict[str, str]:
        """Required version of each library that it uses; "" for any version."""
        return required_versions(top_annotation(self.package_file))

    def replaces(self, version: str) -> bool:
        """Return whether models that were made with this version work without conversion."""
        if version in ("", self.version):
            return True
        conversion = split_arguments(top_annotation(self.package_file).get("conversion", ""))
        return any(
            version == _string(value) for name, value in conversion if name == "noneFromVersion"
        )

    @cached_property
    def files(self) -> list[Path]:
        """All files of the library in Modelica and C, sorted."""
        if self.path.is_file():
            return [self.path]
        return sorted(path for path in self.path.rglob("*") if path.suffix in _LIBRARY_FILES)

    @cached_property
    def digest(self) -> str:
        """SHA-256 digest of the names and contents of all files, as hexadecimal text."""
        digest = sha256()
        for file in self.files:
            content = file.read_bytes()
            digest.update(
                f"{file.relative_to(self.path.parent)}\0{len(content)}\0".encode() + content
            )
        return digest.hexdigest()

    def __str__(self) -> str:
        return f"{self.name} {self.version}".strip()


def library_folders(given: Sequence[Path]) -> list[Path]:
    """Return the folders that are searched for libraries.

    The given ones, then those of MODELICAPATH.
    """
    listed = [Path(each) for each in os.environ.get(_PATH_VARIABLE, "").split(os.pathsep) if each]
    return list(dict.fromkeys(folder.absolute() for folder in (*given, *listed)))


def libraries_in(folders: Iterable[Path]) -> Iterator[Library]:
    """Yield the libraries of folders in the order of search; a folder may also be a library itself.

    Raises:
        InputError: A folder does not exist.
    """
    for folder in folders:
        if not folder.is_dir():
            raise InputError(Problem("no such folder of Modelica libraries", str(folder)))
        if (folder / _PACKAGE_FILE).is_file():
            yield Library(_name_of(folder), folder)
            continue
        entries = [entry for entry in folder.iterdir() if _is_library(entry)]
        for entry in sorted(entries, key=_preference):
            yield Library(_name_of(entry), entry)


def find_libraries(
    files: Sequence[Path], folders: Sequence[Path], known: Collection[str]
) -> list[Library]:
    """Return the libraries that a model needs, including those that they use themselves.

    Args:
        files: The files of the model.
        folders: Folders that are searched.
        known: Names of packages that are not searched, because they are beside the model.

    Raises:
        InputError: A folder does not exist, or a library is not found in a version that fits.
    """
    available = list(libraries_in(folders))
    names = {library.name: library.path.is_file() for library in available}
    queue = []
    for file in files:
        queue += [(*each, file) for each in _used_names(file, names).items()]
    found: dict[str, Library] = {}
    while queue:
        name, version, user = queue.pop(0)
        if name in known or (name in found and found[name].replaces(version)):
            continue
        if name in found:
            raise InputError(
                Problem(
                    f"uses the library {name} {version}, but another file uses {found[name]}",
                    _place(user, name),
                )
            )
        found[name] = _choose(name, version, available, user)
        queue += [
            (used, needed, found[name].package_file) for used, needed in found[name].uses.items()
        ]
    return list(found.values())


def _used_names(file: Path, names: Mapping[str, bool]) -> dict[str, str]:
    """Return the required version of each library that a file uses.

    Those of `uses`, and those of `names` that it refers to.

    A library in a single file (value True), such as `Complex`, may also be a class that
    declarations name alone.
    """
    text = file.read_text(encoding="utf-8", errors="replace")
    code = _COMMENT_OR_STRING.sub(" ", text)
    references = {match[1] for match in _REFERENCE.finditer(code)}
    references |= {name for name in _WORD.findall(code) if names.get(name)}
    return dict.fromkeys(sorted(references & {*names, _STANDARD_LIBRARY}), "") | required_versions(
        _top_annotation_of(text)
    )


def _choose(name: str, version: str, available: Sequence[Library], user: Path) -> Library:
    candidates = [library for library in available if library.name == name]
    for library in candidates:
        if library.replaces(version):
            return library
    wanted = f"{name} {version}".strip()
    if candidates:
        found = join_alternatives([f'{library} in "{library.path}"' for library in candidates])
        raise InputError(Problem(f"uses the library {wanted}, found {found}", _place(user, name)))
    hint = did_you_mean(name, {library.name for library in available})
    text = (
        f"uses the library {wanted}, which is not found; add its folder to {_PATH_VARIABLE} or "
        f"pass --library{hint}"
    )
    raise InputError(Problem(text, _place(user, name)))


def _place(user: Path, library: str) -> str:
    """Return the place of the first line of a file with the name of a library."""
    lines = user.read_text(encoding="utf-8", errors="replace").splitlines()
    number = next((k for k, line in enumerate(lines, 1) if re.search(rf"\b{library}\b", line)), 1)
    return f"{user}:{number}"


def _is_library(entry: Path) -> bool:
    if entry.suffix == ".mo":
        return (
            entry.name != _PACKAGE_FILE
            and _FOLDER_NAME.fullmatch(entry.name.removesuffix(".mo")) is not None
        )
    return (entry / _PACKAGE_FILE).is_file() and _FOLDER_NAME.fullmatch(entry.name) is not None


def _name_of(path: Path) -> str:
    return path.name.removesuffix(".mo").partition(" ")[0]


def _version_in_name(name: str) -> str:
    return name.removesuffix(".mo").partition(" ")[2]


def _preference(entry: Path) -> tuple[str, bool, list[int], str]:
    """Return the key by which folders without version come first, then the newest version."""
    version = _version_in_name(entry.name)
    return (
        _name_of(entry),
        version != "",
        [-int(number) for number in re.findall(r"\d+", version)],
        version,
    )


# -- annotations


def top_annotation(package_file: Path) -> Mapping[str, str]:
    """Return the arguments of the annotation of the top-level class of a file.

    Name -> text of its value.
    """
    return _annotation_of_file(package_file, package_file.stat().st_mtime_ns)


@cache
def _annotation_of_file(package_file: Path, _modified: int) -> Mapping[str, str]:
    return _top_annotation_of(package_file.read_text(encoding="utf-8", errors="replace"))


def _top_annotation_of(text: str) -> Mapping[str, str]:
    """Return the arguments of the last annotation of a text, that of its top-level class."""
    tokens = re.finditer(rf"{_COMMENT_OR_STRING.pattern}|\bannotation\s*(?=\()", text, re.DOTALL)
    ends = [token.end() for token in tokens if token[0].startswith("annotation")]
    return dict(split_arguments(_inside_parentheses(text[ends[-1] :]))) if ends else {}


def required_versions(annotation: Mapping[str, str]) -> dict[str, str]:
    """Return the library versions of the annotation `uses`; "" for any version."""
    uses = split_arguments(annotation.get("uses", ""))
    return {name: _string(dict(split_arguments(value)).get("version", "")) for name, value in uses}


def split_arguments(text: str) -> list[tuple[str, str]]:
    """Split the arguments of an annotation into names and texts of values.

    >>> split_arguments('version="1.0", uses(Lib(version="2"))')
    [('version', '"1.0"'), ('uses', 'Lib(version="2")')]
    """
    arguments = []
    # split at the commas outside of parentheses, strings and comments
    parts, start = [], 0
    for position, character, depth in _significant(text):
        if character == "," and depth == 0:
            parts.append(text[start:position])
            start = position + 1
    for part in [*parts, text[start:]]:
        if match := _ARGUMENT.match(part):
            rest = part[match.end() :].strip()
            arguments.append(
                (match[1], rest if match[2] == "=" else _inside_parentheses(f"({rest}"))
            )
    return arguments


def _inside_parentheses(text: str) -> str:
    """Return the text between the first character, a parenthesis, and the one that closes it."""
    for position, character, depth in _significant(text):
        if character == ")" and depth == 0:
            return text[1:position]
    return text[1:]


def _significant(text: str) -> Iterator[tuple[int, str, int]]:
    """Yield position, character and depth of the commas and parentheses of the code."""
    depth = 0
    for token in re.finditer(rf"{_COMMENT_OR_STRING.pattern}|[,(){{}}]", text, re.DOTALL):
        character = token[0]
        depth -= character in (")", "}")
        if len(character) == 1:
            yield token.start(), character, depth
        depth += character in ("(", "{")


def _string(text: str) -> str:
    """Return the value of a string literal; other texts as they are."""
    return text.strip().strip('"')
