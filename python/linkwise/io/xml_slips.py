"""Usual slips in XML files, and how each is cured."""

from __future__ import annotations

import re

from linkwise.io.complaint import shorten

_QUOTES = "\u201c\u201d\u201e\u2018\u2019\xab\xbb"
_PREDEFINED = ("amp", "lt", "gt", "quot", "apos")


def diagnose(text: str, message: str, line: int | None) -> tuple[str, str, int | None]:
    """Problem, remedy and line of a text that a parser refused with ``message`` at ``line``."""
    bare = _without_comments(text)
    for find in (_whole, _before_root, _entity, _in_the_line, _tags, _rest):
        found = find(bare, message, line)
        if found:
            problem, remedy, where = found
            return f"is not XML ({shorten(problem, 120)})", remedy, where or line
    return f"is not XML ({shorten(message, 120)})", "give a URDF, MJCF or SDF file", line


_Found = tuple[str, str, "int | None"] | None


def _line_of(text: str, position: int) -> int:
    return text.count("\n", 0, position) + 1


def _whole(text: str, message: str, line: int | None) -> _Found:
    start = text.lstrip()[:200].lower()
    if not start:
        return "no element found: the file is empty", "give a URDF, MJCF or SDF file", None
    if start.startswith("version https://git-lfs"):
        return "it is a Git LFS pointer", "fetch the file itself: git lfs pull", None
    if start.startswith(("<!doctype html", "<html")):
        return "it is a web page", "download the raw file", None
    if conflict := re.search(r"(?m)^(<<<<<<<|>>>>>>>) ", text):
        where = _line_of(text, conflict.start())
        return "it holds the marks of a merge conflict", "resolve the conflict", where
    control = re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]", text)
    if control:
        problem = f"it holds the control character U+{ord(control.group()):04X}"
        return problem, "delete this character", _line_of(text, control.start())
    return None


def _before_root(text: str, message: str, line: int | None) -> _Found:
    declaration = text.find("<?xml ")
    if declaration >= 0 and re.search(r"declaration|reserved", message, re.IGNORECASE):
        before = text[:declaration]
        where = _line_of(text, declaration)
        if re.search(r"<(robot|mujoco)\b", before):
            return "a second XML declaration stands in it", "delete that <?xml ...?>", where
        return "an XML declaration may only stand first", "delete what stands before <?xml", where
    first = text.find("<")
    if first > 0 and text[:first].strip():
        problem = f"text stands before the first element: {text[:first].strip()[:60]}"
        following = "<?xml" if text[first:].startswith("<?xml") else "the first <"
        return problem, f"delete what stands before {following}", 1
    return None


def _entity(text: str, message: str, line: int | None) -> _Found:
    for found in re.finditer(r"&(#?\w{0,40};)?", text):
        name = found.group(1)
        if name is None:
            where = _line_of(text, found.start())
            return "a bare & stands in it", "write &amp; for &", where
        if not name.startswith("#") and name[:-1] not in _PREDEFINED:
            problem = f"the entity &{name} is not defined"
            return problem, "write the character itself", _line_of(text, found.start())
    return None


def _without_comments(text: str) -> str:
    """The text with its comments blanked; lines keep their numbers."""
    kept, position = [], 0
    while (start := text.find("<!--", position)) >= 0:
        end = text.find("-->", start + 4)
        if end < 0:
            break
        kept += [text[position:start], "\n" * text.count("\n", start, end)]
        position = end + 3
    return "".join([*kept, text[position:]])


def _tags(text: str, message: str, line: int | None) -> _Found:
    """What the tags alone tell: one that is closed by another's, or never."""
    if (comment := text.find("<!--")) >= 0:
        return "a comment is not closed", "close it with -->", _line_of(text, comment)
    if "comment" in message.lower() or "--" in message:
        return "a comment holds --", "write - - instead, or close it with -->", None
    opened: list[tuple[str, int]] = []
    for tag in re.finditer(r"""<(/?)([\w:.-]+)((?:[^<>"']|"[^"<]*"|'[^'<]*')*?)(/?)>""", text):
        name, where = tag.group(2), tag.start()
        if not tag.group(1):
            if not tag.group(4):
                opened.append((name, where))
            continue
        shown = shorten(name)
        if not opened:
            return f"</{shown}> closes nothing", f"delete </{shown}>", _line_of(text, where)
        last, began = opened.pop()
        if last != name:
            start = _line_of(text, began)
            return (
                f"<{shorten(last)}> of line {start} is closed by </{shown}>",
                f"write </{shorten(last)}> where it ends",
                _line_of(text, where),
            )
    if opened and re.search(r"no element found|premature|unclosed|end of", message, re.IGNORECASE):
        last, began = opened[-1]
        return (
            f"it ends before <{shorten(last)}> of line {_line_of(text, began)} is closed",
            f"add </{shorten(last)}>, or fetch the whole file",
            None,
        )
    return None


def _in_the_line(text: str, message: str, line: int | None) -> _Found:
    said = _said(text, line)
    if "duplicate attribute" in message or "redefined" in message:
        return "an attribute is given twice", "keep one of the two", None
    if any(quote in said for quote in _QUOTES):
        return "typographic quotes stand in it", 'write straight quotes, "', None
    if re.search(r"""\s[\w:.-]+\s*=\s*[^\s"'>]""", said):
        return "the value of an attribute has no quotes", 'put it in quotes: name="value"', None
    if re.search(r"""["'][\w:.-]+\s*=""", said):
        return "no space stands between two attributes", "put a space between them", None
    if re.search(r"""=\s*"[^"]*<|=\s*'[^']*<""", said):
        problem = "a < stands in a value, or its quotes are not closed"
        return problem, "write &lt;, or close them", None
    return None


def _rest(text: str, message: str, line: int | None) -> _Found:
    if re.search(r"junk after|extra content", message, re.IGNORECASE):
        return (
            "something follows the end of the root element",
            "delete what follows it, or close elements where they end",
            None,
        )
    if "<" in text and not text.rstrip().endswith(">"):
        return "it ends in the middle of a tag", "fetch the whole file, or close the tag", None
    if re.search(r"<[\w:.-]+[^>]*<", _said(text, line)):
        return "a tag is not closed", "close it with > or />", None
    return None


def _said(text: str, line: int | None) -> str:
    """The line that the parser names."""
    return text.split("\n")[line - 1][:2000] if line and line <= text.count("\n") + 1 else ""
