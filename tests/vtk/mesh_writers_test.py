#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mesh files that other programs write, VTK and meshio, are what `ndmap inspect` says they are.

  mesh_writers_test.py --ndmap build/release/bin/ndmap
"""

import argparse
import itertools
import json
import os
import subprocess
import sys
import tempfile
import unittest

import meshio
import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

NDMAP = None

# A cube, a prism beside it, a pyramid on the cube, a tetrahedron between pyramid and prism. The prism is in Gmsh's order.
POINTS = numpy.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1],
                      [2, 0, 0], [2, 0, 1], [0.9, 0.4, 2]])
CELLS = [("hexahedron", [0, 1, 2, 3, 4, 5, 6, 7]), ("wedge", [1, 8, 2, 5, 9, 6]), ("pyramid", [4, 5, 6, 7, 10]),
         ("tetra", [5, 9, 6, 10]), ("triangle", [1, 8, 9])]
VTK_TYPES = {"hexahedron": 12, "wedge": 13, "pyramid": 14, "tetra": 10, "triangle": 5}
EVERY = {"tetrahedra": 1, "pyramids": 1, "prisms": 1, "hexahedra": 1}


def inspect(path):
    run = subprocess.run([NDMAP, "--json", "inspect", path], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if run.returncode:
        raise AssertionError(run.stderr)
    return json.loads(run.stdout)


def vtk_grid(gmsh_prisms):
    grid = vtkUnstructuredGrid()
    points = vtkPoints()
    points.SetData(numpy_to_vtk(POINTS, deep=True))
    grid.SetPoints(points)
    for name, corners in CELLS:
        # VTK's documentation has the triangles of a wedge the other way round.
        if name == "wedge" and not gmsh_prisms:
            corners = [corners[i] for i in (0, 2, 1, 3, 5, 4)]
        grid.InsertNextCell(VTK_TYPES[name], len(corners), corners)
    return grid


class MeshWritersTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name

    def check(self, path, turned=False):
        found = inspect(path)
        self.assertEqual(found["cells"], EVERY, path)
        self.assertEqual(found["points"], 11, path)
        self.assertEqual((found["euler"], found["boundary"]["euler"], found["components"]), (1, 2, 1), path)
        self.assertEqual(found["boundary"]["faces"], 12, path)
        self.assertAlmostEqual(found["volume"], 1 + 1 / 2 + 1 / 3 + 1 / 6, places=6, msg=path)
        self.assertEqual(found["warnings"], [], path)
        self.assertEqual(any(note.startswith("turned") for note in found["notes"]), turned, found["notes"])
        self.assertTrue(any("1 triangles" in note for note in found["notes"]), found["notes"])

    def test_vtk(self):
        for gmsh_prisms in (False, True):
            grid = vtk_grid(gmsh_prisms)
            for mode, compressor, header, order in itertools.product(
                    ("Ascii", "Binary", "Appended"), ("None", "ZLib", "LZMA"), ("UInt32", "UInt64"),
                    ("LittleEndian", "BigEndian")):
                for raw in (False, True) if mode == "Appended" else (False,):
                    path = os.path.join(self.folder, f"{mode}_{compressor}_{header}_{order}_{raw}_{gmsh_prisms}.vtu")
                    writer = vtkXMLUnstructuredGridWriter()
                    writer.SetInputData(grid)
                    writer.SetFileName(path)
                    getattr(writer, f"SetDataModeTo{mode}")()
                    getattr(writer, f"SetCompressorTypeTo{compressor}")()
                    getattr(writer, f"SetHeaderTypeTo{header}")()
                    getattr(writer, f"SetByteOrderTo{order}")()
                    writer.SetEncodeAppendedData(not raw)
                    self.assertEqual(writer.Write(), 1)
                    self.check(path, turned=gmsh_prisms)

    def test_vtk_lz4_is_refused_by_name(self):
        path = os.path.join(self.folder, "lz4.vtu")
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetInputData(vtk_grid(False))
        writer.SetFileName(path)
        writer.SetCompressorTypeToLZ4()
        writer.Write()
        with self.assertRaisesRegex(AssertionError, "is compressed by 'vtkLZ4DataCompressor'"):
            inspect(path)

    def test_meshio(self):
        cells = [(name, numpy.array([corners])) for name, corners in CELLS]
        plain = meshio.Mesh(POINTS, cells)
        # Gmsh 4.1 has each node in an entity, here all in volume 1.
        numbers = [numpy.array([i + 1]) for i in range(len(cells))]
        tagged = meshio.Mesh(POINTS, cells, point_data={"gmsh:dim_tags": numpy.array([[3, 1]] * len(POINTS))},
                             cell_data={"gmsh:geometrical": numbers, "gmsh:physical": numbers})
        for name, options in [
                ("gmsh22.msh", {"file_format": "gmsh22", "binary": False}),
                ("gmsh22b.msh", {"file_format": "gmsh22", "binary": True}),
                ("gmsh41.msh", {"file_format": "gmsh", "binary": False}),
                ("gmsh41b.msh", {"file_format": "gmsh", "binary": True}),
                ("medit.mesh", {"file_format": "medit"}),
                ("medit.meshb", {"file_format": "medit"}),
                ("ascii.vtu", {"file_format": "vtu", "binary": False}),
                ("zlib.vtu", {"file_format": "vtu", "compression": "zlib"}),
                ("lzma.vtu", {"file_format": "vtu", "compression": "lzma"}),
                ("plain.vtu", {"file_format": "vtu", "compression": None})]:
            path = os.path.join(self.folder, name)
            (tagged if name.startswith("gmsh41") else plain).write(path, **options)
            self.check(path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--ndmap", required=True)
    arguments, rest = parser.parse_known_args()
    NDMAP = arguments.ndmap
    unittest.main(argv=sys.argv[:1] + rest)
