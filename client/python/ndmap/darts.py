# SPDX-License-Identifier: Apache-2.0
"""Darts, one at a time and in columns."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable, Iterator, Sequence, Union, overload

import numpy as np

from ndmap.errors import InvalidArgumentError
from ndmap.v1 import block_service_pb2, navigate_pb2


@dataclass(frozen=True)
class Dart:
    """A dart of a map, as a value. With a version other than 0 it is refused once its block has changed."""

    map: str
    block: int
    index: int
    version: int = 0

    def __str__(self) -> str:
        return f"{self.block}:{self.index}"


@dataclass(frozen=True)
class DartInfo:
    """A dart, and what is there: the point of its vertex, the hexahedron's id ("h12/0.3.7") and level, and whether the
    dart is critical (on a cut between blocks)."""

    dart: Dart
    point: tuple[float, float, float]
    cell: str
    level: int
    critical: bool

    def __str__(self) -> str:
        x, y, z = self.point
        return f"{self.dart} at ({x:g}, {y:g}, {z:g}) of {self.cell}{', critical' if self.critical else ''}"


@dataclass(frozen=True, eq=False)
class Darts:
    """Many darts of one map in columns, one row a dart. Rows by number are DartInfo, by slice or index array Darts."""

    map: str
    block: np.ndarray  # uint32
    index: np.ndarray  # uint32
    version: np.ndarray  # uint64
    point: np.ndarray  # n x 3 doubles
    cell: np.ndarray  # str
    level: np.ndarray  # uint32
    critical: np.ndarray  # bool

    @classmethod
    def from_protos(cls, map_name: str, infos: Sequence[block_service_pb2.DartInfo]) -> Darts:
        """Of what a service answered."""
        darts = [info.dart for info in infos]
        return cls(
            map=map_name,
            block=np.array([dart.block for dart in darts], np.uint32),
            index=np.array([dart.dart for dart in darts], np.uint32),
            version=np.array([dart.version for dart in darts], np.uint64),
            point=np.array([(info.x, info.y, info.z) for info in infos], np.float64).reshape(-1, 3),
            cell=np.array([info.cell for info in infos], np.str_),
            level=np.array([info.level for info in infos], np.uint32),
            critical=np.array([info.critical for info in infos], np.bool_),
        )

    def __len__(self) -> int:
        return len(self.block)

    def __iter__(self) -> Iterator[DartInfo]:
        return (self[row] for row in range(len(self)))

    @overload
    def __getitem__(self, rows: int) -> DartInfo: ...

    @overload
    def __getitem__(self, rows: slice | np.ndarray) -> Darts: ...

    def __getitem__(self, rows: int | slice | np.ndarray) -> DartInfo | Darts:
        if isinstance(rows, (int, np.integer)):
            x, y, z = self.point[rows].tolist()
            return DartInfo(
                dart=Dart(self.map, int(self.block[rows]), int(self.index[rows]), int(self.version[rows])),
                point=(x, y, z),
                cell=str(self.cell[rows]),
                level=int(self.level[rows]),
                critical=bool(self.critical[rows]),
            )
        columns = (self.block, self.index, self.version, self.point, self.cell, self.level, self.critical)
        return Darts(self.map, *(column[rows] for column in columns))


@dataclass(frozen=True, eq=False)
class Walks:
    """Where walks ended, one row a walk."""

    # The last darts that the word reached.
    darts: Darts
    # Letters that were applied: all of them unless `free`.
    used: np.ndarray  # int64
    # The dart is free for the next letter: the boundary of the map.
    free: np.ndarray  # bool
    # How often a walk went on in another block, and how often that block was on another server.
    block_crossings: np.ndarray  # int64
    server_crossings: np.ndarray  # int64

    def __len__(self) -> int:
        return len(self.darts)


DartsLike = Union[Dart, DartInfo, Darts, Walks, "Iterable[Dart | DartInfo]"]
Word = Union[str, bytes, "Iterable[int]"]


def references(map_name: str, darts: DartsLike) -> list[navigate_pb2.DartRef]:
    """References to darts in whatever form they were given. InvalidArgumentError for darts of another map, and for
    numbers that no dart can have."""
    if isinstance(darts, Walks):
        darts = darts.darts
    if isinstance(darts, Darts):
        check_map(map_name, darts.map)
        columns = (darts.block.tolist(), darts.index.tolist(), darts.version.tolist())
        return [navigate_pb2.DartRef(block=b, dart=d, version=v) for b, d, v in zip(*columns)]
    if isinstance(darts, (Dart, DartInfo)):
        darts = [darts]
    result = []
    for item in darts:
        dart = item.dart if isinstance(item, DartInfo) else item
        if not isinstance(dart, Dart):
            raise InvalidArgumentError(f"a Dart or DartInfo expected, not {item!r}")
        check_map(map_name, dart.map)
        try:
            result.append(navigate_pb2.DartRef(block=dart.block, dart=dart.index, version=dart.version))
        except (TypeError, ValueError):
            raise InvalidArgumentError(
                f"{dart!r}: block and index are whole numbers below 2^32, the version one below 2^64"
            ) from None
    return result


def check_map(expected: str, given: str) -> None:
    """InvalidArgumentError unless darts of map `given` are of map `expected`."""
    if given != expected:
        raise InvalidArgumentError(f"a dart of map '{given}', this is map '{expected}'")


def parse_word(word: Word) -> bytes:
    """The letters, one a byte: of "1,2,3", "123", [1, 2, 3] or bytes of 0 ... 3. May be empty."""
    if isinstance(word, str):
        letters: list[object] = list(word.replace(",", "") if ",," not in f",{word}," or not word else "?")
        if not set(letters) <= set("0123"):
            raise InvalidArgumentError(f"'{word}' is not a word of betas 0 ... 3, for example 1,2,3")
        return bytes(int(str(letter)) for letter in letters)
    letters = list(word)
    for letter in letters:
        if not isinstance(letter, (int, np.integer)) or not 0 <= letter <= 3:
            raise InvalidArgumentError(f"beta {letter}: a map of dimension 3 has beta 0 ... 3")
    return bytes(letters)  # type: ignore[arg-type]
