"""Reads OpenCV's FileStorage XML into the same values as YAML. Pure.

`cv2.FileStorage` needs a parser of its own for each format and ends the process on some broken texts. Declarations
(<!DOCTYPE, <!ENTITY) are refused before anything is parsed: FileStorage has none, and entities can grow to gigabytes.
"""

from typing import Final
from xml.etree import ElementTree as ET

from common.errors import DataError
from phone_host.output.rig_files.tree import Tree

_MOST_LEVELS: Final = 32
_REMEDY: Final = "give it as cv2.FileStorage wrote it"


def read_xml(text: str, file: str) -> Tree:
    """Read an XML text of FileStorage.

    Returns:
        Its values: maps, lists and words.

    Raises:
        DataError: it is no XML, or declares something.
    """
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise DataError(f"{file} declares a document type", _REMEDY)
    try:
        root = ET.fromstring(text.removeprefix("\ufeff").encode())  # noqa: S314  # nothing is declared: see above
    except (ET.ParseError, LookupError, ValueError) as error:
        raise DataError(f"{file} is no XML ({error})", _REMEDY) from error
    return _tree(root, file, 0)


def _tree(element: ET.Element, file: str, level: int) -> Tree:
    if level > _MOST_LEVELS:
        raise DataError(f"{file} nests more than {_MOST_LEVELS} levels deep", _REMEDY)
    if not len(element):
        return (element.text or "").strip().strip('"')
    if all(child.tag == "_" for child in element):
        return [_tree(child, file, level + 1) for child in element]
    found: dict[str, Tree] = {}
    for child in element:
        if child.tag in found:
            raise DataError(f"{file} has the key {child.tag} twice", _REMEDY)
        found[child.tag] = _tree(child, file, level + 1)
    return found
