"""The tree that the joints of a file make of its links: checks and orders, without recursion."""

from __future__ import annotations

import heapq
import os
from collections.abc import Sequence
from typing import Literal, NamedTuple

from linkwise.io.complaint import complain, near, shorten

JointOrder = Literal["file", "pinocchio"]


class Edge(NamedTuple):
    """A joint as an edge from parent link to child link."""

    name: str
    parent: str
    child: str
    line: int | None


def check_tree(
    path: str | os.PathLike[str], links: dict[str, int | None], joints: Sequence[Edge]
) -> str:
    """The root link of the tree; InputError unless ``joints`` make one tree of all ``links``.

    ``links`` maps link names to line numbers.
    """
    joint_of: dict[str, Edge] = {}
    for joint in joints:
        element = f"joint '{shorten(joint.name)}'"
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in links:
                complain(
                    path,
                    element,
                    f"{role} link '{shorten(link)}' does not exist",
                    near(link, links, "the links are"),
                    joint.line,
                )
        if joint.child in joint_of:
            complain(
                path,
                f"link '{shorten(joint.child)}'",
                f"is the child of two joints, '{shorten(joint_of[joint.child].name)}' and "
                f"'{shorten(joint.name)}'",
                "a link can have one parent: remove one of the joints",
                joint.line,
            )
        joint_of[joint.child] = joint
    roots = [name for name in links if name not in joint_of]
    _check_cycles(path, links, joint_of)
    if len(roots) > 1:
        complain(
            path,
            f"link '{shorten(roots[1])}'",
            f"is a second root beside '{shorten(roots[0])}': no joint has it as child",
            "connect it with a joint or remove it",
            links[roots[1]],
        )
    return roots[0]


def _check_cycles(
    path: str | os.PathLike[str], links: dict[str, int | None], joint_of: dict[str, Edge]
) -> None:
    """Every walk to the parents must end at a link without one; O(N) by marking what was walked."""
    walk_of: dict[str, int] = {}
    for number, start in enumerate(links):
        link = start
        while link not in walk_of:
            walk_of[link] = number
            joint = joint_of.get(link)
            if joint is None:
                break
            link = joint.parent
        else:
            if walk_of[link] == number:
                joint = joint_of[link]
                complain(
                    path,
                    f"joint '{shorten(joint.name)}'",
                    f"closes a cycle through link '{shorten(link)}'",
                    "joints must form a tree: remove one joint of the cycle",
                    joint.line,
                )


def order_joints(joints: Sequence[Edge], root: str, order: JointOrder) -> list[int]:
    """Indices of ``joints``, parents first.

    "file" keeps the file's order as far as parents-first allows (the smallest topological order);
    "pinocchio" goes depth first and takes the joints of one link by name, as urdfdom and with it
    Pinocchio do, so that q and v can be handed over.
    """
    outboard: dict[str, list[int]] = {}
    for index, joint in enumerate(joints):
        outboard.setdefault(joint.parent, []).append(index)
    result: list[int] = []
    if order == "file":
        ready = list(outboard.get(root, ()))
        while ready:
            index = heapq.heappop(ready)
            result.append(index)
            for following in outboard.get(joints[index].child, ()):
                heapq.heappush(ready, following)
        return result

    def by_name(link: str) -> list[int]:
        # std::map compares bytes; reversed because the stack is taken from its end.
        found = outboard.get(link, [])
        return sorted(found, key=lambda i: joints[i].name.encode(), reverse=True)

    stack = by_name(root)
    while stack:
        index = stack.pop()
        result.append(index)
        stack.extend(by_name(joints[index].child))
    return result
