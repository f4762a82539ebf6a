# SPDX-License-Identifier: Apache-2.0
"""Attributes: named, typed columns of values on the cells of one dimension, and how their values travel."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Union

import numpy as np

from ndmap.anchors import to_dimension
from ndmap.connection import Connection
from ndmap.errors import InternalError, InvalidArgumentError
from ndmap.v1 import attributes_pb2 as pb
from ndmap.v1 import coordinator_pb2

# By dimension.
CELLS = ("vertices", "edges", "faces", "hexahedra")
TYPES = {
    "double": pb.VALUE_TYPE_DOUBLE,
    "int64": pb.VALUE_TYPE_INT64,
    "vec3": pb.VALUE_TYPE_VEC3,
    "category": pb.VALUE_TYPE_CATEGORY,
}
SPLITS = {
    "copy": pb.SPLIT_RULE_COPY,
    "mean": pb.SPLIT_RULE_MEAN,
    "midpoint": pb.SPLIT_RULE_MIDPOINT,
    "zero": pb.SPLIT_RULE_ZERO,
    "divide": pb.SPLIT_RULE_DIVIDE,
}
# What the map itself knows of its cells, and the types of these values.
INTRINSIC = {"@point": "vec3", "@level": "int64", "@block": "int64", "@volume": "double", "@state": "category"}
# Of hexahedra alone.
OF_HEXAHEDRA = ("@volume", "@state")
MAX_CATEGORY_BYTES = 64

# A dimension, or what its cells are called: "vertices", "edges", "faces", "hexahedra".
CellKind = Union[int, str]


def dimension_of(on: CellKind) -> int:
    """0 ... 3; InvalidArgumentError otherwise."""
    if isinstance(on, str):
        if on not in CELLS:
            raise InvalidArgumentError(f"on={on!r} is none of {', '.join(CELLS)}")
        return CELLS.index(on)
    return to_dimension(on)


def _name_of(table: dict[str, Any], number: int) -> str:
    """A value of the wire's that this client does not know has its number for a name."""
    return next((name for name, value in table.items() if value == number), str(number))


@dataclass(frozen=True)
class Attribute:
    """What an attribute is."""

    name: str
    # "vertices", "edges", "faces" or "hexahedra".
    on: str
    # "double", "int64", "vec3" or "category".
    type: str
    # What new cells get: "copy", "mean", "midpoint", "zero" or "divide".
    split: str
    # What every cell has until something is written: a number, three of them, or a text.
    fill: Any
    # Names may be used again, numbers never are.
    number: int

    @classmethod
    def from_proto(cls, attribute: pb.Attribute) -> Attribute:
        """What the message says."""
        kind = _name_of(TYPES, attribute.type)
        fill: Any = {"vec3": (0.0, 0.0, 0.0), "category": "", "int64": 0}.get(kind, 0.0)
        if kind in TYPES and attribute.HasField("fill"):
            fill = Values.from_proto(attribute.fill, kind, 1).array().tolist()[0]
            fill = tuple(fill) if kind == "vec3" else fill
        return cls(
            name=attribute.name,
            on=CELLS[attribute.dimension] if attribute.dimension < len(CELLS) else str(attribute.dimension),
            type=kind,
            split=_name_of(SPLITS, attribute.split or pb.SPLIT_RULE_COPY),
            fill=fill,
            number=attribute.number,
        )

    @property
    def dimension(self) -> int:
        """0 of vertices ... 3 of hexahedra."""
        return dimension_of(self.on)


