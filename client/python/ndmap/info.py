# SPDX-License-Identifier: Apache-2.0
"""What a cluster says of its servers and maps."""
from __future__ import annotations

from dataclasses import dataclass, field

from ndmap.attributes import Attribute
from ndmap.errors import NotFoundError
from ndmap.grid import Grid
from ndmap.v1 import common_pb2, coordinator_pb2


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
    grid: Grid | None
    # Empty of a map without a surface.
    surface_id: str
    running_jobs: tuple[int, ...]
    # Of each block, the address of the server that holds it. Empty in lists of maps.
    addresses: dict[int, str] = field(repr=False)
    # Of its cells.
    attributes: tuple[Attribute, ...] = ()

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
        )

    def address_of(self, block: int) -> str:
        """NotFoundError that names the block and how many there are."""
        if block not in self.addresses:
            raise NotFoundError(f"map '{self.name}' has no block {block}, it has {self.block_count} blocks")
        return self.addresses[block]

    def servers(self) -> list[str]:
        """The addresses of the servers that hold a block, each once."""
        return sorted(set(self.addresses.values()))
