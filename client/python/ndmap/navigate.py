# SPDX-License-Identifier: Apache-2.0
"""Cells and their neighbourhoods: questions that the cluster answers for the whole map, wherever the cells live."""
from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Callable, Iterable

import numpy as np

from ndmap import walk
from ndmap.anchors import (
    Anchors,
    BlockAnchor,
    BoxAnchor,
    Closures,
    NearestVertexAnchor,
    PointAnchor,
    PointLike,
    to_closures,
    to_dimension,
    to_point,
    to_points,
    to_wire,
)
from ndmap.connection import Connection, server_name
from ndmap.darts import Dart, DartInfo, Darts
from ndmap.errors import (
    AbortedError,
    FailedPreconditionError,
    InvalidArgumentError,
    NotFoundError,
    ResourceExhaustedError,
    StaleDartError,
)
from ndmap.ids import DTYPE, CellId, CellIdLike, CellIds, to_cell_id
from ndmap.info import MapInfo
from ndmap.stats import block_stats
from ndmap.v1 import navigate_pb2 as pb

_GIVES = {"darts": pb.GIVE_DARTS, "cells": pb.GIVE_CELLS, "details": pb.GIVE_CELL_DETAILS}
# A question may close that often.
MAX_CLOSURES = 64
# What needs several questions begins again when the map changed between them, so often in all.
_ATTEMPTS = 4
_AT_ONCE = 4


@dataclass(frozen=True, eq=False)
class CellDetails:
    """One cell of any dimension."""

    id: CellId
    # 0 of a vertex ... 3 of a hexahedron.
    dimension: int
    # Of its id: how often its initial cell was halved.
    level: int
    # Of a 3-cell: "hexahedron", or in a map made from a mesh also "prism", "pyramid" or "tetrahedron"; "" of others.
    kind: str
    # Of a 3-cell: "inside", "cut", "outside" or "unknown".
    state: str
    # Its canonical dart: the same place whatever the blocks.
    dart: Dart
    # Of an edge both ends, of a face in its order (hanging ones included), of a hexahedron the corners 0 ... 7,
    # of another 3-cell its corners.
    vertices: CellIds
    # A row a vertex, n x 3 doubles.
    points: np.ndarray
    # Blocks that have darts of it.
    blocks: tuple[int, ...]
    # How many darts it has.
    darts: int
    # It lies on the boundary of the map.
    boundary: bool

    @classmethod
    def from_proto(cls, map_name: str, cell: pb.CellDetails, versions: dict[int, int]) -> CellDetails:
        """Of what a service answered, and the versions of the blocks that it asked."""
        block = cell.dart.block
        return cls(
            id=CellId(cell.id.hi, cell.id.lo),
            dimension=cell.dimension,
            level=cell.level,
            kind=cell.kind,
            state=cell.state,
            dart=Dart(map_name, block, cell.dart.dart, cell.dart.version or versions.get(block, 0)),
            vertices=CellIds.from_words((v.hi for v in cell.vertices), (v.lo for v in cell.vertices)),
            points=np.array([(p.x, p.y, p.z) for p in cell.points], np.float64).reshape(-1, 3),
            blocks=tuple(cell.blocks),
            darts=cell.darts,
            boundary=cell.boundary,
        )

    def __str__(self) -> str:
        return str(self.id)


