# SPDX-License-Identifier: Apache-2.0
"""A map as an object of VTK or meshio, in this process, with the values of its attributes. The packages are imported
only when they are asked for."""
from __future__ import annotations

import importlib
import tempfile
from typing import Any, Iterable

import numpy as np

from ndmap.attributes import Attribute, fetch_attributes
from ndmap.connection import Connection
from ndmap.errors import AbortedError, InvalidArgumentError, MissingPackageError, NotFoundError
from ndmap.export import check_cells, export
from ndmap.file_numbers import numbers_of
from ndmap.info import MapInfo
from ndmap.values import Columns, Values, Where


def _import(module: str, package: str, what: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MissingPackageError(f"{what} needs {module.split('.')[0]}: install {package}") from None


class _Fields:
    """Attributes on the points and cells of an export."""

    def __init__(self, connection: Connection, info: MapInfo, names: Iterable[str] | None) -> None:
        self._connection, self._info = connection, info
        there = fetch_attributes(connection, info.name)
        self._wanted = [each for each in there.values() if each.on in ("vertices", "hexahedra")]
        if names is not None:
            self._wanted = [self._named(there, name) for name in ([names] if isinstance(names, str) else names)]

    def _named(self, there: dict[str, Attribute], name: str) -> Attribute:
        if name not in there:
            raise NotFoundError(f"map '{self._info.name}' has no attribute '{name}'")
        if there[name].on not in ("vertices", "hexahedra"):
            raise InvalidArgumentError(f"attribute '{name}' is on {there[name].on}: meshes have points and hexahedra")
        return there[name]

    def of(self, on: str, numbers: np.ndarray) -> dict[str, Values]:
        """Columns of "vertices" or "hexahedra", a row for each number of a file. AbortedError if the map has changed
        since the file was written."""
        names = tuple(each.name for each in self._wanted if each.on == on)
        if not names:
            return {}
        values = Columns(self._connection, self._info).read(names, on, Where(), False)
        there = numbers_of(values.ids, self._info)
        order = np.argsort(there)
        places = np.searchsorted(there, numbers, sorter=order)
        if len(there) == 0 or not np.array_equal(there[order[np.minimum(places, len(there) - 1)]], numbers):
            raise AbortedError(f"map '{self._info.name}' changed while it was read: read it again when its job is done")
        rows = values.rows(order[places])
        return {_field_name(name): rows.column(name) for name in names}


def _field_name(name: str) -> str:
    """As in exports, which have arrays of their own."""
    return f"{name} (attribute)" if name in ("id", "block", "level", "state") else name


def _add_to_vtk(data: Any, columns: dict[str, Values]) -> None:
    core = _import("vtkmodules.vtkCommonCore", "python3-vtk9", "to_vtk()")
    support = _import("vtkmodules.util.numpy_support", "python3-vtk9", "to_vtk()")
    for name, column in columns.items():
        if column.categories is None:
            array = support.numpy_to_vtk(np.ascontiguousarray(column.data), deep=True)
        else:
            array = core.vtkStringArray()
            for text in column.array():
                array.InsertNextValue(text)
        array.SetName(name)
        data.AddArray(array)


def to_vtk(connection: Connection, info: MapInfo, cells: str, attributes: Iterable[str] | None) -> Any:
    """Map.to_vtk. Pieces are joined at points of equal id."""
    check_cells(cells)
    xml = _import("vtkmodules.vtkIOXML", "python3-vtk9", "to_vtk()")
    filters = _import("vtkmodules.vtkFiltersCore", "python3-vtk9", "to_vtk()")
    support = _import("vtkmodules.util.numpy_support", "python3-vtk9", "to_vtk()")
    fields = _Fields(connection, info, attributes)
    append = filters.vtkAppendFilter()
    append.MergePointsOn()
    with tempfile.TemporaryDirectory(prefix="ndmap-") as folder:
        for piece in export(connection, info, folder, cells, None, attributes=False).pieces:
            reader = xml.vtkXMLUnstructuredGridReader()
            reader.SetFileName(piece)
            reader.Update()
            append.AddInputData(reader.GetOutput())
        append.Update()
    grid = append.GetOutput()
    for on, data in (("vertices", grid.GetPointData()), ("hexahedra", grid.GetCellData())):
        if grid.GetNumberOfCells():
            _add_to_vtk(data, fields.of(on, support.vtk_to_numpy(data.GetArray("id"))))
    return grid


def to_meshio(connection: Connection, info: MapInfo, attributes: Iterable[str] | None) -> Any:
    """Map.to_meshio. Points are in the order of their ids, cells kind by kind, of each piece after piece."""
    meshio = _import("meshio", "python3-meshio", "to_meshio()")
    vtu = _import("meshio.vtu", "python3-meshio", "to_meshio()")
    fields = _Fields(connection, info, attributes)
    with tempfile.TemporaryDirectory(prefix="ndmap-") as folder:
        written = export(connection, info, folder, "hexahedron", None, attributes=False)
        pieces = [piece for piece in map(vtu.read, written.pieces) if len(piece.points)]
    if not pieces:
        return meshio.Mesh(np.empty((0, 3)), [("hexahedron", np.empty((0, 8), np.int64))])
    ids, first, place = np.unique(
        np.concatenate([piece.point_data["id"] for piece in pieces]), return_index=True, return_inverse=True
    )
    cells: dict[str, list[np.ndarray]] = {}
    at = 0
    for piece in pieces:
        for block in piece.cells:
            cells.setdefault(block.type, []).append(place[at + block.data])
        at += len(piece.points)

    def column(name: str) -> list[np.ndarray]:
        """By kind."""
        parts: dict[str, list[np.ndarray]] = {kind: [] for kind in cells}
        for piece in pieces:
            for block, part in zip(piece.cells, piece.cell_data[name]):
                parts[block.type].append(part)
        return [np.concatenate(each) for each in parts.values()]

    ends = np.cumsum([sum(map(len, each)) for each in cells.values()])[:-1]
    on_points, on_cells = fields.of("vertices", ids), fields.of("hexahedra", np.concatenate(column("id")))
    texts = {name: each.categories for name, each in {**on_points, **on_cells}.items() if each.categories is not None}
    return meshio.Mesh(
        np.concatenate([piece.points for piece in pieces])[first],
        [(kind, np.concatenate(each)) for kind, each in cells.items()],
        point_data={"id": ids, **{name: each.data for name, each in on_points.items()}},
        cell_data={
            **{name: column(name) for name in pieces[0].cell_data},
            **{name: np.split(each.data, ends) for name, each in on_cells.items()},
        },
        info={"categories": texts} if texts else None,
    )
