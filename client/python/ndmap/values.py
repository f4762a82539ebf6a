# SPDX-License-Identifier: Apache-2.0
"""Values of cells: read and written in columns, wherever the cells live."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Sequence, Union

import numpy as np

from ndmap.anchors import Anchors, BoxAnchor, Closures, to_closures, to_wire
from ndmap.attributes import (
    CELLS,
    INTRINSIC,
    OF_HEXAHEDRA,
    Attribute,
    CellKind,
    Values,
    dimension_of,
    fetch_attributes,
)
from ndmap.connection import Connection, server_name
from ndmap.errors import InternalError, InvalidArgumentError, NotFoundError
from ndmap.ids import CellId, CellIdLike, CellIds
from ndmap.info import MapInfo
from ndmap.v1 import attributes_pb2 as pb
from ndmap.v1 import navigate_pb2

# Cells in one message.
MAX_CELLS = 65536


class CellValues:
    """Values of cells in columns, a row a cell: `ids`, and by name `values["temperature"]`: doubles or integers (n), of
    vec3 doubles (n x 3), of categories texts (n objects)."""

    def __init__(self, on: str, ids: CellIds, columns: dict[str, Values]) -> None:
        self.on = on
        self.ids = ids
        self._columns = columns

    def __len__(self) -> int:
        return len(self.ids)

    def keys(self) -> list[str]:
        """The names, in the order in which they were asked for."""
        return list(self._columns)

    def column(self, name: str) -> Values:
        """One of them as it came. NotFoundError if it was not read."""
        if name not in self._columns:
            raise NotFoundError(f"'{name}' was not read, but {', '.join(self._columns)}")
        return self._columns[name]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.column(name).array()

    def codes(self, name: str) -> tuple[np.ndarray, tuple[str, ...]]:
        """Of categories: a number a row, and the texts that the numbers are places in."""
        column = self.column(name)
        if column.categories is None:
            raise InvalidArgumentError(f"'{name}' has numbers, no categories")
        return column.data, column.categories

    def rows(self, which: slice | np.ndarray) -> CellValues:
        """Some rows, by slice, index array or mask."""
        return CellValues(self.on, self.ids[which], {name: part.rows(which) for name, part in self._columns.items()})

    def __repr__(self) -> str:
        return f"<CellValues {len(self)} {self.on}: {', '.join(self._columns)}>"


@dataclass(frozen=True)
class Written:
    """What became of a write."""

    # Cells.
    written: int
    # Ids of which the map has no cell now, or none of the attribute's dimension: how many, and the first of them.
    missing: int = 0
    missing_ids: tuple[str, ...] = ()


# Which cells: ids, or what was read of them.
CellsLike = Union[CellIds, CellValues, CellIdLike, "Iterable[CellIdLike]"]


def to_ids(cells: Any) -> CellIds:
    """InvalidArgumentError for what is no id."""
    if isinstance(cells, CellValues):
        return cells.ids
    if isinstance(cells, CellIds):
        return cells
    if isinstance(cells, (CellId, str)) or isinstance(getattr(cells, "id", None), CellId):
        return CellIds.of([cells])
    try:
        return CellIds.of(cells)
    except TypeError:
        raise InvalidArgumentError(f"ids of cells expected, not {str(cells)[:200]!r}") from None


def _wire_ids(ids: CellIds) -> pb.CellSelection.Ids:
    return pb.CellSelection.Ids(hi=ids.hi.tolist(), lo=ids.lo.tolist())


def set_levels(message: Any, levels: int | Sequence[int] | None) -> None:
    """`by_level` and what belongs to it, of a level or of (lowest, highest). InvalidArgumentError for anything else."""
    if levels is None:
        return
    ends = [levels, levels] if isinstance(levels, (int, np.integer)) else list(levels)
    if len(ends) != 2 or not all(isinstance(end, (int, np.integer)) and 0 <= end < 64 for end in ends):
        raise InvalidArgumentError(f"levels={levels!r}: a level, or the lowest and the highest one, expected")
    message.by_level, message.lowest_level, message.highest_level = True, int(ends[0]), int(ends[1])


@dataclass(frozen=True)
class Where:
    """Which cells somebody asks for: by ids; those of hexahedra that meet a box; those that a question gives; all."""

    ids: Any = None
    box: Any = None
    where: Any = None
    close: Closures = ""
    levels: Any = None

    def check(self) -> None:
        """InvalidArgumentError if more than one is meant."""
        given = [name for name in ("ids", "box", "where", "levels") if getattr(self, name) is not None]
        if len(given) > 1:
            raise InvalidArgumentError(f"{' and '.join(given)} exclude each other")
        if self.close and self.where is None:
            raise InvalidArgumentError("close goes with where")

    def to_proto(self, map_name: str, dimension: int) -> pb.CellSelection:
        """The message, but for ids."""
        if self.box is not None:
            try:
                lo, hi = self.box
            except (TypeError, ValueError):
                raise InvalidArgumentError(f"box={str(self.box)[:200]!r}: two points, (lo, hi), expected") from None
            # A box gives one dart of each hexahedron.
            return _query(map_name, BoxAnchor(lo, hi), [3] if dimension < 3 else [])
        if self.where is not None:
            return _query(map_name, self.where, to_closures(self.close))
        selection = pb.CellSelection(all=pb.CellSelection.All())
        set_levels(selection, self.levels)
        return selection


def _query(map_name: str, anchors: Anchors, close: list[int]) -> pb.CellSelection:
    request = navigate_pb2.ExploreRequest(anchors=to_wire(map_name, anchors), close=close)
    if not request.anchors:
        raise InvalidArgumentError("a question needs one anchor or more")
    return pb.CellSelection(query=request)


class Columns:
    """Reads and writes of one map."""

    def __init__(self, connection: Connection, info: MapInfo) -> None:
        self._connection = connection
        self._info = info

    def attribute(self, name: str) -> Attribute:
        """As it is now. NotFoundError names those that there are."""
        return self._among(fetch_attributes(self._connection, self._info.name), name)

    def _among(self, there: dict[str, Attribute], name: str) -> Attribute:
        if name not in there:
            names = ", ".join(sorted(there)) or "none"
            raise NotFoundError(f"map '{self._info.name}' has no attribute '{name}', it has {names}")
        return there[name]

    def dimension(self, names: Iterable[str], on: CellKind | None, ids: CellIds | None) -> tuple[int, dict[str, str]]:
        """Of cells that have all these values: as their attributes say, or `on`, or the ids; and the values' types."""
        kinds, dimensions = {}, {} if on is None else {f"on={on!r}": dimension_of(on)}
        there: dict[str, Attribute] | None = None
        for name in names:
            if name.startswith("@"):
                if name not in INTRINSIC:
                    raise InvalidArgumentError(f"'{name}' is none of {', '.join(INTRINSIC)}")
                kinds[name] = INTRINSIC[name]
                if name in OF_HEXAHEDRA:
                    dimensions[name] = 3
                continue
            there = fetch_attributes(self._connection, self._info.name) if there is None else there
            attribute = self._among(there, name)
            kinds[name], dimensions[name] = attribute.type, attribute.dimension
        if not dimensions and ids is not None and len(ids):
            dimensions[str(ids[0])] = ids[0].dimension
        if not dimensions:
            raise InvalidArgumentError(f"of which cells? on= one of {', '.join(CELLS)} expected")
        if len(set(dimensions.values())) > 1:
            told = ", ".join(f"{name} ({CELLS[dimension]})" for name, dimension in dimensions.items())
            raise InvalidArgumentError(f"values of cells of different dimensions: {told}")
        return next(iter(dimensions.values())), kinds

    # --- Reading ---

    def read(self, names: tuple[str, ...], on: CellKind | None, where: Where, skip_missing: bool) -> CellValues:
        """Map.read."""
        where.check()
        if not names or not all(isinstance(name, str) for name in names):
            raise InvalidArgumentError("names of attributes expected, or of what the map knows: " + ", ".join(INTRINSIC))
        ids = None if where.ids is None else to_ids(where.ids)
        dimension, kinds = self.dimension(names, on, ids)
        request = pb.ReadAttributesRequest(map=self._info.name, dimension=dimension, names=names)
        if ids is None:
            request.select.CopyFrom(where.to_proto(self._info.name, dimension))
            parts = self._ask(request, kinds)
        else:
            parts = []
            for first in range(0, len(ids), MAX_CELLS):
                request.select.ids.CopyFrom(_wire_ids(ids[first : first + MAX_CELLS]))
                parts += self._ask(request, kinds)
        result = self._together(CELLS[dimension], names, kinds, parts)
        if ids is not None and len(result) != len(ids):
            raise InternalError(f"an answer with {len(result)} cells, {len(ids)} were asked for")
        if ids is None:
            return result.rows(np.lexsort((result.ids.lo, result.ids.hi)))
        return self._without_missing(result, parts, skip_missing)

    def _ask(self, request: pb.ReadAttributesRequest, kinds: dict[str, str]) -> list[_Part]:
        """The parts of one answer. Any server answers: that of block 0 is asked."""
        address = self._info.address_of(0)
        stub = self._connection.block_server(address)
        timeout = self._connection.options.transfer_timeout

        def read() -> list[_Part]:
            return [_Part(part, request, kinds) for part in stub.ReadAttributes(request, timeout=timeout)]

        return self._connection.patient(lambda: self._connection.guarded(read, server_name(address)))

    def _together(self, on: str, names: tuple[str, ...], kinds: dict[str, str], parts: list[_Part]) -> CellValues:
        ids = np.concatenate([np.asarray(CellIds.of([])), *(np.asarray(part.ids) for part in parts)])
        columns = {name: Values.joined([part.columns[name] for part in parts], kinds[name]) for name in names}
        return CellValues(on, CellIds(ids), columns)

    def _without_missing(self, result: CellValues, parts: list[_Part], skip: bool) -> CellValues:
        there = np.concatenate([np.empty(0, np.bool_), *(part.there for part in parts)])
        if there.all():
            return result
        if not skip:
            missing = result.ids[~there]
            first = ", ".join(missing[:3].text())
            raise NotFoundError(
                f"map '{self._info.name}' has no {first}{', …' if len(missing) > 3 else ''}: "
                f"{len(missing)} of {len(result)} cells are not there (skip_missing leaves them out)"
            )
        return result.rows(there)

    # --- Writing ---

    def write(self, name: str, cells: CellsLike, values: Any) -> Written:
        """Map.write."""
        attribute, ids = self.attribute(name), to_ids(cells)
        column = Values.of(f"attribute {name}", attribute.type, values, len(ids))

        def messages() -> Iterator[pb.WriteAttributeRequest]:
            yield pb.WriteAttributeRequest(map=self._info.name, name=name)
            for first in range(0, len(ids), MAX_CELLS):
                part = slice(first, first + MAX_CELLS)
                yield pb.WriteAttributeRequest(ids=_wire_ids(ids[part]), values=column.rows(part).to_proto())

        return self._send(messages)

    def set(self, name: str, value: Any, where: Where) -> Written:
        """Map.set."""
        where.check()
        if where.ids is not None:
            return self.write(name, where.ids, value)
        attribute = self.attribute(name)
        column = Values.of(f"attribute {name}", attribute.type, value, 1)
        select = where.to_proto(self._info.name, attribute.dimension)
        message = pb.WriteAttributeRequest(map=self._info.name, name=name, select=select, values=column.to_proto())
        return self._send(lambda: iter([message]))

    def _send(self, messages: Any) -> Written:
        """A write, from its beginning as often as needed: writing the same once more changes nothing."""
        address = self._info.address_of(0)
        stub = self._connection.block_server(address)
        timeout = self._connection.options.transfer_timeout

        def send() -> Written:
            answer = self._connection.guarded(
                lambda: stub.WriteAttribute(messages(), timeout=timeout), server_name(address)
            )
            return Written(answer.written, answer.missing, tuple(answer.missing_ids))

        return self._connection.patient(send)


class _Part:
    """One message of an answer. InternalError where it contradicts itself."""

    def __init__(
        self, part: pb.ReadAttributesResponse, request: pb.ReadAttributesRequest, kinds: dict[str, str]
    ) -> None:
        if len(part.cell_hi) != len(part.cell_lo):
            raise InternalError(f"an answer with {len(part.cell_hi)} upper and {len(part.cell_lo)} lower words of ids")
        if len(part.columns) != len(request.names):
            raise InternalError(f"an answer with {len(part.columns)} columns, {len(request.names)} were asked for")
        self.ids = CellIds.from_words(part.cell_hi, part.cell_lo)
        self.columns = {
            name: Values.from_proto(column, kinds[name], len(self.ids))
            for name, column in zip(request.names, part.columns)
        }
        self.there = np.ones(len(self.ids), np.bool_)
        if any(place >= len(self.ids) for place in part.missing):
            raise InternalError(f"cell {max(part.missing)} of {len(self.ids)} is said to be missing")
        self.there[list(part.missing)] = False