@dataclass(frozen=True, eq=False)
class Values:
    """One column: for categories codes, places in `categories`; else the values themselves, n or n x 3."""

    data: np.ndarray
    # None of numbers.
    categories: tuple[str, ...] | None = None

    def __len__(self) -> int:
        return len(self.data)

    def array(self) -> np.ndarray:
        """The values: doubles or integers; of categories texts, an array of objects."""
        if self.categories is None:
            return self.data
        return np.array([*self.categories, None], object)[self.data]

    def rows(self, which: Any) -> Values:
        """Some of them, by slice, index array or mask."""
        return Values(self.data[which], self.categories)

    @classmethod
    def of(cls, what: str, kind: str, given: Any, count: int) -> Values:
        """Of what a caller gives for `count` cells: a value each, or one for all. InvalidArgumentError begins with
        `what`."""
        if kind == "category":
            return _categories(what, given, count)
        shape = (count, 3) if kind == "vec3" else (count,)
        try:
            array = np.asarray(given)
        except ValueError as error:  # Rows of different lengths.
            raise InvalidArgumentError(f"{what}: {error}") from None
        if array.dtype.kind not in ("iub" if kind == "int64" else "fiub"):
            wanted = "whole numbers" if kind == "int64" else "numbers"
            raise InvalidArgumentError(f"{what}: values of type {array.dtype}, {wanted} expected")
        if array.shape not in (shape, shape[1:]):
            raise InvalidArgumentError(f"{what}: values of the shape {array.shape}, {shape} or {shape[1:]} expected")
        if array.dtype.kind == "u" and kind == "int64" and array.size and int(array.max()) >= 1 << 63:
            raise InvalidArgumentError(f"{what}: {array.max()}, whole numbers below 2^63 expected")
        return cls(np.broadcast_to(array.astype(np.int64 if kind == "int64" else np.float64), shape))

    def to_proto(self) -> pb.Values:
        """The message; of categories with those that are used."""
        if self.categories is not None:
            used, codes = np.unique(self.data, return_inverse=True)
            return pb.Values(codes=codes.tolist(), categories=[self.categories[code] for code in used])
        flat = np.ravel(self.data).tolist()
        return pb.Values(integers=flat) if self.data.dtype.kind == "i" else pb.Values(doubles=flat)

    @classmethod
    def from_proto(cls, values: pb.Values, kind: str, count: int) -> Values:
        """What the message says of `count` cells. InternalError if it says something else."""
        categories: tuple[str, ...] | None = None
        if kind == "category":
            data, categories = np.array(values.codes, np.int64), tuple(values.categories)
            if len(data) and data.max() >= len(categories):
                raise InternalError(f"a column names category {data.max()}, it came with {len(categories)}")
        elif kind == "int64":
            data = np.array(values.integers, np.int64)
        else:
            data = np.array(values.doubles, np.float64)
        width = 3 if kind == "vec3" else 1
        if len(data) != count * width:
            raise InternalError(f"a column of type {kind} came with {len(data)} numbers for {count} cells")
        return cls(data.reshape(count, 3) if width == 3 else data, categories)

    @classmethod
    def joined(cls, parts: list[Values], kind: str) -> Values:
        """One column of several."""
        if not parts:
            empty = np.empty((0, 3) if kind == "vec3" else 0, np.int64 if kind in ("int64", "category") else np.float64)
            return cls(empty, () if kind == "category" else None)
        if kind != "category":
            return cls(np.concatenate([part.data for part in parts]))
        places: dict[str, int] = {}
        columns = []
        for part in parts:
            here = [places.setdefault(text, len(places)) for text in part.categories or ()]
            columns.append(np.array([*here, 0], np.int64)[part.data])
        return cls(np.concatenate(columns), tuple(places))


def _categories(what: str, given: Any, count: int) -> Values:
    texts = [given] * min(count, 1) if isinstance(given, str) else list(np.ravel(np.asarray(given, object)))
    wrong = next((text for text in texts if not isinstance(text, str)), None)
    if wrong is not None:
        raise InvalidArgumentError(f"{what}: {wrong!r}, a text expected")
    if not isinstance(given, str) and len(texts) != count:
        raise InvalidArgumentError(f"{what}: {len(texts)} texts, {count} or one expected")
    places: dict[str, int] = {}
    codes = [places.setdefault(str(text), len(places)) for text in texts]
    for text in places:
        try:
            size = len(text.encode())
        except UnicodeEncodeError:
            raise InvalidArgumentError(f"{what}: {text!r} cannot be written as UTF-8") from None
        if size > MAX_CATEGORY_BYTES:
            raise InvalidArgumentError(
                f"{what}: a category of {size} bytes, at most {MAX_CATEGORY_BYTES} expected: {text[:80]!r}"
            )
    return Values(np.resize(np.array(codes, np.int64), count), tuple(places))


def definition(name: str, on: CellKind, kind: str, split: str, fill: Any) -> pb.Attribute:
    """Of what a caller says; InvalidArgumentError for what no map could mean. The service checks the rest."""
    if kind not in TYPES:
        raise InvalidArgumentError(f"type {kind!r} is none of {', '.join(TYPES)}")
    if split not in SPLITS:
        raise InvalidArgumentError(f"split {split!r} is none of {', '.join(SPLITS)}")
    made = pb.Attribute(name=name, dimension=dimension_of(on), type=TYPES[kind], split=SPLITS[split])
    if fill is not None:
        made.fill.CopyFrom(Values.of(f"fill of attribute {name}", kind, fill, 1).to_proto())
    return made


def fetch_attributes(connection: Connection, map_name: str) -> dict[str, Attribute]:
    """Those that are there now, by name."""
    request = coordinator_pb2.GetMapRequest(map=map_name)
    answer = connection.idempotent(connection.coordinator.GetMap, request)
    return {attribute.name: Attribute.from_proto(attribute) for attribute in answer.map.attributes}
