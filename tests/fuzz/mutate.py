"""Damage to files: to their bytes, and to the trees, tables and numbers that they hold."""

import copy
import datetime
import re

from lxml import etree

from .hostile import NUMBER_TEXTS, TEXTS, WHOLE, hostile_number


def damage_bytes(rng, data):
    """Some bytes flipped, cut, repeated or put in."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 5))):
        if not data:
            break
        at, span = rng.randrange(len(data)), rng.choice((1, 1, 2, 8, 64))
        how = rng.randrange(6)
        if how == 0:
            data[at] ^= 1 << rng.randrange(8)
        elif how == 1:
            data[at] = rng.randrange(256)
        elif how == 2:
            del data[at : at + span]
        elif how == 3:
            data[at:at] = data[at : at + span]
        elif how == 4:
            del data[at:]
        else:
            data[at:at] = rng.choice((b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"<", b">", b'"', b"\n"))
    return bytes(data)


def damage_xml(rng, text, vocabulary):
    """The XML with elements and attributes changed, moved, doubled, lost or renamed."""
    root = etree.fromstring(text.encode(), etree.XMLParser(remove_comments=True))
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        elements = list(root.iter())
        element = rng.choice(elements)
        rng.choice(_XML_CHANGES)(rng, root, element, elements, vocabulary)
    data = etree.tostring(
        root, encoding=rng.choice((*["UTF-8"] * 6, "UTF-16", "ISO-8859-1", "ascii"))
    )
    head = rng.random()
    if head < 0.1:
        data = (
            rng.choice((b"\n", b"\xef\xbb\xbf", b"<?xml version='1.0'?>", b"<!DOCTYPE x>")) + data
        )
    return data


def _xml_set(rng, root, element, elements, vocabulary):
    if not element.attrib:
        return _xml_text(rng, root, element, elements, vocabulary)
    key = rng.choice(sorted(element.attrib))
    words = element.get(key).split(" ")
    pool = NUMBER_TEXTS if re.match(r"^[-+.0-9]", words[0]) or rng.random() < 0.2 else TEXTS
    value = rng.choice(pool) if rng.random() < 0.8 else repr(hostile_number(rng))
    if len(words) > 1 and rng.random() < 0.7:
        words[rng.randrange(len(words))] = value
        value = " ".join(words)
    element.set(key, value)


def _xml_swap(rng, root, element, elements, vocabulary):
    """A value that stands elsewhere: names of other links, numbers of other elements."""
    other = rng.choice(elements)
    if element.attrib and other.attrib:
        element.set(rng.choice(sorted(element.attrib)), other.get(rng.choice(sorted(other.attrib))))


def _xml_attribute(rng, root, element, elements, vocabulary):
    if element.attrib and rng.random() < 0.5:
        del element.attrib[rng.choice(sorted(element.attrib))]
    else:
        _, attributes = vocabulary
        element.set(rng.choice(attributes), rng.choice((*NUMBER_TEXTS, *TEXTS)))


def _xml_rename(rng, root, element, elements, vocabulary):
    element.tag = rng.choice(vocabulary[0])


def _xml_remove(rng, root, element, elements, vocabulary):
    if element is not root:
        element.getparent().remove(element)


def _xml_move(rng, root, element, elements, vocabulary):
    target = rng.choice(elements)
    if element is not root and element not in (target, *target.iterancestors()):
        target.insert(rng.randint(0, len(target)), element)


def _xml_double(rng, root, element, elements, vocabulary):
    twin = copy.deepcopy(element)
    if rng.random() < 0.5 and twin.get("name"):
        twin.set("name", twin.get("name") + "2")
    (element.getparent() if element is not root else root).append(twin)


def _xml_add(rng, root, element, elements, vocabulary):
    child = etree.SubElement(element, rng.choice(vocabulary[0]))
    for _ in range(rng.randint(0, 3)):
        child.set(rng.choice(vocabulary[1]), rng.choice((*NUMBER_TEXTS, *TEXTS)))


def _xml_text(rng, root, element, elements, vocabulary):
    element.text = rng.choice((*NUMBER_TEXTS, *TEXTS))


def _xml_deep(rng, root, element, elements, vocabulary):
    tag = rng.choice(vocabulary[0])
    for _ in range(rng.choice((3, 30, 300))):
        element = etree.SubElement(element, tag)


def _texts_that_xml_can_hold(change):
    def changed(*arguments):
        try:
            change(*arguments)
        except ValueError:
            return  # control characters, or no name of an element

    return changed


_XML_CHANGES = [
    _texts_that_xml_can_hold(change)
    for change in (
        *[_xml_set] * 5,
        *(_xml_swap, _xml_swap, _xml_attribute, _xml_attribute, _xml_rename, _xml_remove),
        *(_xml_move, _xml_double, _xml_add, _xml_text, _xml_deep),
    )
]


def damage_document(rng, document, vocabulary):
    """A TOML document (tables, lists, values) with parts changed, lost, added or renamed."""
    document = copy.deepcopy(document)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        places = list(_places(document))
        if not places:
            break
        holder, key = rng.choice(places)
        how = rng.randrange(8)
        if how < 4:
            holder[key] = _other_value(rng, holder[key])
        elif how == 4:
            del holder[key]
        elif isinstance(holder, dict) and how == 5:
            holder[rng.choice((*vocabulary, *TEXTS))] = holder.pop(key)
        elif isinstance(holder, dict):
            holder[rng.choice((*vocabulary, *vocabulary, *TEXTS))] = _other_value(rng, 1.0)
        else:
            holder.append(copy.deepcopy(holder[key]))
    return document


def _places(node):
    for key in list(node) if isinstance(node, dict) else range(len(node)):
        yield node, key
        if isinstance(node[key], dict | list):
            yield from _places(node[key])


def _other_value(rng, value):
    if isinstance(value, str) and rng.random() < 0.6:
        return rng.choice(TEXTS)
    if isinstance(value, int | float) and rng.random() < 0.6:
        return rng.choice((hostile_number(rng), rng.choice(WHOLE[:-2])))
    choices = [True, [], {}, [1.0], [1.0, "2 m"], {"a": 1}, [[1.0, 0.0], [0.0]], "30 deg", "1 N m"]
    choices += [datetime.date(2020, 1, 1), "2 kg", "nan s", [value], {"x": value}, [value] * 3]
    choices += [rng.choice(TEXTS), rng.choice(NUMBER_TEXTS), rng.choice(WHOLE[:-2])]
    return copy.deepcopy(rng.choice(choices))


def toml_text(document):
    """A document as TOML, tables written inline."""
    return "".join(f"{_toml_key(key)} = {_toml_value(value)}\n" for key, value in document.items())


def _toml_key(key):
    return _toml_value(str(key))


def _toml_value(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml_key(k)} = {_toml_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    if isinstance(value, str):
        shown = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c >= " " else f"\\u{ord(c):04x}" for c in shown) + '"'
    return str(value)


def damage_table(rng, text):
    """A table with cells, rows, columns, separators, names or its head changed."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        lines = text.split("\n")
        row = rng.randrange(len(lines))
        cells = re.split(r"[,;\t]", lines[row])
        separator = next((c for c in ",;\t" if c in lines[row]), ",")
        how = rng.randrange(10)
        if how < 4:
            cells[rng.randrange(len(cells))] = rng.choice((*NUMBER_TEXTS, *TEXTS))
            lines[row] = separator.join(cells)
        elif how == 4:
            del lines[row]
        elif how == 5:
            lines.insert(row, rng.choice((lines[row], "", *TEXTS, "endheader", "nRows=3", "# x")))
        elif how == 6:
            lines[row] = separator.join(cells[: rng.randint(0, len(cells))])
        elif how == 7:
            lines = [line.replace(separator, rng.choice(",;\t |")) for line in lines]
        elif how == 8:
            lines[row] = separator.join([*cells, rng.choice(NUMBER_TEXTS)])
        else:
            lines = [line.replace(".", ",") for line in lines]
        text = "\n".join(lines)
    data = text.encode(rng.choice((*["utf-8"] * 6, "utf-16", "utf-16-le", "utf-8-sig")), "replace")
    return data.replace(b"\n", b"\r\n") if rng.random() < 0.1 else data
