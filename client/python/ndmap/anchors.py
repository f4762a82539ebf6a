# SPDX-License-Identifier: Apache-2.0
"""Where a question about cells begins, and the parts of questions that callers write, checked."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterable, Sequence, Union

import numpy as np

from ndmap.darts import Dart, DartInfo, Darts, DartsLike, Walks, parse_word, references
from ndmap.errors import InvalidArgumentError
from ndmap.ids import CellId, CellIds, to_cell_id
from ndmap.v1 import navigate_pb2 as pb


PointLike = Union["Sequence[float]", np.ndarray]


@dataclass(frozen=True)
class PointAnchor:
    """All hexahedra that contain the point: several on a boundary between them, none outside the mesh."""

    point: PointLike


@dataclass(frozen=True)
class BoxAnchor:
    """All hexahedra that the closed box meets."""

    lo: PointLike
    hi: PointLike


@dataclass(frozen=True)
class NearestVertexAnchor:
    """The vertex nearest to the point; of those equally near the one with the lowest id."""

    point: PointLike


@dataclass(frozen=True)
class BlockAnchor:
    """Every dart of a block."""

    block: int


# Dart, DartInfo, Darts, Walks; CellId or its text, CellIds, CellDetails; one of the anchors above; or many of these.
Anchors = Any
Closures = Union[str, "Iterable[int]"]


def to_points(points: Any) -> np.ndarray:
    """n x 3 finite doubles; InvalidArgumentError otherwise."""
    try:
        array = np.asarray(points, np.float64)
    except (TypeError, ValueError):
        array = np.empty(1)
    if array.size == 0:
        array = array.reshape(-1, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidArgumentError(f"{str(points)[:200]!r}: points (x, y, z) expected, n x 3 numbers")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(bad):
        x, y, z = array[bad[0]]
        raise InvalidArgumentError(f"a point of coordinates {x:g}, {y:g}, {z:g}, expected finite numbers")
    return array


def to_point(point: Any) -> np.ndarray:
    """Three finite doubles; InvalidArgumentError otherwise."""
    try:
        x, y, z = point
    except (TypeError, ValueError):
        raise InvalidArgumentError(f"{str(point)[:200]!r}: a point (x, y, z) expected") from None
    return to_points([(x, y, z)])[0]


def _wire_point(point: Any) -> pb.Point:
    x, y, z = to_point(point).tolist()
    return pb.Point(x=x, y=y, z=z)


def _wire_cell(cell: CellId) -> pb.Anchor:
    return pb.Anchor(cell=pb.CellId(hi=cell.hi, lo=cell.lo))


def to_dimension(dimension: Any) -> int:
    """0 ... 3; InvalidArgumentError otherwise."""
    if not isinstance(dimension, (int, np.integer)) or isinstance(dimension, bool) or not 0 <= dimension <= 3:
        raise InvalidArgumentError(f"dimension {dimension!r}, expected 0 (vertices) to 3 (hexahedra)")
    return int(dimension)


def to_closures(close: Closures) -> list[int]:
    """Dimensions to close over, of "3,2", "32", [3, 2], or none."""
    try:
        return list(parse_word(close))
    except (TypeError, InvalidArgumentError):
        raise InvalidArgumentError(f"close={close!r}: dimensions 0 ... 3 expected, for example '3,2'") from None


def to_wire(map_name: str, anchors: Anchors) -> list[pb.Anchor]:
    """Of whatever form they were given in. InvalidArgumentError names what is no anchor."""
    if isinstance(anchors, (Dart, DartInfo, Darts, Walks)):
        darts: DartsLike = anchors
        return [pb.Anchor(dart=dart) for dart in references(map_name, darts)]
    if isinstance(anchors, (CellId, str)) or isinstance(getattr(anchors, "id", None), CellId):
        return [_wire_cell(to_cell_id(anchors))]
    if isinstance(anchors, CellIds):
        return [_wire_cell(cell) for cell in anchors]
    if isinstance(anchors, PointAnchor):
        return [pb.Anchor(point=_wire_point(anchors.point))]
    if isinstance(anchors, NearestVertexAnchor):
        return [pb.Anchor(nearest_vertex=_wire_point(anchors.point))]
    if isinstance(anchors, BoxAnchor):
        return [pb.Anchor(box=pb.Box(lo=_wire_point(anchors.lo), hi=_wire_point(anchors.hi)))]
    if isinstance(anchors, BlockAnchor):
        if not isinstance(anchors.block, (int, np.integer)) or not 0 <= anchors.block < 1 << 32:
            raise InvalidArgumentError(f"block {anchors.block!r}: a number of 0 or more expected")
        return [pb.Anchor(block=int(anchors.block))]
    if isinstance(anchors, (list, tuple)) or hasattr(anchors, "__next__"):
        return [anchor for item in anchors for anchor in to_wire(map_name, item)]
    raise InvalidArgumentError(f"a dart, a cell or an anchor expected, not {str(anchors)[:200]!r}")
