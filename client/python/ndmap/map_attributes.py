# SPDX-License-Identifier: Apache-2.0
"""What a map can do about the attributes of its cells."""
from __future__ import annotations

from typing import Any, Callable, overload

from ndmap.aggregate import Aggregate, aggregate
from ndmap.anchors import Anchors, Closures, PointLike
from ndmap.attributes import Attribute, CellKind, definition, fetch_attributes
from ndmap.connection import Connection
from ndmap.info import MapInfo
from ndmap.job import Job, ProgressCallback
from ndmap.v1 import attributes_pb2
from ndmap.values import CellsLike, CellValues, Columns, Where, Written


class MapAttributes:
    """A part of Map: columns of values on its cells (docs/attributes.md)."""

    _connection: Connection
    _info: MapInfo

    def _columns(self) -> Columns:
        return Columns(self._connection, self._info)

    def define(
        self,
        name: str,
        on: CellKind,
        type: str = "double",
        split: str = "copy",
        fill: Any = None,
        progress: ProgressCallback | None = None,
    ) -> Job:
        """A new attribute on "vertices", "edges", "faces" or "hexahedra" (or 0 ... 3). It is there when the job is
        done; every cell has the value `fill` then (unless given: 0, or the empty text).

        Types: "double", "int64", "vec3", "category" (short texts). `split` is what new cells get when cells are split:
        "copy", "mean" (vertices: of the corners), "midpoint" (vertices), "zero", "divide" (other cells: their share).
        """
        request = attributes_pb2.DefineAttributeRequest(
            map=self._info.name, attribute=definition(name, on, type, split, fill)
        )
        job = self._connection.once(self._connection.coordinator.DefineAttribute, request).job
        return Job(self._connection, job.job, progress)

    def drop(self, name: str, progress: ProgressCallback | None = None) -> Job:
        """Takes an attribute and its values away. NotFoundError if there is none of the name."""
        request = attributes_pb2.DropAttributeRequest(map=self._info.name, name=name)
        job = self._connection.once(self._connection.coordinator.DropAttribute, request).job
        return Job(self._connection, job.job, progress)

    def attributes(self) -> list[Attribute]:
        """Those that are there now."""
        return list(fetch_attributes(self._connection, self._info.name).values())

    def read(
        self,
        *names: str,
        on: CellKind | None = None,
        ids: CellsLike | None = None,
        box: tuple[PointLike, PointLike] | None = None,
        where: Anchors | None = None,
        close: Closures = "",
        levels: int | tuple[int, int] | None = None,
        skip_missing: bool = False,
    ) -> CellValues:
        """Values of cells, in columns: of attributes of one dimension, or of what the map itself knows: "@point" (of
        a vertex; of another cell the mean of its corners), "@level", "@block", of hexahedra "@volume" and "@state".
        `on` says which cells, where neither an attribute nor the ids do.

        Of all cells, or of those of some `levels` (one, or the lowest and the highest), or with one of `ids` (ids, or
        what was read before), `box` (lo, hi: the cells of the hexahedra that meet it), `where` and `close` (the cells
        that an explore() gives).

        Ids have their rows in the order given; NotFoundError if the map has not all of them, unless `skip_missing`
        leaves those out. All else is in the order of the ids. Waits while a job gives new cells their values.
        """
        return self._columns().read(names, on, Where(ids, box, where, close, levels), skip_missing)

    def write(self, name: str, ids: CellsLike, values: Any) -> Written:
        """Gives each of the cells its value: as many values as ids (or one for all), of vec3 rows of three. Ids are
        ids, or what was read of cells. Every block that shares a cell has the value then. Ids that the map has not are
        counted in what is returned, and written nowhere.

        Of two writes to a cell the later one stands. Written in parts of 65,536 cells; parts of two writers may come in
        turns, and after an error some parts may have been written.
        """
        return self._columns().write(name, ids, values)

    def set(
        self,
        name: str,
        value: Any,
        *,
        ids: CellsLike | None = None,
        box: tuple[PointLike, PointLike] | None = None,
        where: Anchors | None = None,
        close: Closures = "",
        levels: int | tuple[int, int] | None = None,
    ) -> Written:
        """Gives many cells one value: all, or as read() chooses them."""
        return self._columns().set(name, value, Where(ids, box, where, close, levels))

    def compute(
        self,
        name: str,
        function: Callable[..., Any],
        *names: str,
        ids: CellsLike | None = None,
        box: tuple[PointLike, PointLike] | None = None,
        where: Anchors | None = None,
        close: Closures = "",
        levels: int | tuple[int, int] | None = None,
    ) -> Written:
        """Reads the columns `names` of the attribute's cells, hands them to `function`, one array each, and writes what
        that returns: compute("temperature", lambda point: 20 + 5 * point[:, 2], "@point"). Of all cells, or as read()
        chooses them. What others write meanwhile may be written over."""
        columns = self._columns()
        on = columns.attribute(name).dimension
        values = columns.read(names, on, Where(ids, box, where, close, levels), False)
        return columns.write(name, values, function(*(values[each] for each in names)))

    @overload
    def aggregate(
        self,
        name: str | None = None,
        *,
        on: CellKind | None = None,
        by: None = None,
        histogram: tuple[int, float, float] | None = None,
        integral: bool = False,
        levels: int | tuple[int, int] | None = None,
    ) -> Aggregate: ...

    @overload
    def aggregate(
        self,
        name: str | None = None,
        *,
        on: CellKind | None = None,
        by: str,
        histogram: tuple[int, float, float] | None = None,
        integral: bool = False,
        levels: int | tuple[int, int] | None = None,
    ) -> dict[Any, Aggregate]: ...

    def aggregate(
        self,
        name: str | None = None,
        *,
        on: CellKind | None = None,
        by: str | None = None,
        histogram: tuple[int, float, float] | None = None,
        integral: bool = False,
        levels: int | tuple[int, int] | None = None,
    ) -> Aggregate | dict[Any, Aggregate]:
        """Count, exact sum, minimum and maximum of an attribute, or of one of the "@..." of read(), computed where the
        cells are. Without a name cells are only counted: `on` says which.

        `by` makes a dict with an Aggregate a group: "level", "block" (a shared cell counts in the lowest of them), or
        "category:NAME", by the texts of an attribute; without it there is one Aggregate. `histogram` is (bins, lo, hi). `integral` adds the
        integral over the volume: hexahedra times their values, or times the mean of their corners'. `levels` as read().
        """
        return aggregate(self._connection, self._info, name, on, by, histogram, integral, levels)
