"""What an MJCF may ask of MuJoCo's compiler, which opens and allocates whatever the file says.

Checked before it sees the file, and the model files that this one names: bounds on everything that
a short file can make large.
"""

from __future__ import annotations

import math
import os
import stat
from pathlib import Path
from typing import NoReturn

from lxml import etree

from linkwise.io.complaint import complain, shorten
from linkwise.io.mjcf_files import ModelFiles, read_model_files
from linkwise.io.xml import local_name

MOST_ELEMENTS = 20_000
"""Elements after replication; the compiler's time grows with their square, to half a minute."""
MOST_CELLS = 2**27
"""Texels, heights and numbers that the file orders by their count: 400 MB of texels."""
MOST_ASSET_BYTES = 2**28
"""Meshes, height fields, skins and textures together."""

_COPIES = {"replicate": ("count",), "composite": ("count",), "flexcomp": ("count", "cellcount")}
_ASSETS = ("mesh", "hfield", "skin", "texture", "flexcomp")
_MOST_PER_ELEMENT = 1000  # user numbers, delay samples and dimensions: every element has them
_PER_ELEMENT = ("nsample", "actdim", "dim", "nuserdata", "nkey")
_PNG = b"\x89PNG\r\n\x1a\n"


def check_mjcf(path: str | os.PathLike[str], root: etree._Element) -> None:
    """Raise InputError where the compiler could exhaust the memory, or would read what it must not.

    The model files that this one names are read and checked as it is.
    """
    _Check(read_model_files(path, root)).run()


class _Check:
    def __init__(self, files: ModelFiles, times: float = 1.0) -> None:
        """times: how often the model is attached."""
        self.files, self.times = files, times
        self.folders = [Path(path).resolve().parent for path, _ in files.documents]
        for _, root in files.documents:
            for compiler in root.iter("compiler"):
                for key in ("meshdir", "texturedir", "assetdir"):
                    self.folders.append(self.folders[0] / compiler.get(key, ""))
        self.cells = 0.0
        self.asset_bytes = 0
        self.attaches = 0.0

    def run(self) -> float:
        """Elements of the model once all are replicated."""
        elements = self._count(self.files.root)
        largest = 0.0
        for attached in self.files.attached:
            check = _Check(attached, max(1.0, self.attaches * self.times))
            check.cells, check.asset_bytes = self.cells, self.asset_bytes
            largest = max(largest, check.run())
            self.cells, self.asset_bytes = check.cells, check.asset_bytes
        elements += self.attaches * largest
        if elements > MOST_ELEMENTS:
            self._complain(
                self.files.root,
                f"has more than {MOST_ELEMENTS} elements once all are replicated",
                "build very large models with linkwise.ModelBuilder or linkwise.scenes",
            )
        for _, root in self.files.documents:
            for element in root.iter(etree.Element):
                self._check_numbers(element)
                if local_name(element) in _ASSETS:
                    for key, value in element.attrib.items():
                        if str(key).startswith("file"):
                            self._check_file(element, str(value))
        return elements

    def _count(self, element: etree._Element, times: float = 1.0) -> float:
        """Elements from this one down; replicated ones count as often as they will exist."""
        name = local_name(element)
        copies = math.prod(self._numbers(element, key) for key in _COPIES.get(name, ()))
        self.attaches += times * (name == "attach")
        below = sum(
            self._count(child, times * copies)
            for parent in (element, *self.files.included.get(element, ()))
            for child in parent.iterchildren(etree.Element)
        )
        return float(copies) * (1 + below) if name in _COPIES else 1 + below

    def _numbers(self, element: etree._Element, key: str) -> float:
        """The product of numbers in an attribute; MuJoCo refuses what is not a number."""
        product = 1.0
        for word in element.get(key, "").split():
            try:
                product *= max(1.0, float(word))
            except ValueError:
                return 1.0
        return product if product == product else 1.0

    def _default(self, name: str, key: str) -> float:
        """The largest value that a class of defaults may give to this attribute."""
        return max(
            (
                self._numbers(element, key)
                for _, root in self.files.documents
                for default in root.iter("default")
                for element in default.iter(name)
            ),
            default=1.0,
        )

    def _size(self, element: etree._Element, key: str) -> float:
        if key in element.attrib:
            return self._numbers(element, key)
        return self._default(local_name(element), key)

    def _check_numbers(self, element: etree._Element) -> None:
        name = local_name(element)
        if name == "texture":  # a cube has six sides, whatever height it is given
            width = self._size(element, "width")
            self._add_cells(element, width * max(self._size(element, "height"), 6 * width))
        elif name == "hfield":
            self._add_cells(element, self._size(element, "nrow") * self._size(element, "ncol"))
        elif name == "numeric":
            self._add_cells(element, self._size(element, "size"))
        for key in map(str, element.attrib):
            per_element = key in _PER_ELEMENT or key.startswith("nuser_")
            if per_element and self._numbers(element, key) > _MOST_PER_ELEMENT:
                self._complain(
                    element,
                    f"{key} is larger than {_MOST_PER_ELEMENT}",
                    "leave it out: it has no part in the dynamics",
                )

    def _add_cells(self, element: etree._Element, cells: float) -> None:
        self.cells += cells * self.times
        if self.cells > MOST_CELLS:
            self._complain(
                element,
                f"brings what the file orders by counts to more than {MOST_CELLS} numbers",
                "leave it out: it has no part in the dynamics",
            )

    def _check_file(self, element: etree._Element, name: str) -> None:
        """Bounds of the file that MuJoCo will find under this name, wherever it looks."""
        try:
            found = {f.resolve() for d in self.folders for f in (d / name, d / Path(name).name)}
            kept = [(file, file.stat()) for file in found if file.exists()]
        except (OSError, ValueError):
            return  # MuJoCo says what is wrong with it
        for file, state in kept:
            shown = f"file '{shorten(name, 100)}'"
            if not stat.S_ISREG(state.st_mode):
                self._complain(element, f"{shown} is not a regular file", "give a file")
            self.asset_bytes += state.st_size
            if self.asset_bytes > MOST_ASSET_BYTES:
                self._complain(
                    element,
                    f"{shown} brings the meshes and pictures to more than "
                    f"{MOST_ASSET_BYTES // 2**20} MiB",
                    "leave it out where an <inertial> gives the mass",
                )
            if local_name(element) == "texture":
                self._add_cells(element, _picture_size(file))

    def _complain(self, element: etree._Element, problem: str, remedy: str) -> NoReturn:
        name = shorten(local_name(element))
        path = self.files.path_of(element)
        complain(path, f"element '{name}'", problem, remedy, element.sourceline)


def _picture_size(file: Path) -> int:
    """Pixels of a PNG, whose few bytes may unpack to many; of other formats its bytes."""
    try:
        with open(file, "rb") as opened:
            head = opened.read(24)
    except OSError:
        return 0
    if len(head) < 24 or not head.startswith(_PNG):
        return file.stat().st_size
    return int.from_bytes(head[16:20], "big") * int.from_bytes(head[20:24], "big")
