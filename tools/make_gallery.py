"""The gallery of the documents, made by the examples: docs/gallery.md and its pictures.

Run it by: python tools/make_gallery.py

Text and title of each are the example's docstring, the numbers what it printed.
"""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

SHOWN = (
    "02_srms_slew",
    "09_ur5_pick_and_place",
    "10_anymal_legs",
    "03_chain_1000",
    "08_crane_loads",
    "12_four_bar",
    "13_excavator",
    "14_five_bar",
    "15_delta_robot",
    "16_stewart_platform",
    "17_scissor_lift",
    "18_press",
    "19_door",
    "20_hanging_chain",
    "21_flexible_arm",
    "22_flexible_jib",
    "23_blade",
)
HEAD = """# Gallery

Made by the examples themselves, with `python tools/make_gallery.py`. Pictures: the machine at
some times, early ones pale, and what its joints carry. Robots come from the package
`example-robot-data`, pictures need matplotlib. To look at a run in 3-D: [view](view.md).
"""
RUN_IT_BY = "\n\nRun it by: "


def picture(name: str) -> str:
    return f"images/gallery_{name[3:]}.svg"


def page(root: Path, name: str) -> str:
    """Title, text, command and picture of an example; all but what it prints."""
    source = (root / "examples" / f"{name}.py").read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(source)) or ""
    text, found, _ = docstring.partition(RUN_IT_BY)
    title, _, rest = text.partition("\n\n")
    if not found or "\n" in title or not rest:
        raise SystemExit(f"examples/{name}.py: docstring is not a line, a text, and {RUN_IT_BY!r}")
    title = title.rstrip(".")
    command = f"`python examples/{name}.py PICTURE.svg` ([source](../examples/{name}.py))"
    return (
        f"\n## {title}\n\n![{title}]({picture(name)})\n\n{rest}\n\n{command} draws it and prints:\n"
    )


def main() -> None:
    root = Path(__file__).resolve().parents[1]
    parts = [HEAD]
    for name in SHOWN:
        parts.append(page(root, name))
        command = [sys.executable, f"examples/{name}.py", f"docs/{picture(name)}"]
        done = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True)
        lines = [line for line in done.stdout.splitlines() if not line.startswith("picture: ")]
        parts.append("\n```text\n" + "\n".join(lines) + "\n```\n")
    (root / "docs" / "gallery.md").write_text("".join(parts), encoding="utf-8")


if __name__ == "__main__":
    main()
