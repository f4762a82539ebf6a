# SPDX-License-Identifier: Apache-2.0
"""What the blocks of a map hold, asked of their servers."""
from __future__ import annotations

import numpy as np

from ndmap.connection import Connection, server_name
from ndmap.info import MapInfo
from ndmap.v1 import block_service_pb2

_COLUMNS = ("block", "darts", "vertices", "hexahedra", "critical_darts", "accounted_bytes", "version")


def block_stats(connection: Connection, info: MapInfo) -> np.ndarray:
    """Map.block_stats. Asks each server once."""
    rows: list[tuple[int, ...]] = []
    request = block_service_pb2.GetBlockStatsRequest(map=info.name)
    for address in info.servers():
        stub = connection.block_server(address)
        answer = connection.idempotent(stub.GetBlockStats, request, server_name(address))
        rows += [tuple(getattr(block, column) for column in _COLUMNS) for block in answer.blocks]
    return np.array(sorted(rows), dtype=[(column, np.uint64) for column in _COLUMNS])
