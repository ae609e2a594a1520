"""The other model files that an MJCF names: those it includes, and models that it attaches.

MuJoCo's compiler opens whatever they are called, so each is read and parsed with the same care as
the first file, before it sees any of them.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from lxml import etree

from linkwise.io.complaint import complain, shorten
from linkwise.io.encoding import decode_xml
from linkwise.io.files import MODEL_BYTES, read_bytes
from linkwise.io.xml import local_name, parse_xml

MOST_FILES = 256
"""Files of one MJCF, those of attached models included."""


@dataclass
class ModelFiles:
    """One MJCF with the files that it includes, each of them once, and the models it attaches."""

    path: str | os.PathLike[str]
    root: etree._Element
    documents: list[tuple[str | os.PathLike[str], etree._Element]] = field(default_factory=list)
    included: dict[etree._Element, list[etree._Element]] = field(default_factory=dict)
    """The roots that MuJoCo puts in place of an <include>."""
    attached: list[ModelFiles] = field(default_factory=list)

    def path_of(self, element: etree._Element) -> str | os.PathLike[str]:
        """The file in which an element of this model stands."""
        root = element.getroottree().getroot()
        return next((path for path, known in self.documents if known is root), self.path)


def require_utf8(path: str | os.PathLike[str]) -> None:
    """Raise InputError for a file in another encoding than UTF-8."""
    encoding = decode_xml(read_bytes(path, "model file", MODEL_BYTES), path)[1]
    if encoding not in ("utf-8", "ascii"):
        problem = f"is written in {encoding}, and MuJoCo reads UTF-8 alone"
        complain(path, "model file", problem, "save it as UTF-8")


def read_model_files(path: str | os.PathLike[str], root: etree._Element) -> ModelFiles:
    """All files of the MJCF with this root.

    Raises InputError for a file that is missing, no XML, read twice or in a circle, and for more
    than MOST_FILES of them or MODEL_BYTES in all.
    """
    return _Reader().read(path, root, ())


class _Reader:
    def __init__(self) -> None:
        self.count = 0
        self.bytes = 0

    def read(
        self, path: str | os.PathLike[str], root: etree._Element, outer: tuple[Path, ...]
    ) -> ModelFiles:
        files = ModelFiles(path, root)
        own = Path(path).resolve()
        seen = {own}
        waiting = [(path, root)]
        while waiting:
            path, root = waiting.pop(0)
            files.documents.append((path, root))
            for element in root.iter(etree.Element):
                name, file = local_name(element), element.get("file")
                if file is None or name not in ("include", "model"):
                    continue
                found = self._find(files, element, file)
                if name == "include":
                    for other in found:
                        again = other in seen
                        self._refuse_if(
                            again, files, element, "is included already", "include it once"
                        )
                        seen.add(other)
                        waiting.append((other, self._parse(files, element, other)))
                        files.included.setdefault(element, []).append(waiting[-1][1])
                    continue
                for other in found:
                    circle = other in (own, *outer)
                    remedy = "attach another model"
                    self._refuse_if(circle, files, element, "attaches itself in the end", remedy)
                    inner = self._parse(files, element, other)
                    foreign = local_name(inner) != "mujoco"
                    self._refuse_if(foreign, files, element, "is no MJCF", remedy)
                    files.attached.append(self.read(other, inner, (*outer, own)))
        return files

    def _find(self, files: ModelFiles, element: etree._Element, file: str) -> list[Path]:
        """Where MuJoCo looks: beside the main file, then beside the file that names it."""
        folders = [Path(files.path).resolve().parent]
        folders.append(Path(files.path_of(element)).resolve().parent)
        found: dict[Path, None] = {}
        for folder in folders:
            try:
                if (folder / file).exists():
                    found[(folder / file).resolve()] = None
            except (OSError, ValueError):
                continue
        remedy = "write / instead of \\" if "\\" in file else "correct the path"
        self._refuse_if(not found, files, element, "does not exist", remedy)
        return list(found)

    def _parse(self, files: ModelFiles, element: etree._Element, path: Path) -> etree._Element:
        self.count += 1
        many = self.count >= MOST_FILES
        remedy = "put parts of the model into one file"
        self._refuse_if(many, files, element, f"is one of more than {MOST_FILES} files", remedy)
        require_utf8(path)
        self.bytes += path.stat().st_size
        large = f"brings the files to more than {MODEL_BYTES >> 20} MiB"
        remedy = "build very large models with linkwise.ModelBuilder or linkwise.scenes"
        self._refuse_if(self.bytes > MODEL_BYTES, files, element, large, remedy)
        return parse_xml(path)

    def _refuse_if(
        self,
        wrong: bool,
        files: ModelFiles,
        element: etree._Element,
        problem: str,
        remedy: str,
    ) -> None:
        if wrong:
            shown = f"element '{local_name(element)}'"
            problem = f"the file '{shorten(element.get('file', ''), 100)}' {problem}"
            complain(files.path_of(element), shown, problem, remedy, element.sourceline)
