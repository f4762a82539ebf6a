# SPDX-License-Identifier: Apache-2.0
"""Counts, sums, extremes, histograms and integrals that the blocks compute and the cluster adds up."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Sequence

import numpy as np

from ndmap.attributes import CellKind
from ndmap.connection import Connection, server_name
from ndmap.errors import InvalidArgumentError
from ndmap.info import MapInfo
from ndmap.v1 import attributes_pb2 as pb
from ndmap.values import Columns, set_levels

MAX_BINS = 65536

_GROUPS = {
    None: pb.GROUP_BY_NOTHING,
    "level": pb.GROUP_BY_LEVEL,
    "block": pb.GROUP_BY_BLOCK,
    "category": pb.GROUP_BY_CATEGORY,
}


@dataclass(frozen=True, eq=False)
class Aggregate:
    """What is known of the values of some cells. Of a vec3 each is an array of three, by component. None where there is
    no finite value, or where it was not asked for."""

    # How many cells.
    count: int
    # How many of their values are infinite or no number: they are in nothing below.
    not_finite: Any
    # Exact, rounded once: the same bits whatever the blocks. Of int64 a whole number, unless it is beyond 64 bits.
    sum: Any
    min: Any
    max: Any
    # Over the volume of the hexahedra, and that volume.
    integral: Any
    volume: float | None
    # Values by bin (of a vec3 a row a component), between the edges, below them and above.
    histogram: np.ndarray | None
    edges: np.ndarray | None
    below: Any
    above: Any

    @property
    def mean(self) -> Any:
        """The sum, divided by the number of finite values; None without any."""
        return None if self.sum is None else self.sum / (self.count - self.not_finite)


def _number(values: Sequence[float]) -> Any:
    """None, one, or an array of three."""
    if len(values) == 0:
        return None
    return values[0] if len(values) == 1 else np.array(values)


def _aggregate(group: pb.Aggregate, request: pb.AggregateRequest) -> Aggregate:
    histogram, edges = None, None
    if request.bins:
        edges = np.linspace(request.histogram_lo, request.histogram_hi, request.bins + 1)
        histogram = np.zeros(request.bins, np.int64)
        if len(group.histogram):
            histogram = np.array(group.histogram, np.int64)
        if len(histogram) > request.bins:
            histogram = histogram.reshape(-1, request.bins)
    return Aggregate(
        count=group.count,
        not_finite=_number(group.not_finite),
        sum=group.integer_sum if group.HasField("integer_sum") else _number(group.sum),
        min=_number(group.min),
        max=_number(group.max),
        integral=_number(group.integral),
        volume=group.volume if request.integral else None,
        histogram=histogram,
        edges=edges,
        below=_number(group.below) if request.bins else None,
        above=_number(group.above) if request.bins else None,
    )


def _set_histogram(request: pb.AggregateRequest, histogram: Any) -> None:
    if histogram is None:
        return
    try:
        bins, lo, hi = histogram
        request.histogram_lo, request.histogram_hi = lo, hi
        valid = isinstance(bins, (int, np.integer)) and 1 <= bins <= MAX_BINS and -math.inf < lo < hi < math.inf
    except (TypeError, ValueError):
        valid = False
    if not valid:
        raise InvalidArgumentError(
            f"histogram={str(histogram)[:200]}: (bins, lo, hi) expected, 1 ... {MAX_BINS} bins from lo to a higher hi"
        )
    request.bins = int(bins)


def _group_by(by: Any) -> tuple[Any, str]:
    """What `by` means, and the category that it names."""
    kind, _, category = by.partition(":") if isinstance(by, str) else (by, "", "")
    if not isinstance(kind, (str, type(None))) or kind not in _GROUPS or bool(category) != (kind == "category"):
        raise InvalidArgumentError(f"by={by!r}: 'level', 'block' or 'category:NAME' expected")
    return _GROUPS[kind], category


def aggregate(
    connection: Connection,
    info: MapInfo,
    name: str | None,
    on: CellKind | None,
    by: str | None,
    histogram: Any,
    integral: bool,
    levels: Any,
) -> Aggregate | dict[Any, Aggregate]:
    """Map.aggregate. One call, of the server of block 0."""
    group, category = _group_by(by)
    names = [each for each in (name, category) if each]
    dimension, _ = Columns(connection, info).dimension(names, on, None)
    request = pb.AggregateRequest(
        map=info.name,
        dimension=dimension,
        name=name or "",
        group_by=group,
        category=category,
        integral=integral,
    )
    _set_histogram(request, histogram)
    set_levels(request, levels)
    address = info.address_of(0)
    stub = connection.block_server(address)
    timeout = connection.options.transfer_timeout
    answer = connection.patient(lambda: connection.once(stub.Aggregate, request, server_name(address), timeout))
    if by is None:
        return _aggregate(answer.groups[0] if answer.groups else pb.Aggregate(), request)
    return {each.group if category else int(each.group): _aggregate(each, request) for each in answer.groups}
