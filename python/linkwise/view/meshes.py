"""Mesh files as trimesh objects."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from linkwise.io.urdf_visuals import MOST

if TYPE_CHECKING:
    import trimesh

MOST_FACES = 2_000_000


def load_mesh(
    path: Path, color: tuple[float, float, float, float] | None
) -> trimesh.Trimesh | None:
    """The mesh of a local file as one piece, in its own colours, or in `color` if it has none.

    None when the file cannot be read, or holds a corner at no place that can be drawn: appearance
    never stops anybody.
    """
    import trimesh

    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            mesh = trimesh.load_scene(path).to_mesh()
    except Exception:  # parsers of a dozen formats, which raise exceptions of any kind
        return None
    if not isinstance(mesh, trimesh.Trimesh) or not 0 < len(mesh.faces) <= MOST_FACES:
        return None
    if not (np.abs(mesh.vertices) <= MOST).all() or mesh.faces.max() >= len(mesh.vertices):
        return None
    if color is not None and (mesh.visual is None or not mesh.visual.defined):
        rgba = np.array(np.round(255 * np.array(color)), dtype=np.uint8)
        mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=rgba)
    return mesh
