"""XML from an untrusted source: no DTD, no entities, no includes, no network, bounded size."""

from __future__ import annotations

import os
import re
from xml.parsers import expat

from lxml import etree

from linkwise._core import InputError
from linkwise.io.complaint import complain
from linkwise.io.encoding import decode_xml
from linkwise.io.files import MODEL_BYTES, read_bytes
from linkwise.io.xml_slips import diagnose

_XINCLUDE = "http://www.w3.org/2001/XInclude"


def parse_xml(path: str | os.PathLike[str], text: str | None = None) -> etree._Element:
    """The root element of a model file, or of ``text``, which ``path`` then only names.

    Raises InputError for a file that is missing, too large, not XML, or that holds a DOCTYPE
    (hence any entity definition: entity bombs and external entities alike) or an XInclude.
    """
    if text is None:
        data = read_bytes(path, "model file", MODEL_BYTES)
    else:
        data = text.encode("utf-8", "replace")
        if len(data) > MODEL_BYTES:
            problem = f"is larger than {MODEL_BYTES // 2**20} MiB"
            complain(path, "model", problem, "build it with linkwise.ModelBuilder")
    decoded, _ = decode_xml(data, path)
    data = decoded.encode("utf-8", "replace")
    _refuse_doctype(data, path)
    root = _parse(data, path)
    # The two parsers might disagree on where the prolog ends; lxml decides.
    if root.getroottree().docinfo.internalDTD is not None:
        _complain_doctype(path, None)
    for element in root.iter(f"{{{_XINCLUDE}}}include"):
        complain(
            path,
            "element 'xi:include'",
            "including other files is not allowed",
            "paste the content in its place",
            element.sourceline,
        )
    return root


class _PrologEnd(Exception):  # noqa: N818, it is no error
    """The root element was reached without a DOCTYPE."""


def _refuse_doctype(data: bytes, path: str | os.PathLike[str]) -> None:
    """Stop at a DOCTYPE before anything that it declares is read."""
    parser = expat.ParserCreate("utf-8")

    def doctype(name: str, *_: object) -> None:
        if name.lower() == "html":
            _complain_syntax(path, data, "a web page", None)
        _complain_doctype(path, parser.CurrentLineNumber)

    def element(*_: object) -> None:
        raise _PrologEnd

    parser.StartDoctypeDeclHandler = doctype
    parser.StartElementHandler = element
    try:
        parser.Parse(data, True)
    except _PrologEnd:
        return
    except InputError:  # itself a ValueError
        raise
    except (expat.ExpatError, ValueError, LookupError) as error:
        _complain_syntax(path, data, str(error), getattr(error, "lineno", None))


def _complain_doctype(path: str | os.PathLike[str], line: int | None) -> None:
    complain(
        path,
        "DOCTYPE",
        "document type and entity definitions are not allowed in a model file",
        "delete the <!DOCTYPE ...> and write the entities out",
        line,
    )


def _complain_syntax(
    path: str | os.PathLike[str], data: bytes, message: str, line: int | None
) -> None:
    said = re.sub(r"(, line \d+, column \d+|: line \d+, column \d+).*$", "", message)
    problem, remedy, where = diagnose(data.decode("utf-8", "replace"), said, line)
    complain(path, "model file", problem, remedy, where)


def _parser(recover: bool) -> etree.XMLParser:
    return etree.XMLParser(
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
        encoding="utf-8",
        recover=recover,
    )


def _parse(data: bytes, path: str | os.PathLike[str]) -> etree._Element:
    parser = _parser(recover=False)
    try:
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        # Robot files often use a prefix such as <controller:ros_control> without declaring it;
        # other URDF readers know no namespaces and accept that. The elements are ignored here too.
        if any(entry.domain_name != "NAMESPACE" for entry in parser.error_log):
            _complain_syntax(path, data, error.msg or "", error.lineno)
    root = etree.fromstring(data, _parser(recover=True))
    if root is None:
        _complain_syntax(path, data, "document is empty", None)
    return root


def local_name(element: etree._Element) -> str:
    """The name of an element without its namespace or undeclared prefix."""
    return _split(element)[1].rpartition(":")[2]


def is_xacro(element: etree._Element) -> bool:
    """Whether an element is one of xacro's, by its namespace or its undeclared prefix."""
    namespace, name = _split(element)
    return "xacro" in namespace or name.startswith("xacro:")


def is_foreign(element: etree._Element, root: etree._Element) -> bool:
    """Whether an element belongs to another vocabulary than the document's root."""
    namespace, name = _split(element)
    return namespace != _split(root)[0] or ":" in name


def _split(element: etree._Element) -> tuple[str, str]:
    # Not lxml's QName, which refuses the undeclared prefixes that _parse lets through.
    namespace, _, name = str(element.tag).rpartition("}")
    return namespace.removeprefix("{"), name
