# SPDX-License-Identifier: Apache-2.0
"""A cluster, seen through its coordinator."""
from __future__ import annotations

import os
from types import TracebackType
from typing import Callable, Sequence

from ndmap.connection import Connection
from ndmap.errors import FailedPreconditionError, InvalidArgumentError
from ndmap.grid import DEFAULT_PADDING, Grid
from ndmap.info import MapInfo, ProcessStats, Server
from ndmap.job import Job, JobResult, ProgressCallback
from ndmap.map import Map, fetch_info
from ndmap.mesh_file import create_from_file
from ndmap.options import ClientOptions
from ndmap.surface import Surface, SurfaceLike, as_surface, upload
from ndmap.v1 import common_pb2, coordinator_pb2

ROUTINGS = {"direct": common_pb2.ROUTING_DIRECT, "broadcast": common_pb2.ROUTING_BROADCAST}


def connect(target: str, options: ClientOptions = ClientOptions()) -> Client:
    """Connects to the coordinator at HOST:PORT and exchanges versions.

    UnavailableError or DeadlineExceededError, within options.connect_timeout, if nobody is there;
    FailedPreconditionError that names both protocols if they differ.
    """
    return Client(target, options)


def make_grid(
    surface: Surface | None, grid: Grid | str | Sequence[int] | None, cubes: int | None, padding: float
) -> Grid:
    """The initial grid as `ndmap create` computes it of the same options."""
    if grid is not None and cubes is not None:
        raise InvalidArgumentError("grid and cubes exclude each other")
    if isinstance(grid, Grid):
        return grid
    if surface is None:
        raise InvalidArgumentError("without a surface the grid must be a Grid(cells, lo, hi)")
    lo, hi = surface.box
    if cubes is not None:
        return Grid.from_cubes(lo, hi, cubes)
    if grid is not None:
        return Grid.from_counts(lo, hi, grid, padding)
    return Grid.auto(lo, hi, padding=padding)


