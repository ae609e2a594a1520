"""What an MJCF may ask of MuJoCo's compiler, which opens and allocates whatever the file says.

Checked before it sees the file: no other model files, and bounds on everything that a short file
can make large.
"""

from __future__ import annotations

import math
import os
import stat
from pathlib import Path
from typing import NoReturn

from lxml import etree

from linkwise.io.complaint import complain, shorten
from linkwise.io.xml import local_name

MOST_ELEMENTS = 20_000
"""Elements after replication; the compiler's time grows with their square, to half a minute."""
MOST_CELLS = 2**27
"""Texels, heights and numbers that the file orders by their count: 400 MB of texels."""
MOST_ASSET_BYTES = 2**28
"""Meshes, height fields, skins and textures together."""

_OTHER_MODELS = {"include": "a file that is included", "model": "a model in a file of its own"}
_COPIES = {"replicate": ("count",), "composite": ("count",), "flexcomp": ("count", "cellcount")}
_ASSETS = ("mesh", "hfield", "skin", "texture", "flexcomp")
_MOST_PER_ELEMENT = 1000  # user numbers, delay samples and dimensions: every element has them
_PER_ELEMENT = ("nsample", "actdim", "dim", "nuserdata", "nkey")
_PNG = b"\x89PNG\r\n\x1a\n"


def check_mjcf(path: str | os.PathLike[str], root: etree._Element) -> None:
    """Raise InputError where the compiler would read other models or could exhaust the memory."""
    _Check(path, root).run()


class _Check:
    def __init__(self, path: str | os.PathLike[str], root: etree._Element) -> None:
        self.path, self.root = path, root
        self.folders = [Path(path).resolve().parent]
        for compiler in root.iter("compiler"):
            for key in ("meshdir", "texturedir", "assetdir"):
                self.folders.append(self.folders[0] / compiler.get(key, ""))
        self.cells = 0.0
        self.asset_bytes = 0

    def run(self) -> None:
        if self._count(self.root) > MOST_ELEMENTS:
            self._complain(
                self.root,
                f"has more than {MOST_ELEMENTS} elements once all are replicated",
                "build very large models with linkwise.ModelBuilder or linkwise.scenes",
            )
        for element in self.root.iter(etree.Element):
            self._check_numbers(element)
            if local_name(element) in _ASSETS:
                for key, value in element.attrib.items():
                    if str(key).startswith("file"):
                        self._check_file(element, str(value))

    def _count(self, element: etree._Element) -> float:
        """Elements from this one down; replicated ones count as often as they will exist."""
        name = local_name(element)
        if name in _OTHER_MODELS and (name == "include" or element.get("file") is not None):
            self._complain(
                element,
                f"{_OTHER_MODELS[name]} is not read",
                "let MuJoCo write one file: mujoco.mj_saveLastXML('flat.xml', "
                "mujoco.MjModel.from_xml_path(FILE))",
            )
        below = sum(self._count(child) for child in element.iterchildren(etree.Element))
        copies = math.prod(self._numbers(element, key) for key in _COPIES.get(name, ()))
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
            (self._numbers(e, key) for d in self.root.iter("default") for e in d.iter(name)),
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
        self.cells += cells
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
        complain(self.path, f"element '{name}'", problem, remedy, element.sourceline)


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
