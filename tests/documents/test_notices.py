"""THIRD_PARTY_NOTICES.md names what the installed viser and plotly bring into written pages."""

import json
from pathlib import Path

import pytest

NOTICES = (Path(__file__).parents[2] / "THIRD_PARTY_NOTICES.md").read_text(encoding="utf-8")
# Direct dependencies of viser's client that build it and are not in it.
BUILDING = ("@types/", "@vitejs/", "vite", "browserslist", "postcss")


def packages_in_client(lock):
    """Licence of every package that the client is built from."""
    held, found = lock["packages"], {}

    def where(name, base):
        while True:
            path = f"{base}/node_modules/{name}".lstrip("/")
            if path in held or not base:
                return path
            base = base.rpartition("/node_modules/")[0]

    def walk(name, base):
        path = where(name, base)
        if name.startswith(BUILDING) or path not in held or path in found:
            return
        found[path] = held[path].get("license")
        for needed in held[path].get("dependencies", {}):
            walk(needed, path)

    for name in held[""]["dependencies"]:
        walk(name, "")
    return {path.rpartition("node_modules/")[2]: licence for path, licence in found.items()}


def test_packages_of_the_client_are_named_with_their_licences():
    viser = pytest.importorskip("viser", reason="the view needs viser: pip install '.[view]'")
    lock = json.loads((Path(viser.__file__).parent / "client/package-lock.json").read_text())
    found = packages_in_client(lock)
    assert {"three", "react", "zustand"} <= set(found)
    for name, licence in found.items():
        if licence != "MIT":
            rows = [row for row in NOTICES.splitlines() if name in row]
            assert rows, f"{name} ({licence}) is not named"
    assert "@three.ez/instanced-mesh" in NOTICES


def test_plotly_script_carries_its_notice():
    plotly = pytest.importorskip("plotly", reason="reports need plotly: pip install '.[report]'")
    script = (Path(plotly.__file__).parent / "package_data/plotly.min.js").read_text("utf-8")
    for notice in ("Plotly, Inc.", "Licensed under the MIT license"):
        assert notice in script[:300]
    tail = script[-4000:]
    for name in ("buffer", "polybooljs", "safe-buffer", "object-assign", "ieee754", "maplibre-gl"):
        assert name in tail
