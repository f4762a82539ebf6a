# SPDX-License-Identifier: Apache-2.0
"""Numbers that vertices and 3-cells have in exported files (docs/decisions/0006), from ids alone: in a map made from a grid
places in the finest lattice of it whose numbers fit in 64 bits, in one made from a mesh places in the lattices of its cells."""
from __future__ import annotations

import numpy as np

from ndmap.grid import Grid
from ndmap.ids import MAX_LEVEL, CellIds
from ndmap.info import MapInfo

# Places of corners of a cell that is no hexahedron.
_RANKS = 8
_LOW = np.uint64((1 << 30) - 1)


def finest_level(grid: Grid) -> int:
    """Of the lattice."""
    for level in range(MAX_LEVEL):
        points = 1.0
        for cells in grid.cells:
            points *= float(cells) * 2.0 ** (level + 1) + 1.0
        if points >= 2.0**62:
            return level
    return MAX_LEVEL


class _Paths:
    """The lower 94 bits of ids."""

    def __init__(self, ids: CellIds) -> None:
        self.high, self.low = ids.hi & _LOW, ids.lo

    def bits(self, first: int, count: int) -> np.ndarray:
        """Some of them, at most 8, as small numbers."""
        if first >= 64:
            found = self.high >> np.uint64(first - 64)
        else:
            found = self.low >> np.uint64(first)
            if first + count > 64:
                found = found | self.high << np.uint64(64 - first)
        return (found & np.uint64((1 << count) - 1)).astype(np.int64)

    def sentinels(self) -> np.ndarray:
        """Places of the highest bit that is set."""
        # 32 bits at a time: these are doubles without loss.
        words = (self.low & np.uint64(0xFFFFFFFF), self.low >> np.uint64(32), self.high)
        result = np.zeros(len(self.low), np.int64)
        for first, word in zip((0, 32, 64), words):
            length = np.frexp(word.astype(np.float64))[1]
            result = np.where(length > 0, first + length - 1, result)
        return result


def finest_mesh_level(cells: int) -> int:
    """Of the lattice of a cell, in a mesh of so many."""
    for level in range(MAX_LEVEL):
        if ((2.0 ** (level + 1) + 1.0) ** 3 + _RANKS) * cells >= 2.0**62:
            return level
    return MAX_LEVEL


def mesh_file_numbers(ids: CellIds, cells: int) -> np.ndarray:
    """Of vertices, or of 3-cells, in a map made from a mesh of so many cells: int64, in their order."""
    finest = finest_mesh_level(cells)
    along = (1 << finest) + 1
    initial = (ids.hi >> np.uint64(30)).astype(np.int64)
    result = np.empty(len(ids), np.int64)
    sentinels = _Paths(ids).sentinels()
    for sentinel in np.unique(sentinels).tolist():
        rows = np.flatnonzero(sentinels == sentinel)
        paths, number = _Paths(ids[rows]), initial[rows]
        if sentinel % 3 == 1:
            result[rows] = number * (along**3 + _RANKS) + along**3 + paths.bits(0, 8)
            continue
        below = 5 if sentinel % 3 == 2 else 0
        level = (sentinel - below) // 3
        at, path = [np.zeros(len(rows), np.int64) for _ in range(3)], number
        for digit in (paths.bits(below + 3 * k, 3) for k in reversed(range(level))):
            path = 8 * path + digit
            at = [2 * each + (digit >> axis & 1) for axis, each in enumerate(at)]
        if below:
            part = paths.bits(0, 5)
            x, y, z = ((each + part // 3**axis % 3) << (finest - level) for axis, each in enumerate(at))
            result[rows] = number * (along**3 + _RANKS) + x + along * (y + along * z)
        else:
            result[rows] = path << 3 * (finest - level)
    return result


def numbers_of(ids: CellIds, info: MapInfo) -> np.ndarray:
    """Of vertices, or of 3-cells, of a map: int64, in their order."""
    if info.mesh is not None:
        return mesh_file_numbers(ids, info.mesh.cells)
    assert info.grid is not None
    return file_numbers(ids, info.grid)


def file_numbers(ids: CellIds, grid: Grid) -> np.ndarray:
    """Of vertices, or of hexahedra, in a map made from a grid: int64, in their order."""
    finest = finest_level(grid)
    nx, ny, _ = grid.cells
    initial = (ids.hi >> np.uint64(30)).astype(np.int64)
    result = np.empty(len(ids), np.int64)
    sentinels = _Paths(ids).sentinels()
    for sentinel in np.unique(sentinels).tolist():
        rows = np.flatnonzero(sentinels == sentinel)
        paths, number = _Paths(ids[rows]), initial[rows]
        at = [number % nx, number // nx % ny, number // nx // ny]
        below = 5 if sentinel % 3 == 2 else 0
        level = (sentinel - below) // 3
        for digit in (paths.bits(below + 3 * k, 3) for k in reversed(range(level))):
            number = 8 * number + digit
            at = [2 * along + (digit >> axis & 1) for axis, along in enumerate(at)]
        if below:
            part = paths.bits(0, 5)
            x, y, z = ((along + part // 3**axis % 3) << (finest - level) for axis, along in enumerate(at))
            result[rows] = x + ((nx << finest) + 1) * (y + ((ny << finest) + 1) * z)
        else:
            result[rows] = number << 3 * (finest - level)
    return result
