# SPDX-License-Identifier: Apache-2.0
"""A client of ndmap, the distributed combinatorial map.

    import ndmap

    with ndmap.connect("127.0.0.1:7000") as client:
        surface_map = client.create_map("bunny", "bunny.off", blocks=8)
        job = surface_map.refine(depth=4, progress=print)
        job.result()
        walks = surface_map.beta([surface_map.any_dart(0)], "1,2,3")

Every function that fails raises an NdmapError with one sentence, that of the service if a service said no.
Every call has a deadline (ClientOptions); what may be done twice is tried again when a server does not answer.
All objects may be used from any thread.
"""
from ndmap._version import __version__
from ndmap.aggregate import Aggregate
from ndmap.anchors import BlockAnchor, BoxAnchor, NearestVertexAnchor, PointAnchor
from ndmap.attributes import Attribute
from ndmap.client import Client, connect
from ndmap.columns import DartColumns, WalkedColumns
from ndmap.darts import Dart, DartInfo, Darts, Walks
from ndmap.errors import (
    AbortedError,
    AlreadyExistsError,
    CancelledError,
    DataLossError,
    DeadlineExceededError,
    FailedPreconditionError,
    InternalError,
    InvalidArgumentError,
    JobCancelledError,
    JobFailedError,
    MissingPackageError,
    NdmapError,
    NotFoundError,
    OutputError,
    ResourceExhaustedError,
    StaleDartError,
    UnavailableError,
    UnimplementedError,
)
from ndmap.export import Exported
from ndmap.grid import Grid
from ndmap.ids import CellId, CellIds
from ndmap.info import MapInfo, MeshSummary, ProcessStats, Server
from ndmap.job import Job, JobProgress, JobResult, PhaseResult
from ndmap.map import CheckResult, Map, Stats
from ndmap.navigate import CellDetails
from ndmap.options import ClientOptions
from ndmap.surface import Surface
from ndmap.values import CellValues, Written

__all__ = [
    "AbortedError",
    "Aggregate",
    "AlreadyExistsError",
    "Attribute",
    "BlockAnchor",
    "BoxAnchor",
    "CancelledError",
    "CellDetails",
    "CellId",
    "CellIds",
    "CellValues",
    "CheckResult",
    "Client",
    "ClientOptions",
    "Dart",
    "DartColumns",
    "DartInfo",
    "Darts",
    "DataLossError",
    "DeadlineExceededError",
    "Exported",
    "FailedPreconditionError",
    "Grid",
    "InternalError",
    "InvalidArgumentError",
    "Job",
    "JobCancelledError",
    "JobFailedError",
    "JobProgress",
    "JobResult",
    "Map",
    "MapInfo",
    "MeshSummary",
    "MissingPackageError",
    "NdmapError",
    "NearestVertexAnchor",
    "NotFoundError",
    "OutputError",
    "PhaseResult",
    "PointAnchor",
    "ProcessStats",
    "ResourceExhaustedError",
    "Server",
    "StaleDartError",
    "Stats",
    "Surface",
    "UnavailableError",
    "UnimplementedError",
    "WalkedColumns",
    "Walks",
    "Written",
    "__version__",
    "connect",
]
