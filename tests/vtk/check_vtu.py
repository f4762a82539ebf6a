#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads an export (.pvtu or .vtu) with VTK's own reader and checks it.

Prints one JSON object: what was counted, and "errors", a list of sentences. Exits with 1 if there are errors.

  check_vtu.py out/mesh.pvtu
"""

import argparse
import json
import os
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, VTK_POLYHEDRON, VTK_PYRAMID, VTK_TETRA, VTK_WEDGE
from vtkmodules.vtkFiltersVerdict import vtkMeshQuality
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader, vtkXMLUnstructuredGridReader

# The faces of cells, counter-clockwise seen from outside, by VTK's corner numbers.
FACES = {
    VTK_TETRA: [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)],
    VTK_PYRAMID: [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
    # As VTK documents it: the first triangle is seen from outside.
    VTK_WEDGE: [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    VTK_HEXAHEDRON: [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)],
}
NAMES = {VTK_TETRA: "tetrahedra", VTK_PYRAMID: "pyramids", VTK_WEDGE: "prisms", VTK_HEXAHEDRON: "hexahedra",
         VTK_POLYHEDRON: "polyhedra"}
# Complaints are caught by check.read; standard error need not have them too.
vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
CELL_ARRAYS = ["block", "level", "state", "id"]


class Check:
    def __init__(self):
        self.report = {"errors": []}

    def error(self, sentence):
        self.report["errors"].append(sentence)

    def read(self, path):
        """The grid that VTK makes of a file; whatever the reader complains about is an error."""
        window = vtkStringOutputWindow()
        vtkOutputWindow.SetInstance(window)
        reader = vtkXMLPUnstructuredGridReader() if path.endswith(".pvtu") else vtkXMLUnstructuredGridReader()
        reader.SetFileName(path)
        reader.Update()
        if window.GetOutput():
            self.error(f"{path}: VTK says: {' '.join(window.GetOutput().split())}")
        return reader.GetOutput()


def piece_files(path):
    if not path.endswith(".pvtu"):
        return [path]
    root = ElementTree.parse(path).getroot()
    return [os.path.join(os.path.dirname(path), piece.get("Source")) for piece in root.iter("Piece")]


def histogram(array):
    values, counts = np.unique(array, return_counts=True)
    return {str(v): int(c) for v, c in zip(values, counts)}


def array(attributes, name):
    data = attributes.GetArray(name)
    return None if data is None else vtk_to_numpy(data)


def fan_volumes(points, face):
    """Six times the signed volume between the origin and each face, fanned about the mean of its points.

    `face` is an array of faces with equally many points. Two cells that share a face get the same, with opposite signs.
    """
    corners = points[face]
    centre = corners.mean(axis=1)
    following = np.roll(corners, -1, axis=1)
    return np.einsum("fki,fki->f", np.cross(corners, following), np.repeat(centre[:, None], face.shape[1], axis=1))


class Faces:
    """All faces of a grid: for each, its cell and its points."""

    def __init__(self, grid):
        self.by_size = {}
        types = vtk_to_numpy(grid.GetCellTypesArray())
        connectivity = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
        offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
        for kind, kind_faces in FACES.items():
            cells = np.flatnonzero(types == kind)
            if not len(cells):
                continue
            corners = connectivity[offsets[cells][:, None] + np.arange(1 + max(max(f) for f in kind_faces))]
            for face in kind_faces:
                self.by_size.setdefault(len(face), []).append((cells, corners[:, list(face)]))
        if grid.GetFaces() is not None:
            self._add_polyhedra(types, vtk_to_numpy(grid.GetFaces()), vtk_to_numpy(grid.GetFaceLocations()))

    def _add_polyhedra(self, types, stream, locations):
        lists = {}
        stream = stream.tolist()
        for cell in np.flatnonzero(types == VTK_POLYHEDRON).tolist():
            at = locations[cell] + 1
            for _ in range(stream[at - 1]):
                size = stream[at]
                cells, faces = lists.setdefault(size, ([], []))
                cells.append(cell)
                faces.append(stream[at + 1 : at + 1 + size])
                at += 1 + size
        for size, (cells, faces) in lists.items():
            self.by_size.setdefault(size, []).append((np.array(cells), np.array(faces)))

    def __iter__(self):
        for parts in self.by_size.values():
            yield np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def check_volumes(check, grid, points, faces, flat):
    number = grid.GetNumberOfCells()
    volumes = np.zeros(number)
    # About the middle of the box, so that nothing is lost to rounding far from the origin.
    local = points - (points.min(axis=0) + points.max(axis=0)) / 2 if len(points) else points
    for cells, face in faces:
        for begin in range(0, len(face), 1 << 18):  # in parts: coordinates of all faces at once take gigabytes
            part = slice(begin, begin + (1 << 18))
            np.add.at(volumes, cells[part], fan_volumes(local, face[part]) / 6)
    check.report["volume"] = float(volumes.sum())
    check.report["volume_min"] = float(volumes.min()) if number else None
    if number and volumes.min() <= 0:
        check.error(f"{int((volumes <= 0).sum())} cells have no positive volume, first: cell {int(np.argmax(volumes <= 0))}")

    types = vtk_to_numpy(grid.GetCellTypesArray()) if number else np.zeros(0)
    for kind, name in NAMES.items():
        check.report[name] = int((types == kind).sum())
    if sum(check.report[name] for name in NAMES.values()) != number:
        check.error(f"cells of other types than {', '.join(NAMES.values())}: {histogram(types)}")
    if check.report["hexahedra"]:
        check_hexahedra(check, grid, types == VTK_HEXAHEDRON, volumes, flat)


def check_hexahedra(check, grid, which, volumes, flat):
    """What VTK itself thinks of the hexahedra: volume as ours, every corner the right way round."""
    quality = vtkMeshQuality()
    quality.SetInputData(grid)
    quality.SetHexQualityMeasureToVolume()
    quality.Update()
    theirs = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))[which]
    if flat and not np.allclose(theirs, volumes[which], rtol=1e-6, atol=0):
        check.error("volumes of hexahedra differ from those of vtkMeshQuality")
    quality.SetHexQualityMeasureToScaledJacobian()
    quality.Update()
    jacobian = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))[which]
    check.report["scaled_jacobian_min"] = float(jacobian.min())
    if jacobian.min() <= 0:
        check.error(f"{int((jacobian <= 0).sum())} hexahedra are inverted at a corner (scaled Jacobian)")


def check_ids(check, grid, points):
    """Ids of points: the same id if and only if the same coordinates, bit for bit. Ids of cells: each once."""
    ids = array(grid.GetPointData(), "id")
    if ids is None:
        check.error("points have no array 'id'")
        return None
    if len(ids) and grid.GetPointData().GetGlobalIds() is None:
        check.error("the points' ids are not marked as global ids")
    distinct, first, inverse = np.unique(ids, return_index=True, return_inverse=True)
    check.report["distinct_points"] = len(distinct)
    bits = np.ascontiguousarray(points).view(np.uint64).reshape(-1, 3)
    wrong = (bits != bits[first][inverse]).any(axis=1)
    if wrong.any():
        at = int(np.argmax(wrong))
        check.error(f"{int(wrong.sum())} points have the id of a point with other coordinates, first: id {int(ids[at])}")
    places = len(np.unique(bits[first], axis=0)) if len(distinct) else 0
    if places != len(distinct):
        check.error(f"{len(distinct) - places} ids are given to points with the coordinates of another id")

    cell_ids = array(grid.GetCellData(), "id")
    if cell_ids is not None and len(np.unique(cell_ids)) != len(cell_ids):
        check.error("two cells have the same id")
    return ids


def check_pieces(check, path, grid):
    """Each piece by itself: its points once, and together as many as the index gives."""
    files = piece_files(path)
    check.report["pieces"] = len(files)
    cells = points = 0
    for file in files:
        piece = check.read(file)
        cells += piece.GetNumberOfCells()
        points += piece.GetNumberOfPoints()
        ids = array(piece.GetPointData(), "id")
        if ids is not None and len(np.unique(ids)) != len(ids):
            check.error(f"{file}: has a point twice")
    if (cells, points) != (grid.GetNumberOfCells(), grid.GetNumberOfPoints()):
        check.error(f"pieces have {cells} cells and {points} points, together {grid.GetNumberOfCells()} and "
                    f"{grid.GetNumberOfPoints()}")


def check_closed(check, faces):
    """Within a cell each edge is run once in each direction: its faces close it, and all are seen from outside."""
    edges = [(np.repeat(cells, face.shape[1]), face.ravel(), np.roll(face, -1, axis=1).ravel()) for cells, face in faces]
    cells, a, b = (np.concatenate([e[i] for e in edges]) for i in range(3))
    rows = np.stack([cells, np.minimum(a, b), np.maximum(a, b)], axis=1)
    named, inverse = np.unique(rows, axis=0, return_inverse=True)
    ahead = np.bincount(inverse, weights=a < b)
    bad = (np.bincount(inverse) != 2) | (ahead != 1)
    if bad.any():
        check.error(f"{len(np.unique(named[bad, 0]))} cells are not closed by their faces, first: cell {named[bad, 0][0]}")


def check_faces(check, ids, faces):
    """Polyhedra fit together: each face is on the border, or joins exactly two cells, which run it in opposite
    directions. (Hexahedra with finer neighbours do not fit face to face.)"""
    border = interior = wrong = 0
    for _cells, face in faces:
        named = ids[face]
        # One starting point for both sides: the lowest id first. The other side runs the rest backwards.
        start = named.argmin(axis=1)
        size = named.shape[1]
        forward = np.take_along_axis(named, (start[:, None] + np.arange(size)) % size, axis=1)
        backward = np.take_along_axis(named, (start[:, None] - np.arange(size)) % size, axis=1)
        is_forward = forward[:, 1] < forward[:, -1]
        _, inverse = np.unique(np.where(is_forward[:, None], forward, backward), axis=0, return_inverse=True)
        ahead = np.bincount(inverse, weights=is_forward)
        both = np.bincount(inverse)
        border += int((both == 1).sum())
        interior += int(((both == 2) & (ahead == 1)).sum())
        wrong += int(((both > 2) | ((both == 2) & (ahead != 1))).sum())
    check.report["border_faces"] = border
    check.report["interior_faces"] = interior
    if wrong:
        check.error(f"{wrong} faces join more than two cells, or two that run it in the same direction")


def check_export(path, fits=False, flat=True):
    """`fits`: cells that are no polyhedra fit face to face, too. `flat`: faces of hexahedra are flat, so that everybody
    agrees on volumes."""
    check = Check()
    if not os.path.exists(path):
        check.error(f"{path}: no such file")
        return check.report
    grid = check.read(path)
    report = check.report
    report["cells"] = grid.GetNumberOfCells()
    report["points"] = grid.GetNumberOfPoints()
    points = vtk_to_numpy(grid.GetPoints().GetData()) if report["points"] else np.zeros((0, 3))
    report["bounds"] = [float(b) for b in grid.GetBounds()] if report["points"] else None
    report["cell_arrays"] = [grid.GetCellData().GetArrayName(i) for i in range(grid.GetCellData().GetNumberOfArrays())]
    report["point_arrays"] = [grid.GetPointData().GetArrayName(i) for i in range(grid.GetPointData().GetNumberOfArrays())]
    for name in CELL_ARRAYS:
        data = array(grid.GetCellData(), name)
        if data is None:
            check.error(f"cells have no array '{name}'")
        elif name != "id":
            report[f"by_{name}"] = histogram(data)
    if not np.isfinite(points).all():
        check.error("a coordinate is not finite")
    faces = Faces(grid) if report["cells"] else []
    check_volumes(check, grid, points, faces, flat)
    ids = check_ids(check, grid, points)
    check_pieces(check, path, grid)
    if ids is not None and (report["polyhedra"] or fits):
        check_closed(check, faces)
        check_faces(check, ids, faces)
    return report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("export", help=".pvtu or .vtu")
    report = check_export(parser.parse_args().export)
    print(json.dumps(report, indent=2))
    return 1 if report["errors"] else 0


if __name__ == "__main__":
    sys.exit(main())
