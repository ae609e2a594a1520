"""What a URDF says its links look like: boxes, cylinders, spheres and meshes that lie on this disk.

Appearance never stops anybody: a visual that cannot be read, or a mesh that is not here, is
counted and left out. Nothing is fetched.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree

from linkwise.base import Array
from linkwise.io.files import resolve_mesh
from linkwise.io.numbers import parse_numbers
from linkwise.io.urdf_elements import placement
from linkwise.io.xml import local_name, parse_xml

Color = tuple[float, float, float, float]
MESH_SUFFIXES = (".stl", ".dae", ".obj", ".ply", ".glb", ".off")
MESH_BYTES = 64 << 20
"""Largest mesh file read."""
MOST = 1e18
"""Largest length or coordinate drawn, m; pictures have single precision, and square them."""


@dataclass(frozen=True)
class Visual:
    """One shape on a link.

    shape: "box", "cylinder" (along z), "sphere" or "mesh"; placement: (4, 4) in the link's frame;
    size: box edges, (radius, radius, length), (radius, radius, radius) or the mesh's scale;
    color: red, green, blue, opacity in 0..1, None where the file gives none.
    """

    link: str
    shape: str
    placement: Array
    size: tuple[float, float, float]
    color: Color | None = None
    path: Path | None = None


@dataclass(frozen=True)
class Appearance:
    """The visuals of a file, the names of its links, and the mesh references not found here."""

    visuals: list[Visual]
    links: list[str]
    missing: list[str]


def read_appearance(
    path: str | os.PathLike[str], package_dirs: Sequence[str | os.PathLike[str]] = ()
) -> Appearance:
    """The visuals of a URDF; none of a file that is something else.

    Raises InputError where :func:`linkwise.io.xml.parse_xml` does.
    """
    root = parse_xml(path)
    appearance = Appearance([], [], [])
    if local_name(root) != "robot":
        return appearance
    named = {
        element.get("name", ""): color
        for element in root.iterchildren(tag=etree.Element)
        if local_name(element) == "material" and (color := _color(element)) is not None
    }
    for link in root.iterchildren(tag=etree.Element):
        if local_name(link) != "link":
            continue
        name = link.get("name", "")
        appearance.links.append(name)
        for element in link.iterchildren(tag=etree.Element):
            if local_name(element) != "visual":
                continue
            try:
                found = _visual(name, element, named, path, package_dirs, appearance.missing)
            except ValueError:
                continue
            if found is not None:
                appearance.visuals.append(found)
    return appearance


def _child(element: etree._Element, name: str) -> etree._Element | None:
    children = element.iterchildren(tag=etree.Element)
    return next((child for child in children if local_name(child) == name), None)


def _triple(element: etree._Element, name: str, default: str | None = None) -> Array:
    text = element.get(name, default)
    return np.array(parse_numbers(text or "", 3))


def _length(element: etree._Element, name: str) -> float:
    return float(parse_numbers(element.get(name, ""), 1)[0])


def _color(material: etree._Element) -> Color | None:
    element = _child(material, "color")
    if element is None:
        return None
    try:
        red, green, blue, opacity = np.clip(parse_numbers(element.get("rgba", ""), 4), 0.0, 1.0)
    except ValueError:
        return None
    return (float(red), float(green), float(blue), float(opacity))


def _placement(origin: etree._Element | None) -> Array:
    if origin is None:
        return np.eye(4)
    return placement(_triple(origin, "xyz", "0 0 0"), _triple(origin, "rpy", "0 0 0"))


def _visual(
    link: str,
    element: etree._Element,
    named: dict[str, Color],
    model_file: str | os.PathLike[str],
    package_dirs: Sequence[str | os.PathLike[str]],
    missing: list[str],
) -> Visual | None:
    """One <visual>; None without a shape or without its mesh. ValueError for broken numbers."""
    geometry = _child(element, "geometry")
    shape = None if geometry is None else next(geometry.iterchildren(tag=etree.Element), None)
    if shape is None:
        return None
    material = _child(element, "material")
    color = None
    if material is not None:
        color = _color(material) or named.get(material.get("name", ""))
    pose = _placement(_child(element, "origin"))
    kind, path = local_name(shape), None
    if kind == "box":
        size = _triple(shape, "size")
    elif kind == "cylinder":
        radius = _length(shape, "radius")
        size = np.array([radius, radius, _length(shape, "length")])
    elif kind == "sphere":
        size = np.full(3, _length(shape, "radius"))
    elif kind == "mesh":
        size = _triple(shape, "scale", "1 1 1")
        reference = shape.get("filename", "")
        path = resolve_mesh(reference, model_file, package_dirs)
        if path is None or not _readable(path):
            missing.append(reference)
            return None
    else:
        return None
    if max(np.abs(pose).max(), np.abs(size).max()) > MOST:
        raise ValueError
    return Visual(link, kind, pose, (float(size[0]), float(size[1]), float(size[2])), color, path)


def _readable(path: Path) -> bool:
    try:
        return path.suffix.lower() in MESH_SUFFIXES and path.stat().st_size <= MESH_BYTES
    except OSError:
        return False
