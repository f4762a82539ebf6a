# SPDX-License-Identifier: Apache-2.0
"""A map of a cluster: its jobs, its numbers, its pieces, walks on its darts, questions about its cells, and values on
them."""
from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Iterable, Sequence

import numpy as np

from ndmap import columns, export, mesh, walk
from ndmap.anchors import Anchors, Closures, PointLike
from ndmap.columns import ManyDarts, WalkedColumns
from ndmap.connection import Connection, server_name
from ndmap.darts import Dart, DartInfo, Darts, DartsLike, Walks, Word
from ndmap.errors import InvalidArgumentError
from ndmap.ids import CellIdLike, CellIds
from ndmap.info import MapInfo, ProcessStats
from ndmap.job import Job, PhaseResult, ProgressCallback, phase
from ndmap.map_attributes import MapAttributes
from ndmap.navigate import CellDetails, Navigator
from ndmap.stats import block_stats
from ndmap.v1 import common_pb2, coordinator_pb2

if TYPE_CHECKING:
    import meshio
    import vtkmodules.vtkCommonDataModel as vtk

MAX_DEPTH = 29
_KEEPS = ("inside", "cut", "inside,cut", "all")
_ORACLES: dict[str, tuple[str, ...]] = {
    "surface": (),
    "everything": (),
    "box": ("lo", "hi"),
    "sphere": ("centre", "radius"),
    "size": ("size",),
    "list": ("cells",),
}


@dataclass(frozen=True)
class Stats:
    """What a map holds."""

    # "hexahedra", "darts", "vertices", "critical_darts", "cut", "inside", "outside", "unclassified", ...: of the whole
    # map, where a vertex on a cut counts once.
    counts: dict[str, int]
    # Hexahedra by level.
    levels: dict[int, int]
    # A row a block, with the fields of Map.block_stats().
    blocks: np.ndarray


@dataclass(frozen=True)
class CheckResult:
    """What the checker found."""

    valid: bool
    # Sentences about faults, at most 20 of them.
    findings: tuple[str, ...]
    # How many there are.
    faults: int
    counts: dict[str, int]


def _number(value: object) -> str:
    number = float(value)  # type: ignore[arg-type]
    if not math.isfinite(number):
        raise ValueError
    return f"{number:.17g}"


def _parameter(oracle: str, name: str, value: Any) -> str:
    try:
        if name == "cells":
            return value if isinstance(value, str) else " ".join(value)
        if name in ("radius", "size"):
            text = _number(value)
            if float(value) <= 0:
                raise ValueError
            return text
        x, y, z = value
        return ",".join(map(_number, (x, y, z)))
    except (TypeError, ValueError):
        wanted = {"cells": "ids such as 'h12/0.3'", "radius": "a number above 0", "size": "a number above 0"}
        expected = wanted.get(name, "a point (x, y, z)")
        raise InvalidArgumentError(f"oracle {oracle}: {name}={value!r}, {expected} expected") from None


def _oracle_parameters(oracle: str, given: dict[str, Any]) -> dict[str, str]:
    if oracle not in _ORACLES:
        raise InvalidArgumentError(f"oracle '{oracle}' is none of {', '.join(_ORACLES)}")
    wanted = _ORACLES[oracle]
    for name, value in given.items():
        if name in wanted and value is None:
            raise InvalidArgumentError(f"oracle {oracle} needs {name}")
        if name not in wanted and value is not None:
            raise InvalidArgumentError(f"{name} is not for oracle {oracle}")
    return {"oracle": oracle, **{name: _parameter(oracle, name, given[name]) for name in wanted}}