class Navigator:
    """The questions of one map."""

    def __init__(self, connection: Connection, info: MapInfo) -> None:
        self._connection = connection
        self._info = info

    def _ask(self, request: pb.ExploreRequest) -> pb.ExploreResponse:
        """The whole answer. Asked of the server of the first block that is named, or else of that of block 0."""
        anchor = request.anchors[0]
        block = anchor.dart.block if anchor.HasField("dart") else anchor.block
        address = self._info.address_of(block)
        stub = self._connection.block_server(address)
        timeout = self._connection.options.call_timeout

        def read() -> pb.ExploreResponse:
            whole = pb.ExploreResponse()
            for part in stub.Explore(request, timeout=timeout):
                whole.MergeFrom(part)
            return whole

        try:
            return self._connection.retry(lambda: self._connection.guarded(read, server_name(address)))
        except FailedPreconditionError as error:
            if (self._info.grid is None and self._info.mesh is None) or not _names_version(request):
                raise
            raise StaleDartError(str(error)) from None

    def explore(
        self, anchors: Anchors, close: Closures, give: str, dimension: int, without_anchors: bool, max_darts: int
    ) -> Darts | CellIds | list[CellDetails]:
        """Map.explore."""
        if give not in _GIVES:
            raise InvalidArgumentError(f"give {give!r} is none of {', '.join(_GIVES)}")
        if not isinstance(max_darts, (int, np.integer)) or not 0 <= max_darts < 1 << 64:
            raise InvalidArgumentError(f"max_darts {max_darts!r}: a whole number of 0 or more expected")
        request = pb.ExploreRequest(
            map=self._info.name,
            anchors=to_wire(self._info.name, anchors),
            close=to_closures(close),
            give=_GIVES[give],
            dimension=to_dimension(dimension),
            without_anchors=without_anchors,
            max_darts=int(max_darts),
        )
        if not request.anchors:
            raise InvalidArgumentError("a question needs one anchor or more")
        if give == "darts":
            return self._darts(request)
        answer = self._ask(request)
        if give == "cells":
            return CellIds.from_words(answer.cell_hi, answer.cell_lo)
        versions = dict(zip(answer.blocks, answer.versions))
        return [CellDetails.from_proto(self._info.name, cell, versions) for cell in answer.cells]

    def _darts(self, request: pb.ExploreRequest) -> Darts:
        """The darts of the answer, and, by a second question to their blocks, what is at them."""
        for _ in range(_ATTEMPTS):
            answer = self._ask(request)
            versions = dict(zip(answer.blocks, answer.versions))
            darts = [
                Dart(self._info.name, block, index, versions.get(block, 0))
                for block, index in zip(answer.dart_blocks, answer.darts)
            ]
            try:
                return walk.beta(self._connection, self._info, darts, "").darts
            except StaleDartError:
                # Not a dart of the caller's: the block changed between the two questions.
                if _names_version(request):
                    raise
        raise self._changing()

    def _changing(self) -> AbortedError:
        return AbortedError(
            f"map '{self._info.name}' changed {_ATTEMPTS} times while it was asked: ask again when its job is done"
        )

    def ids(
        self,
        anchors: Anchors,
        close: Closures,
        dimension: int,
        *,
        without_anchors: bool = False,
        max_darts: int = 0,
    ) -> CellIds:
        """explore() that gives ids."""
        result = self.explore(anchors, close, "cells", dimension, without_anchors, max_darts)
        assert isinstance(result, CellIds)
        return result

    # --- Questions that may be too large for one. ---

    def _steadily(self, collect: Callable[[], Iterable[CellIds]]) -> CellIds:
        """The union of several answers, of one and the same state of the map."""
        for _ in range(_ATTEMPTS):
            before = block_stats(self._connection, self._info)["version"]
            parts = [np.asarray(part) for part in collect()]
            # A version that was left never comes back.
            if np.array_equal(before, block_stats(self._connection, self._info)["version"]):
                return CellIds(np.unique(np.concatenate([np.empty(0, DTYPE), *parts])))
        raise self._changing()

    def cells(self, dimension: int, max_darts: int) -> CellIds:
        """Map.cells."""
        dimension = to_dimension(dimension)

        def by_block() -> list[CellIds]:
            blocks = map(BlockAnchor, sorted(self._info.addresses))
            return [self.ids(block, "", dimension, max_darts=max_darts) for block in blocks]

        try:
            return self._steadily(by_block)
        except ResourceExhaustedError:
            extent = self._info.extent()
            if extent is None:
                raise
        lo, hi, _ = extent
        return self._steadily(lambda: self._in_boxes(lo, hi, "3", dimension, max_darts))

    def box(self, lo: PointLike, hi: PointLike, max_darts: int) -> CellIds:
        """Map.box."""
        try:
            return self.ids(BoxAnchor(lo, hi), "", 3, max_darts=max_darts)
        except ResourceExhaustedError:
            extent = self._info.extent()
            if extent is None:
                raise
        # Halving what is outside the mesh leads nowhere; the last corners may be off the grid's box by a rounding.
        least, most, _ = extent
        margin = (most - least) * 0.001
        low, high = np.maximum(to_point(lo), least - margin), np.minimum(to_point(hi), most + margin)
        return self._steadily(lambda: self._in_boxes(low, high, "", 3, max_darts))

    def _in_boxes(
        self, lo: np.ndarray, hi: np.ndarray, close: str, dimension: int, max_darts: int
    ) -> Iterable[CellIds]:
        """Of the hexahedra that meet a box: in as many halves of it as the limit asks for."""
        try:
            yield self.ids(BoxAnchor(lo, hi), close, dimension, max_darts=max_darts)
            return
        except ResourceExhaustedError:
            extent = self._info.extent()
            assert extent is not None
            _, _, smallest = extent
            axis = int(np.argmax((hi - lo) / smallest))
            # One hexahedron alone is over the limit.
            if hi[axis] - lo[axis] < smallest[axis]:
                raise
        below, above = hi.copy(), lo.copy()
        below[axis] = above[axis] = lo[axis] / 2 + hi[axis] / 2
        yield from self._in_boxes(lo, below, close, dimension, max_darts)
        yield from self._in_boxes(above, hi, close, dimension, max_darts)

    # --- Questions about one cell or place. ---

    def cell(self, cell: CellIdLike) -> CellDetails:
        """Map.cell."""
        wanted = to_cell_id(cell)
        return self._only(self.explore(wanted, [wanted.dimension], "details", wanted.dimension, False, 0), str(wanted))

    def nearest_vertex(self, point: PointLike) -> CellDetails:
        """Map.nearest_vertex."""
        return self._only(self.explore(NearestVertexAnchor(point), "0", "details", 0, False, 0), "vertex")

    def _only(self, details: Any, what: str) -> CellDetails:
        if len(details) != 1:
            raise NotFoundError(f"map '{self._info.name}' has no {what}")
        return details[0]

    def locate(self, points: Any) -> list[CellIds]:
        """Map.locate."""
        array = to_points(points)
        with ThreadPoolExecutor(_AT_ONCE) as pool:
            return list(pool.map(lambda point: self.ids(PointAnchor(point), "", 3), array))

    def incident(self, cell: CellIdLike, dimension: int) -> CellIds:
        """Map.incident."""
        wanted = to_cell_id(cell)
        return self.ids(wanted, [wanted.dimension], dimension)

    def ring(self, cell: CellIdLike, k: int, through: int | None) -> CellIds:
        """Map.ring."""
        wanted = to_cell_id(cell)
        own = wanted.dimension
        across = (own - 1 if own else 1) if through is None else to_dimension(through)
        if across == own:
            raise InvalidArgumentError(f"through={across}: {wanted} has this dimension itself, another one expected")
        most = MAX_CLOSURES // 2
        if not isinstance(k, (int, np.integer)) or not 1 <= k <= most:
            raise InvalidArgumentError(f"ring {k!r}: 1 ... {most} expected")
        return self.ids(wanted, [own, across] * int(k), own, without_anchors=True)

    def orbit(self, of: Dart | DartInfo | CellIdLike, i: int | None) -> Darts:
        """Map.orbit."""
        if isinstance(of, (Dart, DartInfo)):
            if i is None:
                raise InvalidArgumentError("the orbit of a dart: i expected, 0 (its vertex) to 3 (its hexahedron)")
            anchor: Anchors = of
            close = [to_dimension(i)]
        else:
            anchor = to_cell_id(of)
            close = [anchor.dimension] + ([] if i in (None, anchor.dimension) else [to_dimension(i)])
        result = self.explore(anchor, close, "darts", 0, False, 0)
        assert isinstance(result, Darts)
        return result


def _names_version(request: pb.ExploreRequest) -> bool:
    return any(anchor.HasField("dart") and anchor.dart.version for anchor in request.anchors)
