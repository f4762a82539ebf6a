# SPDX-License-Identifier: Apache-2.0
"""Ids of cells: 128 bits that name a vertex, edge, face or hexahedron whatever the blocks (docs/ids.md)."""
from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Protocol, Union, overload

import numpy as np

from ndmap.errors import InvalidArgumentError

MAX_LEVEL = 29
MAX_INITIAL = (1 << 34) - 1
MAX_RANK = (1 << 29) - 1

# A row of an array of ids.
DTYPE = np.dtype([("hi", np.uint64), ("lo", np.uint64)])

_PATH_BITS = 94
_PATH_MASK = (1 << _PATH_BITS) - 1
_PART_BITS = 5
_RANK_BITS = 31
# The path of the face of a surface.
_POLYGON = 2
_PREFIXES = "vefh"
# The bound on digits keeps int() from numbers that no id can have.
_NUMBER = r"0*([0-9]{1,11})"
_TEXT = re.compile(rf"([{_PREFIXES}]){_NUMBER}(?:#{_NUMBER}|((?:/[0-7](?:\.[0-7])*)?)(?::{_NUMBER})?)")


def _dimension_of_part(part: int) -> int:
    return (part % 3 == 2) + (part // 3 % 3 == 2) + (part // 9 == 2)


def _parts_by_dimension() -> list[list[int]]:
    """For each dimension 0 ... 2 the parts of a hexahedron (x + 3y + 9z) in the order of their numbers: corners by
    x + 2y + 4z; edges by axis, then by the two other coordinates; faces by axis z, y, x, the low one first."""
    corners, edges, faces = ([part for part in range(26) if _dimension_of_part(part) == i] for i in range(3))
    digits = {part: (part % 3, part // 3 % 3, part // 9) for part in range(26)}
    edges.sort(key=lambda part: digits[part].index(2))
    faces.sort(key=lambda part: next(axis for axis in range(3) if digits[part][2 - axis] != 2))
    return [corners, edges, faces]


_PARTS = _parts_by_dimension()
_NUMBERS = {part: number for parts in _PARTS for number, part in enumerate(parts)}


@dataclass(frozen=True, order=True)
class CellId:
    """The id of a cell, as a value: `hi` and `lo` are its 128 bits. str() and CellId.parse() are its text form:
    "h12/0.3.7" a hexahedron, "v12/0.3.7:5" a vertex, "e12:11" an edge, "f12/0:2" a face, "f12" the face of a surface.
    In the order of the service's answers."""

    hi: int
    lo: int

    def __post_init__(self) -> None:
        for name in ("hi", "lo"):
            word = getattr(self, name)
            if not isinstance(word, (int, np.integer)) or not 0 <= word < 1 << 64:
                raise InvalidArgumentError(f"{name}={word!r}: a word of an id is a whole number below 2^64")
            object.__setattr__(self, name, int(word))
        if not self._is_well_formed():
            raise InvalidArgumentError(f"the words {self.hi:016x} {self.lo:016x} are no id of a cell")

    @classmethod
    def _of(cls, initial: int, path: int) -> CellId:
        bits = initial << _PATH_BITS | path
        return cls(bits >> 64, bits & ((1 << 64) - 1))

    @classmethod
    def parse(cls, text: str) -> CellId:
        """Of its text form; InvalidArgumentError otherwise."""
        bad = InvalidArgumentError(
            f"{str(text)[:200]!r}, expected the id of a cell, for example h12/0.3.7 (a hexahedron), "
            "v12/0.3.7:5 (a vertex), e12:11 (an edge), f12/0:2 (a face), f12 (a polygon)"
        )
        match = _TEXT.fullmatch(text) if isinstance(text, str) else None
        if match is None:
            raise bad
        dimension, initial = _PREFIXES.index(match[1]), int(match[2])
        digits = (match[4] or "")[1::2]
        if initial > MAX_INITIAL or len(digits) > MAX_LEVEL:
            raise bad
        if match[3] is not None:
            if int(match[3]) > MAX_RANK:
                raise bad
            return cls._of(initial, 1 << _RANK_BITS | dimension << 29 | int(match[3]))
        if dimension == 2 and not digits and match[5] is None and match[4] == "":
            return cls._of(initial, _POLYGON)
        path = 1
        for digit in digits:
            path = path << 3 | int(digit)
        if (match[5] is None) != (dimension == 3):
            raise bad
        if dimension == 3:
            return cls._of(initial, path)
        if int(match[5]) >= len(_PARTS[dimension]):
            raise bad
        return cls._of(initial, path << _PART_BITS | _PARTS[dimension][int(match[5])])

    @property
    def _path(self) -> int:
        return (self.hi << 64 | self.lo) & _PATH_MASK

    @property
    def _sentinel(self) -> int:
        """Bits below the sentinel; modulo 3 they tell the kind."""
        return self._path.bit_length() - 1

    def _is_well_formed(self) -> bool:
        sentinel = self._sentinel
        if sentinel < 0:
            return False
        if sentinel % 3 == 0:
            return sentinel <= 3 * MAX_LEVEL
        if self._is_polygon:
            return True
        if sentinel % 3 == 2:
            return sentinel >= _PART_BITS and (self.lo & 31) < len(_NUMBERS)
        return sentinel == _RANK_BITS

    @property
    def _is_polygon(self) -> bool:
        return self._path == _POLYGON

    @property
    def _is_part(self) -> bool:
        return self._sentinel % 3 == 2

    @property
    def _is_rank(self) -> bool:
        return self._sentinel % 3 == 1 and not self._is_polygon

    @property
    def initial(self) -> int:
        """The number of the initial cell that it is named by."""
        return self.hi >> 30

    @property
    def dimension(self) -> int:
        """0 of a vertex, 1 of an edge, 2 of a face, 3 of a hexahedron."""
        if self._is_rank:
            return self.lo >> 29 & 3
        if self._is_polygon:
            return 2
        return _dimension_of_part(self.lo & 31) if self._is_part else 3

    @property
    def level(self) -> int:
        """How often the initial hexahedron was halved to get the hexahedron that it is, or is named by."""
        if self._is_rank or self._is_polygon:
            return 0
        return (self._sentinel - (_PART_BITS if self._is_part else 0)) // 3

    @property
    def parent(self) -> CellId | None:
        """Of a hexahedron, the one that it is an eighth of; None of an initial one. InvalidArgumentError of others."""
        if self._sentinel % 3 != 0:
            raise InvalidArgumentError(f"{self} is no 3-cell: it has no parent")
        return CellId._of(self.initial, self._path >> 3) if self.level else None

    def __str__(self) -> str:
        prefix = f"{_PREFIXES[self.dimension]}{self.initial}"
        if self._is_polygon:
            return prefix
        if self._is_rank:
            return f"{prefix}#{self.lo & MAX_RANK}"
        path = self._path >> (_PART_BITS if self._is_part else 0)
        digits = ".".join(str(path >> 3 * i & 7) for i in reversed(range(self.level)))
        part = f":{_NUMBERS[self.lo & 31]}" if self._is_part else ""
        return f"{prefix}{'/' if digits else ''}{digits}{part}"

    def __repr__(self) -> str:
        return f"CellId({str(self)!r})"


class HasId(Protocol):
    """What an id tells of, for example CellDetails."""

    @property
    def id(self) -> CellId:
        """Whose it is."""


CellIdLike = Union[CellId, str, HasId]


def to_cell_id(cell: CellIdLike) -> CellId:
    """InvalidArgumentError for what is no id."""
    given: Any = getattr(cell, "id", cell)
    return given if isinstance(given, CellId) else CellId.parse(given)


class CellIds:
    """Many ids in columns, one row a cell. Rows by number are CellId, by slice or index array CellIds; numpy.asarray()
    gives a structured array with the fields hi and lo, which sorts as the ids do."""

    def __init__(self, array: np.ndarray) -> None:
        self._array = array

    @classmethod
    def from_words(cls, hi: Iterable[int], lo: Iterable[int]) -> CellIds:
        """Of the two columns of words."""
        columns = np.fromiter(hi, np.uint64), np.fromiter(lo, np.uint64)
        array = np.empty(len(columns[0]), DTYPE)
        array["hi"], array["lo"] = columns
        return cls(array)

    @classmethod
    def of(cls, cells: Iterable[CellIdLike]) -> CellIds:
        """Of ids one by one, in their order."""
        ids = [to_cell_id(cell) for cell in cells]
        return cls.from_words((cell.hi for cell in ids), (cell.lo for cell in ids))

    @property
    def hi(self) -> np.ndarray:
        """The upper words, uint64."""
        return self._array["hi"]

    @property
    def lo(self) -> np.ndarray:
        """The lower words, uint64."""
        return self._array["lo"]

    def text(self) -> list[str]:
        """The text forms."""
        return [str(cell) for cell in self]

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        # Copied also when not asked to, so that nobody changes these ids.
        return self._array.astype(dtype or DTYPE)

    def __len__(self) -> int:
        return len(self._array)

    def __iter__(self) -> Iterator[CellId]:
        return (CellId(hi, lo) for hi, lo in self._array.tolist())

    @overload
    def __getitem__(self, rows: int) -> CellId: ...

    @overload
    def __getitem__(self, rows: slice | np.ndarray) -> CellIds: ...

    def __getitem__(self, rows: int | slice | np.ndarray) -> CellId | CellIds:
        if isinstance(rows, (int, np.integer)):
            return CellId(*self._array[rows].tolist())
        return CellIds(self._array[rows])

    def __contains__(self, cell: CellIdLike) -> bool:
        wanted = to_cell_id(cell)
        return bool(((self.hi == np.uint64(wanted.hi)) & (self.lo == np.uint64(wanted.lo))).any())

    def __eq__(self, other: object) -> bool:
        """Whether they are the same ids in the same order."""
        return isinstance(other, CellIds) and bool(np.array_equal(self._array, other._array))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        shown = ", ".join(self[:6].text()) + (", …" if len(self) > 6 else "")
        return f"<CellIds {len(self)}: {shown}>" if len(self) else "<CellIds 0>"
