"""The text of an XML file, whatever encoding it declares.

The parsers know few encodings; Python knows them all. So the text is decoded here, its declaration
is blanked, and the parsers see UTF-8.
"""

from __future__ import annotations

import codecs
import os
import re

from linkwise.io.complaint import complain, shorten

_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_DECLARATION = re.compile(r"\A<\?xml\b[^<>]*\?>")
_ENCODING = re.compile(r"""encoding\s*=\s*["']([^"']{0,80})["']""")
#: Names that files use for a larger set than their own.
_LARGER = {"gb2312": "gb18030", "gbk": "gb18030", "ascii": "utf-8", "shift_jis": "cp932"}


def decode_xml(data: bytes, path: str | os.PathLike[str]) -> tuple[str, str]:
    """The text without its declaration (lines keep their numbers), and the encoding's name.

    Raises InputError for an encoding that nobody knows, and for bytes that are not in the one that
    is declared (UTF-8 where none is).
    """
    name = _encoding(data, path)
    try:
        text = data.decode(name)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        problem = f"holds a byte that is no {name.upper()} text"
        complain(path, "model file", problem, "save it as UTF-8", line)
    text = text.removeprefix("\ufeff")
    declaration = _DECLARATION.match(text)
    if declaration:  # its version says nothing either: "0.0" heads many published files
        blank = re.sub(r"[^\n]", " ", declaration.group())
        text = blank + text[declaration.end() :]
    return text, name


def _encoding(data: bytes, path: str | os.PathLike[str]) -> str:
    for bom, name in _BOMS:
        if data.startswith(bom):
            return name
    for start, name in ((b"<\0", "utf-16-le"), (b"\0<", "utf-16-be")):
        if data.startswith(start):
            return name
    head = data[:400].decode("latin-1")
    declaration = _DECLARATION.match(head)
    declared = _ENCODING.search(declaration.group()) if declaration else None
    if declared is None:
        return "utf-8"
    try:
        info = codecs.lookup(declared.group(1))
        b"<".decode(info.name, "replace")  # refuses hex, zip and the like
    except (LookupError, ValueError):
        problem = f"declares the encoding '{shorten(declared.group(1))}', which is unknown"
        complain(path, "model file", problem, "save it as UTF-8", 1)
    # Its first bytes are those of no UTF-16 or UTF-32, whatever it declares.
    if info.name.startswith(("utf-16", "utf-32", "utf-7")):
        return "utf-8"
    return _LARGER.get(info.name, info.name)
