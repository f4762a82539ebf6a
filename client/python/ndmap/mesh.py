# SPDX-License-Identifier: Apache-2.0
"""A map as an object of VTK or meshio, in this process. The packages are imported only when they are asked for."""
from __future__ import annotations

import importlib
import tempfile
from typing import Any

import numpy as np

from ndmap.connection import Connection
from ndmap.errors import MissingPackageError
from ndmap.export import check_cells, export
from ndmap.info import MapInfo


def _import(module: str, package: str, what: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError:
        raise MissingPackageError(f"{what} needs {module.split('.')[0]}: install {package}") from None


def to_vtk(connection: Connection, info: MapInfo, cells: str) -> Any:
    """Map.to_vtk. Pieces are joined at points of equal id."""
    check_cells(cells)
    xml = _import("vtkmodules.vtkIOXML", "python3-vtk9", "to_vtk()")
    filters = _import("vtkmodules.vtkFiltersCore", "python3-vtk9", "to_vtk()")
    append = filters.vtkAppendFilter()
    append.MergePointsOn()
    with tempfile.TemporaryDirectory(prefix="ndmap-") as folder:
        for piece in export(connection, info, folder, cells, None).pieces:
            reader = xml.vtkXMLUnstructuredGridReader()
            reader.SetFileName(piece)
            reader.Update()
            append.AddInputData(reader.GetOutput())
        append.Update()
    return append.GetOutput()


def to_meshio(connection: Connection, info: MapInfo) -> Any:
    """Map.to_meshio. Points are in the order of their ids, cells piece after piece."""
    meshio = _import("meshio", "python3-meshio", "to_meshio()")
    vtu = _import("meshio.vtu", "python3-meshio", "to_meshio()")
    with tempfile.TemporaryDirectory(prefix="ndmap-") as folder:
        written = export(connection, info, folder, "hexahedron", None)
        pieces = [piece for piece in map(vtu.read, written.pieces) if len(piece.points)]
    if not pieces:
        return meshio.Mesh(np.empty((0, 3)), [("hexahedron", np.empty((0, 8), np.int64))])
    ids, first, place = np.unique(
        np.concatenate([piece.point_data["id"] for piece in pieces]), return_index=True, return_inverse=True
    )
    cells, at = [], 0
    for piece in pieces:
        for block in piece.cells:
            cells.append(place[at + block.data])
        at += len(piece.points)

    def column(name: str) -> np.ndarray:
        return np.concatenate([part for piece in pieces for part in piece.cell_data[name]])

    return meshio.Mesh(
        np.concatenate([piece.points for piece in pieces])[first],
        [("hexahedron", np.concatenate(cells))],
        point_data={"id": ids},
        cell_data={name: [column(name)] for name in pieces[0].cell_data},
    )