class Client:
    """A cluster. Also a context manager, which closes it. Made by connect()."""

    def __init__(self, target: str, options: ClientOptions = ClientOptions()) -> None:
        self._connection = Connection(target, options)
        try:
            self._version = self._connection.exchange_versions(
                self._connection.coordinator, self._connection.coordinator_name
            )
        except Exception:
            self._connection.close()
            raise

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"Client({self.target!r})"

    def close(self) -> None:
        """Ends all that is under way here; jobs of the cluster go on. Closing twice is no error."""
        self._connection.close()

    @property
    def target(self) -> str:
        """HOST:PORT."""
        return self._connection.target

    @property
    def release(self) -> str:
        """The coordinator's release, "0.1.0"."""
        return self._version.release

    # --- The cluster ---

    def servers(self) -> list[Server]:
        """The block servers."""
        request = coordinator_pb2.ListServersRequest()
        answer = self._connection.idempotent(self._connection.coordinator.ListServers, request)
        return [Server.from_proto(server) for server in answer.servers]

    def coordinator_stats(self) -> ProcessStats:
        """What the operating system says of the coordinator."""
        request = common_pb2.GetProcessStatsRequest()
        answer = self._connection.idempotent(self._connection.coordinator.GetProcessStats, request)
        return ProcessStats.from_proto(answer.stats)

    # --- Surfaces ---

    def upload_surface(self, surface: SurfaceLike, progress: Callable[[int, int], None] | None = None) -> str:
        """Sends a surface; returns its id. Sending one that is there already is no error. `progress` is told how many
        bytes of how many have gone, from another thread. InvalidArgumentError if it is not closed."""
        return upload(self._connection, as_surface(surface), progress)

    def delete_surface(self, surface_id: str) -> None:
        """FailedPreconditionError while a map uses it."""
        request = coordinator_pb2.DeleteSurfaceRequest(surface_id=surface_id)
        self._connection.once(self._connection.coordinator.DeleteSurface, request)

    # --- Maps ---

    def maps(self) -> list[MapInfo]:
        """The maps of the cluster, without where their blocks are."""
        answer = self._connection.idempotent(
            self._connection.coordinator.ListMaps, coordinator_pb2.ListMapsRequest()
        )
        return [MapInfo.from_proto(info) for info in answer.maps]

    def open_map(self, name: str) -> Map:
        """A map that is there. NotFoundError names it otherwise."""
        return Map(self._connection, fetch_info(self._connection, name))

    def create_map(
        self,
        name: str,
        surface: SurfaceLike | None,
        *,
        grid: Grid | str | Sequence[int] | None = None,
        cubes: int | None = None,
        padding: float = DEFAULT_PADDING,
        blocks: int = 4,
        routing: str = "direct",
        partition: str = "hilbert",
        depth: int = 4,
        progress: ProgressCallback | None = None,
    ) -> Map:
        """Sends the surface, makes the map's initial hexahedra, and returns when they are there.

        The surface is a Surface, (points, triangles) as arrays, a file's name, or None (then `grid` is a Grid). The
        grid is one over the bounding box, enlarged by `padding`, with the cells "12x12x4" or (12, 12, 4); or `cubes`
        along the longest side; or, with neither, about 1,000 near-cubic cells. `depth` is the one that refinement will
        go to: it only balances the blocks. Partitions: hilbert, morton, slabs, metis, lpt.
        """
        if routing not in ROUTINGS:
            raise InvalidArgumentError(f"routing '{routing}' is none of {', '.join(ROUTINGS)}")
        given = None if surface is None else as_surface(surface)
        shape = make_grid(given, grid, cubes, padding)
        if not isinstance(blocks, int) or not 1 <= blocks <= shape.cell_count:
            raise InvalidArgumentError(
                f"blocks {blocks!r}: 1 ... {shape.cell_count} expected, a block needs at least one hexahedron"
            )
        if not isinstance(depth, int) or not 0 <= depth <= 29:
            raise InvalidArgumentError(f"depth {depth!r}: 0 ... 29 expected (ids of cells hold 29 levels)")
        request = coordinator_pb2.CreateMapRequest(
            map=name,
            surface_id="" if given is None else upload(self._connection, given),
            grid=shape.to_proto(),
            block_count=blocks,
            routing=ROUTINGS[routing],
            partition=partition,
            depth=depth,
        )
        # The coordinator partitions the grid and hands the surface to the servers before it answers.
        timeout = self._connection.options.transfer_timeout
        answer = self._connection.once(self._connection.coordinator.CreateMap, request, timeout=timeout)
        Job(self._connection, answer.job.job, progress).result()
        return self.open_map(name)

    def create_map_from_mesh(
        self,
        name: str,
        mesh: str | os.PathLike[str],
        *,
        surface: str | os.PathLike[str] | None = None,
        blocks: int = 4,
        routing: str = "direct",
        partition: str = "hilbert",
        merge_points: bool = False,
        allow_concave: bool = False,
        program: str = "ndmap",
    ) -> Map:
        """Makes a map whose initial cells are those of a volume mesh (VTU, Gmsh 2 or 4.1, Medit, MFEM), and returns when
        they are there. The file is read, checked, glued and cut by the program `ndmap`, found on the PATH or named by
        `program`: MissingPackageError without it, InvalidArgumentError with its sentence when it refuses.

        Partitions: hilbert, morton, metis. `surface` is a closed surface's file, for the oracle "surface" and for trim.
        `merge_points` makes points of equal coordinates one; `allow_concave` takes cells with a corner turned inside out.
        """
        if routing not in ROUTINGS:
            raise InvalidArgumentError(f"routing '{routing}' is none of {', '.join(ROUTINGS)}")
        options = [f"--blocks={blocks}", f"--routing={routing}", f"--partition={partition}"]
        if surface is not None:
            options.append(f"--surface={os.fspath(surface)}")
        options += ["--merge-points"] * merge_points + ["--allow-concave"] * allow_concave
        timeout = self._connection.options.transfer_timeout
        create_from_file(program, self._connection.target, name, mesh, options, timeout)
        return self.open_map(name)

    def delete_map(self, name: str) -> None:
        """Deletes a map, and its surface if no other map uses it."""
        surface_id = self.open_map(name).info.surface_id
        request = coordinator_pb2.DeleteMapRequest(map=name)
        self._connection.once(self._connection.coordinator.DeleteMap, request)
        if surface_id:
            try:
                self.delete_surface(surface_id)
            except FailedPreconditionError:
                pass  # Another map uses it.

    # --- Jobs ---

    def jobs(self, map_name: str = "") -> list[JobResult]:
        """The jobs of one map, or of all maps."""
        request = coordinator_pb2.ListJobsRequest(map=map_name)
        answer = self._connection.idempotent(self._connection.coordinator.ListJobs, request)
        return [JobResult.from_proto(job) for job in answer.jobs]

    def job(self, number: int, progress: ProgressCallback | None = None) -> Job:
        """A job by its number. Asks nobody unless there is a `progress`."""
        if not isinstance(number, int) or not 1 <= number < 1 << 63:
            raise InvalidArgumentError(f"job {number!r}: a number of 1 or more expected")
        return Job(self._connection, number, progress)
