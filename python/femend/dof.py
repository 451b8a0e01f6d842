"""Degrees of freedom by name: node, component 1..6 and sign, written ``12:+Z``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import total_ordering

import numpy as np
from numpy.typing import NDArray

__all__ = ["COMPONENTS", "Dof", "DofTable", "parse_direction"]

COMPONENTS = ("X", "Y", "Z", "RX", "RY", "RZ")
_NUMBER = {name: i + 1 for i, name in enumerate(COMPONENTS)}
_DIRECTION = re.compile(r"([+-]?)\s*(RX|RY|RZ|X|Y|Z|[1-6])", re.IGNORECASE)
_DOF = re.compile(r"\s*(\d+)\s*:\s*(.*?)\s*")


def parse_direction(text: str) -> tuple[int, int]:
    """Component 1..6 and sign of a direction such as ``+Z``, ``-RX``, ``Y`` or ``3``.

    Raises ValueError for anything else.
    """
    match = _DIRECTION.fullmatch(text.strip())
    if match is None:
        raise ValueError(f"direction {text!r} is none of X Y Z RX RY RZ with an optional sign, such as '+Z' or '-RX'")
    sign = -1 if match[1] == "-" else 1
    name = match[2].upper()
    return (_NUMBER[name] if name in _NUMBER else int(name)), sign


@total_ordering
@dataclass(frozen=True, slots=True)
class Dof:
    """One degree of freedom: `node`, `component` 1..6 = X Y Z RX RY RZ, `sign` +1 or -1 of a sensor's direction.

    Raises ValueError for a component or sign out of range or a negative node.

    >>> str(Dof.parse("12:-RX"))
    '12:-RX'
    """

    node: int
    component: int
    sign: int = 1

    def __post_init__(self) -> None:
        if self.component not in range(1, 7):
            raise ValueError(f"component {self.component} of node {self.node} is not 1..6 (X Y Z RX RY RZ)")
        if self.sign not in (1, -1):
            raise ValueError(f"sign {self.sign} of node {self.node} is neither +1 nor -1")
        if self.node < 0:
            raise ValueError(f"node {self.node} is negative")

    @classmethod
    def parse(cls, text: str) -> Dof:
        """The DOF written as ``node:direction``; raises ValueError that quotes the text."""
        match = _DOF.fullmatch(text)
        if match is None:
            raise ValueError(f"DOF {text!r} is not written as node:direction, such as '12:+Z' or '12:RX'")
        try:
            component, sign = parse_direction(match[2])
        except ValueError as error:
            raise ValueError(f"DOF {text!r}: {error}") from None
        return cls(int(match[1]), component, sign)

    @classmethod
    def from_uff(cls, node: int, direction: int) -> Dof | None:
        """The DOF of a universal file's node and direction code -6..6; None for code 0 (scalar) or beyond."""
        if direction == 0 or abs(direction) > 6:
            return None
        return cls(node, abs(direction), 1 if direction > 0 else -1)

    @property
    def uff_direction(self) -> int:
        """Direction code -6..6 of the universal file."""
        return self.sign * self.component

    @property
    def direction(self) -> str:
        """Signed direction, such as ``+Z``."""
        return ("+" if self.sign > 0 else "-") + COMPONENTS[self.component - 1]

    @property
    def is_rotation(self) -> bool:
        """True for RX RY RZ."""
        return self.component > 3

    @property
    def unsigned(self) -> Dof:
        """The same DOF with sign +1."""
        return self if self.sign == 1 else Dof(self.node, self.component)

    def __str__(self) -> str:
        return f"{self.node}:{self.direction}"

    def __lt__(self, other: object) -> bool:
        if not isinstance(other, Dof):
            return NotImplemented
        return (self.node, self.component, -self.sign) < (other.node, other.component, -other.sign)


class DofTable(Sequence[Dof]):
    """Ordered DOFs with look-up by node and component; the sign of an entry does not matter for the look-up.

    Raises ValueError where a node and component occur twice.
    """

    def __init__(self, dofs: Iterable[Dof | str]) -> None:
        self._dofs = tuple(Dof.parse(d) if isinstance(d, str) else d for d in dofs)
        self._index: dict[tuple[int, int], int] = {}
        for i, dof in enumerate(self._dofs):
            first = self._index.setdefault((dof.node, dof.component), i)
            if first != i:
                raise ValueError(f"DOF {dof} stands twice in the table, at {first} and {i}")

    @classmethod
    def from_arrays(cls, nodes: NDArray[np.integer], components: NDArray[np.integer]) -> DofTable:
        """The table of two integer arrays (n_dof,): ids `nodes` and `components` 1..6."""
        return cls(Dof(int(n), int(c)) for n, c in zip(nodes, components, strict=True))

    def __len__(self) -> int:
        return len(self._dofs)

    def __iter__(self) -> Iterator[Dof]:
        return iter(self._dofs)

    def __getitem__(self, index):  # type: ignore[no-untyped-def]  # Sequence wants two overloads for one line
        return self._dofs[index]

    def __contains__(self, dof: object) -> bool:
        return isinstance(dof, Dof) and (dof.node, dof.component) in self._index

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DofTable) and self._dofs == other._dofs

    def __hash__(self) -> int:
        return hash(self._dofs)

    def __repr__(self) -> str:
        shown = " ".join(str(d) for d in self._dofs[:6])
        return f"DofTable({len(self)} DOFs: {shown}{' …' if len(self) > 6 else ''})"

    def find(self, dof: Dof | str) -> int:
        """Position of `dof`, whatever its sign; raises KeyError naming the DOF."""
        dof = Dof.parse(dof) if isinstance(dof, str) else dof
        try:
            return self._index[(dof.node, dof.component)]
        except KeyError:
            raise KeyError(f"DOF {dof} is not among the {len(self)} DOFs of the table") from None

    @property
    def nodes(self) -> NDArray[np.int64]:
        """Node ids, int64 (n_dof,)."""
        return np.array([d.node for d in self._dofs], dtype=np.int64)

    @property
    def components(self) -> NDArray[np.int64]:
        """Components 1..6, int64 (n_dof,)."""
        return np.array([d.component for d in self._dofs], dtype=np.int64)

    @property
    def signs(self) -> NDArray[np.float64]:
        """Signs +1 or -1, float64 (n_dof,)."""
        return np.array([d.sign for d in self._dofs], dtype=np.float64)