class Map(MapAttributes):
    """A map, with the routing table as it was when it was opened."""

    def __init__(self, connection: Connection, info: MapInfo) -> None:
        self._connection = connection
        self._info = info

    def __repr__(self) -> str:
        mesh = self._info.mesh
        made_from = f"grid {self._info.grid}" if mesh is None else f"mesh {mesh.name!r} of {mesh.cells} cells"
        return f"Map({self.name!r}: {made_from}, {self._info.block_count} blocks)"

    @property
    def name(self) -> str:
        """The map's name."""
        return self._info.name

    @property
    def info(self) -> MapInfo:
        """State, grid, and which block is where, as they were when the map was opened or refreshed."""
        return self._info

    def refresh(self) -> MapInfo:
        """Asks the coordinator anew."""
        self._info = fetch_info(self._connection, self.name)
        return self._info

    # --- Jobs ---

    def start_job(
        self, kind: str, phases: Sequence[coordinator_pb2.Phase], progress: ProgressCallback | None = None
    ) -> Job:
        """Starts long work: phases one after the other. FailedPreconditionError names the job that is in the way."""
        request = coordinator_pb2.StartJobRequest(map=self.name, kind=kind, phases=phases)
        job = self._connection.once(self._connection.coordinator.StartJob, request).job
        return Job(self._connection, job.job, progress)

    def refine(
        self,
        depth: int = 4,
        oracle: str = "surface",
        *,
        lo: Sequence[float] | None = None,
        hi: Sequence[float] | None = None,
        centre: Sequence[float] | None = None,
        radius: float | None = None,
        size: float | None = None,
        cells: str | Iterable[str] | None = None,
        by_level: bool = True,
        memory_limit: int = 0,
        progress: ProgressCallback | None = None,
    ) -> Job:
        """Splits hexahedra in eight where an oracle says so, down to level `depth`.

        Oracles: "surface" (hexahedra that meet it), "everything", "box" (lo, hi), "sphere" (centre, radius), "size"
        (with a longer edge), "list" (cells: ids, "h12 h12/0.3"). A phase a level, or all levels in one phase without
        `by_level`: the same mesh. A block begins no refinement of its own above `memory_limit` bytes (0: no limit).
        New hexahedra are classified by the surface, where the map has one, in a last phase.
        """
        if not isinstance(depth, int) or not 1 <= depth <= MAX_DEPTH:
            raise InvalidArgumentError(f"depth {depth!r}: 1 ... {MAX_DEPTH} expected (ids of cells hold {MAX_DEPTH} levels)")
        given = {"lo": lo, "hi": hi, "centre": centre, "radius": radius, "size": size, "cells": cells}
        parameters: dict[str, object] = {**_oracle_parameters(oracle, given), "depth": depth}
        if memory_limit:
            parameters["memory_limit"] = memory_limit
        if by_level:
            phases = [phase("refine", **parameters, level=level) for level in range(depth)]
        else:
            phases = [phase("refine", **parameters)]
        if self.info.surface_id:
            phases.append(phase("classify"))
        return self.start_job("refine", phases, progress)

    def trim(self, keep: str = "inside,cut", progress: ProgressCallback | None = None) -> Job:
        """Erases hexahedra: those stay that are "inside", "cut", both ("inside,cut") or "all"."""
        if keep not in _KEEPS:
            raise InvalidArgumentError(f"keep '{keep}' is none of {'; '.join(_KEEPS)}")
        return self.start_job("trim", [phase("classify"), phase("trim", keep=keep)], progress)

    def _only_phase(self, algorithm: str) -> PhaseResult:
        return self.start_job(algorithm, [phase(algorithm)]).result().phases[0]

    def check(self) -> CheckResult:
        """Checks every property of the distributed map; waits for the job that does it."""
        report = self._only_phase("check")
        faults = report.counts.get("findings", 0)
        return CheckResult(valid=faults == 0, findings=report.findings, faults=faults, counts=report.counts)

    def hash(self) -> str:
        """The canonical hash, 32 digits: equal for equal global maps, however they are cut. Waits for its job."""
        return self._only_phase("hash").digest

    def stats(self) -> Stats:
        """Counts of the whole map, by level and by block; waits for the job that counts."""
        counts = self._only_phase("count").counts
        levels = {level: counts.get(f"level_{level}", 0) for level in range(MAX_DEPTH + 1)}
        return Stats(counts, {level: n for level, n in levels.items() if n}, self.block_stats())

    # --- Questions, answered also while a job works ---

    def block_stats(self) -> np.ndarray:
        """What every block holds: a structured array, a row a block, with the fields block, darts, vertices,
        hexahedra, critical_darts, accounted_bytes, version. Asks each server once."""
        return block_stats(self._connection, self._info)

    def server_stats(self) -> list[ProcessStats]:
        """What the operating system says of each server that holds a block, by address."""
        request = common_pb2.GetProcessStatsRequest()
        result = []
        for address in self._info.servers():
            stub = self._connection.block_server(address)
            answer = self._connection.idempotent(stub.GetProcessStats, request, server_name(address))
            result.append(ProcessStats.from_proto(answer.stats))
        return result

    def any_dart(self, block: int) -> DartInfo:
        """Some dart of a block, for a walk to begin somewhere. NotFoundError if the block is empty."""
        return walk.any_dart(self._connection, self._info, block)

    def beta(self, darts: DartsLike, word: Word) -> Walks:
        """Applies a word of betas ("1,2,3", "123" or [1, 2, 3], from the first to the last) to each dart, by
        Proposition 1: where a letter leads to another block, the walk goes on at the dart with the same label there,
        wherever that block is. The empty word tells what is at the darts. One row for each dart, in order.

        Fails as a whole: NotFoundError for a dart that is not there, StaleDartError for one whose block has changed,
        InvalidArgumentError for another letter. For more than some thousand darts there is walk().
        """
        return walk.beta(self._connection, self._info, darts, word)

    def walk(self, darts: ManyDarts, word: Word) -> WalkedColumns:
        """The same for many darts, as fast as can be: tells in columns where the walks end, and nothing of what is
        there. One call for as many darts of one server as it takes, followed through the cluster by the servers. All of
        it is of one version of each block; AbortedError while a job changes the map again and again."""
        return columns.walk(self._connection, self._info, darts, word)

    # --- Cells and neighbourhoods, wherever they live ---

    def _navigator(self) -> Navigator:
        return Navigator(self._connection, self._info)

    def cell(self, cell: CellIdLike) -> CellDetails:
        """What is known of a cell, by its id ("h12/0.3.7", "v12:5", or a CellId). NotFoundError if the map has no such
        cell now."""
        return self._navigator().cell(cell)

    def cells(self, dimension: int, *, max_darts: int = 0) -> CellIds:
        """The ids of all cells of a dimension, ascending. Asks block by block; where a block is over the limit of darts
        for one question (the servers', or max_darts), in boxes that are halved as long as needed. AbortedError while a
        job keeps changing the map."""
        return self._navigator().cells(dimension, max_darts)

    def locate(self, points: Any) -> list[CellIds]:
        """For each of n x 3 points the hexahedra that contain it: several on a boundary between them, none outside the
        mesh. A question a point."""
        return self._navigator().locate(points)

    def box(self, lo: PointLike, hi: PointLike, *, max_darts: int = 0) -> CellIds:
        """The hexahedra that the closed box from lo to hi meets, in halves of the box where they are over a limit."""
        return self._navigator().box(lo, hi, max_darts)

    def nearest_vertex(self, point: PointLike) -> CellDetails:
        """The vertex nearest to a point, of those equally near the one with the lowest id. NotFoundError if the map is
        empty."""
        return self._navigator().nearest_vertex(point)

    def incident(self, cell: CellIdLike, dimension: int) -> CellIds:
        """The cells of a dimension that a cell has in its boundary, or that have it in theirs."""
        return self._navigator().incident(cell, dimension)

    def neighbors(self, cell: CellIdLike, through: int | None = None) -> CellIds:
        """The other cells of the cell's dimension that share a cell of dimension `through` with it: unless given, one
        dimension below (hexahedra across faces, faces across edges, edges across vertices; vertices along edges)."""
        return self._navigator().ring(cell, 1, through)

    def ring(self, cell: CellIdLike, k: int, through: int | None = None) -> CellIds:
        """The cells that k steps to neighbors or fewer lead to, without the cell itself; k is 1 ... 32."""
        return self._navigator().ring(cell, k, through)

    def orbit(self, of: Dart | DartInfo | CellIdLike, i: int | None = None) -> Darts:
        """All darts of the i-cell of a dart, in every block. Of a cell: its own darts, or with another i those of all
        i-cells that its darts belong to. StaleDartError for a dart whose block has changed."""
        return self._navigator().orbit(of, i)

    def explore(
        self,
        anchors: Anchors,
        close: Closures = "",
        give: str = "cells",
        dimension: int = 3,
        without_anchors: bool = False,
        *,
        max_darts: int = 0,
    ) -> Darts | CellIds | list[CellDetails]:
        """The general question. Begins with the darts of `anchors` (darts; cells; PointAnchor, BoxAnchor,
        NearestVertexAnchor, BlockAnchor; or a list of these); adds, for each dimension in `close` ("3,2"), from the
        first to the last, all darts of the cells of that dimension; and gives "darts" (Darts), "cells" (CellIds) or
        "details" (a list of CellDetails) of `dimension`, with or without those that the anchors lie in. A cell, point,
        box or nearest vertex begins with one dart of its cells: close over their dimension first.

        ResourceExhaustedError above max_darts, or the server's limit. One answer is of one version of each block.
        """
        return self._navigator().explore(anchors, close, give, dimension, without_anchors, max_darts)

    # --- The mesh ---

    def export(
        self,
        folder: str | os.PathLike[str],
        cells: str = "hexahedron",
        progress: export.ExportProgress | None = None,
    ) -> export.Exported:
        """Writes a VTU piece a block and mesh.pvtu, as `ndmap export` does; after an error what was not there before
        is gone again. Cells are "hexahedron", or "polyhedron" with every shared point and face. Attributes of vertices
        and hexahedra are arrays of points and cells; AbortedError while a job gives new cells their values. `progress`
        is called from other threads, with pieces ready, pieces in all, and bytes."""
        return export.export(self._connection, self._info, folder, cells, progress)

    def to_vtk(self, cells: str = "hexahedron", attributes: Iterable[str] | None = None) -> vtk.vtkUnstructuredGrid:
        """The mesh as a vtkUnstructuredGrid with the arrays of an export, its pieces joined, and the attributes of its
        vertices and hexahedra, or those that are named. Categories are arrays of strings. AbortedError if the map was
        changed meanwhile. Needs python3-vtk9."""
        return mesh.to_vtk(self._connection, self._info, cells, attributes)

    def to_meshio(self, attributes: Iterable[str] | None = None) -> meshio.Mesh:
        """The mesh as a meshio.Mesh: points, hexahedra (and cells of other kinds, kind by kind), point data "id", cell data "block", "level", "state", "id", and
        the attributes of vertices and hexahedra, or those that are named. Categories are numbers, whose texts are in
        info["categories"]. AbortedError if the map was changed meanwhile. Needs python3-meshio."""
        return mesh.to_meshio(self._connection, self._info, attributes)


def fetch_info(connection: Connection, name: str) -> MapInfo:
    """A map's state and routing table as they are now."""
    request = coordinator_pb2.GetMapRequest(map=name)
    return MapInfo.from_proto(connection.idempotent(connection.coordinator.GetMap, request).map)
