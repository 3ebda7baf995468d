"""The root element of a URDF, parsed safely; a file that is something else is named for what it is.

No DTD, no entity, no network, bounded depth. The one thing that is mended is a namespace prefix that nobody declared: parsers
without namespaces, such as that of urdfdom, read such files, and some of the packages in use hold them. The prefix is declared
before the file is parsed again, as strictly as before.
"""

from __future__ import annotations

import re
from pathlib import Path

from lxml import etree

from harness.description.finding import Finding, listed
from harness.description.urdf_kinds import EXPAND, is_srdf, is_xacro, kind_of_bytes, kind_of_root
from harness.description.urdf_numbers import line_of
from harness.errors import UrdfError

UNDECLARED = "urn:undeclared:"
MOST_PREFIXES = 50

_PREFIX = re.compile(r"Namespace prefix (\S+) (?:for \S+ )?on \S+ is not defined")
_NO_DTD = "a document type or entity declaration is not allowed in a URDF"


def robot_of(data: bytes, path: Path) -> tuple[etree._Element, list[Finding]]:
    """The `<robot>` of a URDF, and what was noticed on the way.

    Args:
        data: the file.
        path: where it was read, for messages.

    Raises:
        UrdfError: it is not well-formed XML, has a document type, or is not a URDF.
    """
    if kind := kind_of_bytes(data):
        raise UrdfError(f"expected a URDF, which is XML; this is {kind[0]}", where=path, hint=kind[1])
    robot, prefixes = _parsed(data, path)
    # Entities can be declared only in a DTD, so refusing every DTD refuses bombs and external files alike.
    if robot.getroottree().docinfo.internalDTD is not None:
        raise UrdfError(_NO_DTD, where=path, hint="remove <!DOCTYPE ...>")
    findings = []
    if prefixes:
        what = f"namespace {listed(prefixes, 'prefix')}: used, and declared nowhere"
        line = line_of(robot)
        findings.append(Finding(code="undeclared-prefix", level="warning", subject=prefixes[0], message=what, line=line))
    name = etree.QName(robot)
    if name.localname == "robot" and name.namespace and robot.prefix is None:
        _without_namespace(robot, name.namespace)
        what = f"<robot> stands in the default namespace {name.namespace!r}: a URDF has none"
        findings.append(Finding(code="default-namespace", level="warning", subject="robot", message=what, line=line_of(robot)))
    _check_is_urdf(robot, path)
    return robot, findings


def is_undeclared(name: str) -> bool:
    """Whether the name of an attribute has a prefix that the file does not declare. Engines are not given such attributes."""
    return name.startswith(f"{{{UNDECLARED}")


def _parsed(data: bytes, path: Path) -> tuple[etree._Element, list[str]]:
    """The root, and the prefixes that had to be declared for it."""
    prefixes: list[str] = []
    while True:
        # A parser of its own each time: its log has the mistakes of this file alone, that of the exception also of others.
        parser = etree.XMLParser(
            resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
        )
        try:
            return etree.fromstring(data, parser), prefixes
        except etree.XMLSyntaxError as error:
            more = [p for p in _undeclared(parser.error_log) if p not in prefixes]
            declared = _declare(data, more, path) if more and len(prefixes) + len(more) <= MOST_PREFIXES else None
            if declared is None:
                raise _not_well_formed(error, parser.error_log, path) from None
            prefixes += more
            data = declared
        except ValueError as error:  # e.g. control characters
            raise UrdfError(f"not well-formed XML: {error}", where=path) from None


def _undeclared(log: etree._ListErrorLog) -> list[str]:
    """The prefixes that are not declared; none if the file has any other mistake."""
    prefixes = []
    for entry in log:
        match = _PREFIX.match(entry.message)
        if entry.type_name != "NS_ERR_UNDEFINED_NAMESPACE" or match is None:
            return []
        prefixes.append(match[1])
    return list(dict.fromkeys(prefixes))


def _not_well_formed(error: etree.XMLSyntaxError, log: etree._ListErrorLog, path: Path) -> UrdfError:
    """The error that says why; a prefix is named only if there is no other mistake."""
    message, line = str(error.msg), error.lineno
    worse = next((e for e in log if e.type_name != "NS_ERR_UNDEFINED_NAMESPACE"), None)
    if _PREFIX.match(message) and worse is not None:
        message, line = worse.message, worse.line
    return UrdfError(f"not well-formed XML: {message.split(', line ')[0].strip()}", where=path, line=line)


def _declare(data: bytes, prefixes: list[str], path: Path) -> bytes | None:
    """The file with these prefixes declared on its root element; None if the root cannot be found."""
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = data.decode("utf-16", "surrogatepass") if wide else data.decode("latin-1")
    at = _behind_root_name(text, path)
    if at is None:
        return None
    added = "".join(f' xmlns:{prefix}="{UNDECLARED}{prefix}"' for prefix in prefixes)
    if wide:
        return (text[:at] + added + text[at:]).encode("utf-16", "surrogatepass")
    return (text[:at] + added.encode("utf-8").decode("latin-1") + text[at:]).encode("latin-1")


def _behind_root_name(text: str, path: Path) -> int | None:
    """Where attributes of the root element begin, behind declaration, comments and processing instructions."""
    at = text.find("<")
    while at >= 0:
        if text.startswith("<!DOCTYPE", at):
            raise UrdfError(_NO_DTD, where=path, hint="remove <!DOCTYPE ...>")
        end = next((mark for start, mark in (("<?", "?>"), ("<!--", "-->")) if text.startswith(start, at)), None)
        if end is None:
            name = re.compile(r"<[^\s/>]+").match(text, at)
            return name.end() if name else None
        closed = text.find(end, at)
        at = text.find("<", closed + len(end)) if closed >= 0 else -1
    return None


def _without_namespace(robot: etree._Element, namespace: str) -> None:
    """Take the default namespace off every element that has it: to a parser without namespaces it makes no difference."""
    head = f"{{{namespace}}}"
    for element in robot.iter():
        if isinstance(element.tag, str) and element.tag.startswith(head):
            element.tag = element.tag[len(head) :]


def _check_is_urdf(robot: etree._Element, path: Path) -> None:
    """Raise UrdfError for another root element, for xacro, and for an SRDF."""
    line = line_of(robot)
    root = etree.QName(robot)
    if is_xacro(root.namespace or ""):
        raise UrdfError("the file is xacro, not URDF", where=path, line=line, hint=EXPAND)
    if robot.tag != "robot":
        shown = f"{robot.prefix}:{root.localname}" if robot.prefix else root.localname
        kind = kind_of_root(root.localname)
        problem, hint = f"expected the root element <robot>, got <{shown}>", EXPAND if path.suffix == ".xacro" else None
        if kind is not None:
            problem, hint = f"{problem}: this is {kind[0]}", kind[1]
        raise UrdfError(problem, where=path, line=line, hint=hint)
    children = [child for child in robot if isinstance(child.tag, str)]
    for element in (*children, *(e for child in children if child.tag == "joint" for e in child if isinstance(e.tag, str))):
        if is_xacro(etree.QName(element).namespace or ""):
            raise UrdfError("the file is xacro, not URDF", where=path, line=line_of(element), hint=EXPAND)
    tags = {str(child.tag) for child in children}
    if "link" not in tags:
        problem = "expected at least one <link>, got none"
        if is_srdf(tags):
            raise UrdfError(f"{problem}: this is an SRDF", where=path, line=line, hint="give the URDF that it belongs to")
        raise UrdfError(problem, where=path)
