# SPDX-License-Identifier: Apache-2.0
"""What a cluster says of its servers and maps."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ndmap.attributes import Attribute
from ndmap.errors import NotFoundError
from ndmap.grid import Grid
from ndmap.ids import MAX_LEVEL
from ndmap.v1 import common_pb2, coordinator_pb2, mesh_pb2


def state_name(name: str) -> str:
    """"done", of "JOB_STATE_DONE"."""
    return name.split("_STATE_")[-1].lower()


@dataclass(frozen=True)
class Server:
    """A block server, as the coordinator knows it."""

    server_id: int
    address: str
    release: str
    threads: int
    alive: bool
    # Of all maps.
    blocks: int

    @classmethod
    def from_proto(cls, server: coordinator_pb2.Server) -> Server:
        """What the message says."""
        return cls(
            server_id=server.server_id,
            address=server.address,
            release=server.version.release,
            threads=server.capacity,
            alive=server.alive,
            blocks=server.blocks,
        )


@dataclass(frozen=True)
class ProcessStats:
    """What the operating system says of one process."""

    program: str
    address: str
    pid: int
    rss_bytes: int
    peak_rss_bytes: int
    user_seconds: float
    system_seconds: float

    @classmethod
    def from_proto(cls, stats: common_pb2.ProcessStats) -> ProcessStats:
        """What the message says."""
        return cls(
            program=stats.program,
            address=stats.address,
            pid=stats.pid,
            rss_bytes=stats.rss_bytes,
            peak_rss_bytes=stats.peak_rss_bytes,
            user_seconds=stats.user_seconds,
            system_seconds=stats.system_seconds,
        )


@dataclass(frozen=True)
class MeshSummary:
    """The mesh that a map was made from."""

    # Of the file.
    name: str
    tetrahedra: int
    pyramids: int
    prisms: int
    hexahedra: int
    points: int
    # The box of its points; None if whoever sent it did not say.
    box: tuple[tuple[float, ...], tuple[float, ...]] | None

    @property
    def cells(self) -> int:
        """Of all kinds."""
        return self.tetrahedra + self.pyramids + self.prisms + self.hexahedra

    @classmethod
    def from_proto(cls, mesh: mesh_pb2.MeshSummary) -> MeshSummary:
        """What the message says."""
        return cls(
            name=mesh.name,
            tetrahedra=mesh.tetrahedra,
            pyramids=mesh.pyramids,
            prisms=mesh.prisms,
            hexahedra=mesh.hexahedra,
            points=mesh.points,
            box=(tuple(mesh.lo), tuple(mesh.hi)) if len(mesh.lo) == len(mesh.hi) == 3 else None,
        )


@dataclass(frozen=True)
class MapInfo:
    """A map as it was when the coordinator was asked."""

    name: str
    # "creating", "ready", or "failed"; then `error` says why.
    state: str
    error: str
    block_count: int
    # "direct" or "broadcast".
    routing: str
    partition: str
    # None of a map that was made from a mesh.
    grid: Grid | None
    # Empty of a map without a surface.
    surface_id: str
    running_jobs: tuple[int, ...]
    # Of each block, the address of the server that holds it. Empty in lists of maps.
    addresses: dict[int, str] = field(repr=False)
    # Of its cells.
    attributes: tuple[Attribute, ...] = ()
    # None of a map that was made from a grid.
    mesh: MeshSummary | None = None

    @classmethod
    def from_proto(cls, info: coordinator_pb2.Map) -> MapInfo:
        """What the message says."""
        return cls(
            name=info.map,
            state=state_name(coordinator_pb2.MapState.Name(info.state)),
            error=info.error,
            block_count=info.block_count,
            routing="broadcast" if info.routing == common_pb2.ROUTING_BROADCAST else "direct",
            partition=info.partition,
            grid=Grid.from_proto(info.grid),
            surface_id=info.surface_id,
            running_jobs=tuple(info.running_jobs),
            addresses={placement.block: placement.address for placement in info.blocks},
            attributes=tuple(Attribute.from_proto(attribute) for attribute in info.attributes),
            mesh=MeshSummary.from_proto(info.mesh) if info.HasField("mesh") else None,
        )

    def address_of(self, block: int) -> str:
        """NotFoundError that names the block and how many there are."""
        if block not in self.addresses:
            raise NotFoundError(f"map '{self.name}' has no block {block}, it has {self.block_count} blocks")
        return self.addresses[block]

    def extent(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """Low and high corner of the initial cells, and a size that none of any level is below; None if not known."""
        if self.grid is not None:
            lo, hi, along = np.array(self.grid.lo), np.array(self.grid.hi), np.array(self.grid.cells)
        elif self.mesh is not None and self.mesh.box is not None:
            lo, hi = np.array(self.mesh.box[0]), np.array(self.mesh.box[1])
            along = np.full(3, float(self.mesh.cells))
        else:
            return None
        return lo, hi, (hi - lo) / along / 2**MAX_LEVEL

    def servers(self) -> list[str]:
        """The addresses of the servers that hold a block, each once."""
        return sorted(set(self.addresses.values()))
