# SPDX-License-Identifier: Apache-2.0
"""The initial grid of hexahedra over a surface, with the very numbers that the command line computes.

Each coordinate follows from plain operations on doubles in a fixed order, so that the hexahedra of `ndmap create` and
of this package are equal bit for bit.
"""
from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Sequence

from ndmap.errors import InvalidArgumentError
from ndmap.v1 import common_pb2

# How much the bounding box is enlarged about its centre unless told otherwise: no side of a hexahedron lies in an
# extreme face.
DEFAULT_PADDING = 0.001

_AXES = "xyz"
Triple = tuple[float, float, float]
Counts = tuple[int, int, int]


def _triple(values: Sequence[float]) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _check_box(lo: Sequence[float], hi: Sequence[float]) -> None:
    for axis, low, high in zip(_AXES, lo, hi):
        if not math.isfinite((high - low) * 4) or not math.isfinite(low) or not math.isfinite(high):
            raise InvalidArgumentError(f"bounding box is not finite along {axis}: {low} to {high}")
        if not high > low:
            raise InvalidArgumentError(
                f"bounding box is flat: no extent along {axis} at {low}; a grid needs a surface that encloses a volume"
            )


def parse_cells(grid: str | Sequence[int]) -> Counts:
    """Three counts of 1 or more, from "12x12x4" or (12, 12, 4)."""
    if isinstance(grid, str):
        parts = grid.split("x") if re.fullmatch(r"\d+x\d+x\d+", grid, re.ASCII) else []
    else:
        parts = list(grid)  # type: ignore[arg-type]
    try:
        counts = [int(part) for part in parts]
    except (TypeError, ValueError):
        counts = []
    whole = all(n == float(part) for n, part in zip(counts, parts))
    if len(counts) != 3 or not whole or any(not 1 <= n < 1 << 32 for n in counts):
        raise InvalidArgumentError(f"grid {grid!r}: three numbers of hexahedra expected, for example '12x12x4'")
    return counts[0], counts[1], counts[2]


def round_half_up(x: float) -> int:
    """The nearest whole number of a number of 0 or more; halves go up, as in C. The difference below is exact."""
    whole = math.floor(x)
    return whole + (1 if x - whole >= 0.5 else 0)


@dataclass(frozen=True)
class Grid:
    """cells[0] x cells[1] x cells[2] hexahedra in the box from lo to hi."""

    cells: Counts
    lo: Triple
    hi: Triple

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", parse_cells(self.cells))
        object.__setattr__(self, "lo", _triple(self.lo))
        object.__setattr__(self, "hi", _triple(self.hi))
        if self.cell_count >= 1 << 32:
            raise InvalidArgumentError(f"grid {self} has 2^32 cells or more")
        _check_box(self.lo, self.hi)

    def __str__(self) -> str:
        return "x".join(str(n) for n in self.cells)

    @property
    def cell_count(self) -> int:
        """The number of initial hexahedra."""
        return self.cells[0] * self.cells[1] * self.cells[2]

    @classmethod
    def from_counts(
        cls, lo: Sequence[float], hi: Sequence[float], cells: str | Sequence[int], padding: float = DEFAULT_PADDING
    ) -> Grid:
        """The box, enlarged about its centre by the factor 1 + padding, cut into cells ("12x12x4")."""
        _check_box(lo, hi)
        if not padding >= 0 or not math.isfinite(padding):
            raise InvalidArgumentError(f"padding {padding} is not a number of 0 or more")
        centres = [(a + b) / 2 for a, b in zip(lo, hi)]
        halves = [(b - a) / 2 for a, b in zip(lo, hi)]
        return cls(
            parse_cells(cells),
            _triple([c - h * (1 + padding) for c, h in zip(centres, halves)]),
            _triple([c + h * (1 + padding) for c, h in zip(centres, halves)]),
        )

    @classmethod
    def from_cubes(cls, lo: Sequence[float], hi: Sequence[float], cubes: int) -> Grid:
        """Cubes, that many along the longest side."""
        _check_box(lo, hi)
        if not isinstance(cubes, int) or cubes < 1:
            raise InvalidArgumentError(f"{cubes} cubes along the longest side; 1 or more expected")
        side = (1 + DEFAULT_PADDING) * max(b - a for a, b in zip(lo, hi)) / cubes
        counts = [max(1, math.ceil((b - a) / side)) for a, b in zip(lo, hi)]
        centres = [(a + b) / 2 for a, b in zip(lo, hi)]
        return cls(
            parse_cells(counts),
            _triple([c - side * n / 2 for c, n in zip(centres, counts)]),
            _triple([c + side * n / 2 for c, n in zip(centres, counts)]),
        )

    @classmethod
    def auto(
        cls, lo: Sequence[float], hi: Sequence[float], about: int = 1000, padding: float = DEFAULT_PADDING
    ) -> Grid:
        """About that many near-cubic cells; a box much thinner in one axis has one layer there."""
        _check_box(lo, hi)
        if about < 1:
            raise InvalidArgumentError(f"a grid of about {about} cells; 1 or more expected")

        def counts_at(side: float) -> Counts:
            x, y, z = (max(1, round_half_up((b - a) / side)) for a, b in zip(lo, hi))
            return x, y, z

        # The number of cells never grows with the side: bisect between a side that gives at least that many and one
        # that gives a single cell.
        coarse = max(b - a for a, b in zip(lo, hi))
        fine = coarse / about
        for _ in range(64):
            middle = (fine + coarse) / 2
            if math.prod(counts_at(middle)) >= about:
                fine = middle
            else:
                coarse = middle
        more, fewer = counts_at(fine), counts_at(coarse)
        closer = more if math.prod(more) - about < about - math.prod(fewer) else fewer
        return cls.from_counts(lo, hi, closer, padding)

    def to_proto(self) -> common_pb2.Grid:
        """The message that says the same."""
        return common_pb2.Grid(cells=self.cells, lo=self.lo, hi=self.hi)

    @classmethod
    def from_proto(cls, grid: common_pb2.Grid) -> Grid | None:
        """What the message says; None of a map without a grid."""
        if len(grid.cells) != 3 or len(grid.lo) != 3 or len(grid.hi) != 3:
            return None
        return cls(parse_cells(grid.cells), _triple(grid.lo), _triple(grid.hi))
