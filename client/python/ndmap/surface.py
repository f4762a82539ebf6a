# SPDX-License-Identifier: Apache-2.0
"""Closed triangulated surfaces: from arrays or files, and on their way up to a cluster."""
from __future__ import annotations

import functools
import os
from typing import Any, Callable, Iterator, Union

import numpy as np
import xxhash

from ndmap.connection import Connection
from ndmap.errors import InvalidArgumentError, MissingPackageError, NotFoundError
from ndmap.v1 import coordinator_pb2, common_pb2

_CHUNK_BYTES = 1 << 20
# Extension, and the module of meshio that reads it.
_READERS = {".off": "off", ".ply": "ply", ".stl": "stl", ".obj": "obj"}


class Surface:
    """A closed surface: points (n x 3 doubles) and triangles (m x 3 indices of points).

    Here only shapes and indices are checked; whether it is closed and consistently oriented is for the coordinator to
    say, when it is sent there.
    """

    def __init__(self, points: Any, triangles: Any, name: str = "") -> None:
        try:
            coordinates = np.ascontiguousarray(points, dtype="<f8")
            corners = np.asarray(triangles)
        except (TypeError, ValueError) as error:
            raise InvalidArgumentError(f"a surface of points and triangles: {error}") from None
        if coordinates.ndim != 2 or coordinates.shape[1] != 3 or len(coordinates) == 0:
            raise InvalidArgumentError(f"points have the shape {coordinates.shape}, (n, 3) expected")
        if corners.ndim != 2 or corners.shape[1] != 3 or len(corners) == 0:
            raise InvalidArgumentError(f"triangles have the shape {corners.shape}, (m, 3) expected")
        if corners.dtype.kind not in "iu":
            raise InvalidArgumentError(f"triangles are of type {corners.dtype}, indices of points expected")
        if corners.min() < 0 or corners.max() >= len(coordinates):
            raise InvalidArgumentError(
                f"triangles name the points {corners.min()} to {corners.max()}, there are {len(coordinates)}"
            )
        self.points: np.ndarray = coordinates
        self.triangles: np.ndarray = np.ascontiguousarray(corners, dtype="<u4")
        self.name = name

    def __repr__(self) -> str:
        return f"Surface({self.name!r}: {len(self.triangles)} triangles, {len(self.points)} points)"

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Surface:
        """An OFF, PLY, STL or OBJ file of triangles, read by meshio. Equal points become one, unused ones are left out.

        For files that need more than that (polygons, xz, holes of file formats), `ndmap create` reads more.
        """
        file = os.fspath(path)
        extension = os.path.splitext(file)[1].lower()
        if extension not in _READERS:
            raise InvalidArgumentError(f"'{file}': a name that ends in .off, .ply, .stl or .obj expected")
        try:
            import importlib

            reader = importlib.import_module(f"meshio.{_READERS[extension]}")
        except ImportError:
            raise MissingPackageError(f"'{file}': reading surfaces needs meshio: install python3-meshio") from None
        if not os.path.isfile(file):
            raise NotFoundError(f"'{file}': no such file")
        try:
            mesh = reader.read(file)
        except Exception as error:  # Its readers raise whatever the content makes numpy raise.
            raise InvalidArgumentError(f"'{file}' cannot be read: {error or type(error).__name__}") from None
        others = sorted({block.type for block in mesh.cells} - {"triangle", "line", "vertex"})
        if others:
            raise InvalidArgumentError(f"'{file}' has cells of type {', '.join(others)}: only triangles are read")
        triangles = [block.data for block in mesh.cells if block.type == "triangle" and len(block.data)]
        if not triangles:
            raise InvalidArgumentError(f"'{file}' has no triangles")
        return cls(*_joined(np.asarray(mesh.points, "<f8"), np.concatenate(triangles)), name=os.path.basename(file))

    @functools.cached_property
    def id(self) -> str:
        """The id that it has in every cluster: 32 hexadecimal digits that follow from its points and triangles."""
        digest = xxhash.xxh3_128(seed=len(self.points))
        for column in self._columns():
            digest.update(column)
        return digest.hexdigest()

    @property
    def box(self) -> tuple[list[float], list[float]]:
        """The least and the greatest coordinates."""
        return self.points.min(axis=0).tolist(), self.points.max(axis=0).tolist()

    def _columns(self) -> list[memoryview]:
        return [memoryview(array).cast("B") for array in (self.points, self.triangles)]

    def chunks(self, progress: Callable[[int, int], None] | None = None) -> Iterator[common_pb2.SurfaceChunk]:
        """The messages that carry it."""
        name = self.name.encode()[:256].decode(errors="ignore")
        yield common_pb2.SurfaceChunk(
            header=common_pb2.SurfaceHeader(
                name=name, points=len(self.points), triangles=len(self.triangles), surface_id=self.id
            )
        )
        columns = self._columns()
        sent, total = 0, sum(len(column) for column in columns)
        for column in columns:
            for at in range(0, len(column), _CHUNK_BYTES):
                part = bytes(column[at : at + _CHUNK_BYTES])
                yield common_pb2.SurfaceChunk(data=part)
                sent += len(part)
                if progress:
                    progress(sent, total)


SurfaceLike = Union[Surface, str, "os.PathLike[str]", "tuple[Any, Any]"]


def as_surface(surface: SurfaceLike) -> Surface:
    """A surface, from (points, triangles) or from a file's name."""
    if isinstance(surface, Surface):
        return surface
    if isinstance(surface, (str, os.PathLike)):
        return Surface.read(surface)
    if isinstance(surface, (tuple, list)) and len(surface) == 2:
        return Surface(*surface)
    raise InvalidArgumentError(
        f"a surface is a Surface, a file's name, or (points, triangles), not {type(surface).__name__}"
    )


def _joined(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Without points that are equal to others or not used, the others in their order."""
    used, corners = np.unique(triangles, return_inverse=True)
    if used[0] < 0 or used[-1] >= len(points):
        raise InvalidArgumentError(f"triangles name the points {used[0]} to {used[-1]}, there are {len(points)}")
    # Adding 0 makes -0.0 and 0.0 the same.
    _, first, same = np.unique(points[used] + 0.0, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return points[used][first[order]], place[same.reshape(-1)][corners.reshape(-1)].reshape(-1, 3)


def upload(connection: Connection, surface: Surface, progress: Callable[[int, int], None] | None = None) -> str:
    """Sends it in chunks of 1 MiB; its id. Sending one that is there already is no error."""
    timeout = connection.options.transfer_timeout
    send = connection.coordinator.UploadSurface

    def call() -> coordinator_pb2.UploadSurfaceResponse:
        return connection.guarded(lambda: send(surface.chunks(progress), timeout=timeout))

    return connection.retry(call).surface_id
