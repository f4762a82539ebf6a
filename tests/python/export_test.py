# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports and meshes of a real cluster, against the command line's export."""
import filecmp
import os
import sys
import unittest
from unittest import mock

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader

import ndmap
from cluster import ClusterTest
from ndmap.file_numbers import file_numbers


class ExportTest(ClusterTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.maps = {}
        for blocks in (1, 2, 4):
            made = cls.maps[blocks] = cls.client.create_map(f"m{blocks}", cls.torus, grid="6x6x3", blocks=blocks)
            made.refine(1).result()
            made.define("warmth", on="vertices", split="mean").result()
            made.define("wind", on="vertices", type="vec3", split="mean").result()
            made.define("level", on="hexahedra", type="int64", fill=7).result()
            made.define("rock", on="hexahedra", type="category", fill="chalk").result()
            made.compute("warmth", lambda point: point[:, 0], "@point")
            made.compute("wind", lambda point: -point, "@point")
            made.compute("rock", lambda point: np.where(point[:, 1] < 0, "größer", "chalk"), "@point")
            made.refine(2).result()
            made.trim().result()
        cls.counts = cls.maps[1].stats().counts

    def test_the_files_are_those_of_the_command_line(self):
        for blocks, made in self.maps.items():
            for cells in ("hexahedron", "polyhedron"):
                with self.subTest(blocks=blocks, cells=cells):
                    ours, theirs = f"{self.folder}/ours/{cells}{blocks}", f"{self.folder}/theirs/{cells}{blocks}"
                    told = []
                    written = made.export(ours, cells, progress=lambda *now: told.append(now))
                    said = self.cluster.ndmap("export", made.name, "-o", theirs, "--cells", cells)
                    names = sorted(os.listdir(theirs))
                    self.assertEqual(sorted(os.listdir(ours)), names)
                    self.assertEqual(len(names), blocks + 1)
                    self.assertEqual(filecmp.cmpfiles(ours, theirs, names, shallow=False), (names, [], []))
                    self.assertEqual((written.bytes, written.cells), (said["bytes"], said["cells"]))
                    self.assertEqual(written.index, f"{ours}/mesh.pvtu")
                    self.assertEqual([os.path.basename(piece) for piece in written.pieces], names[:-1])
                    self.assertEqual(told[-1], (blocks, blocks, written.bytes))

    def test_an_export_has_the_attributes_as_they_are_read(self):
        for blocks, made in self.maps.items():
            vertices, hexahedra = made.read("warmth", "wind"), made.read("level", "rock")
            for cells in ("hexahedron", "polyhedron"):
                with self.subTest(blocks=blocks, cells=cells):
                    written = made.export(f"{self.folder}/fields/{cells}{blocks}", cells)
                    reader = vtkXMLPUnstructuredGridReader()
                    reader.SetFileName(written.index)
                    reader.Update()
                    grid = reader.GetOutput()
                    points, data = grid.GetPointData(), grid.GetCellData()
                    row = {number: row for row, number in enumerate(file_numbers(vertices.ids, made.info.grid).tolist())}
                    rows = [row[number] for number in vtk_to_numpy(points.GetArray("id")).tolist()]
                    for name in ("warmth", "wind"):
                        np.testing.assert_array_equal(vtk_to_numpy(points.GetArray(name)), vertices[name][rows])
                    row = {number: row for row, number in enumerate(file_numbers(hexahedra.ids, made.info.grid).tolist())}
                    rows = [row[number] for number in vtk_to_numpy(data.GetArray("id")).tolist()]
                    self.assertEqual(sorted(rows), list(range(len(hexahedra))))
                    np.testing.assert_array_equal(vtk_to_numpy(data.GetArray("level (attribute)")), hexahedra["level"][rows])
                    rocks = data.GetAbstractArray("rock")
                    self.assertEqual([rocks.GetValue(i) for i in range(rocks.GetNumberOfValues())],
                                     hexahedra["rock"][rows].tolist())
                    self.assertEqual(set(hexahedra["rock"]), {"größer", "chalk"})

    def test_an_export_replaces_what_was_there(self):
        folder = f"{self.folder}/again"
        first = self.maps[2].export(folder)
        os.truncate(first.pieces[0], 0)
        self.assertEqual(self.maps[2].export(folder), first)
        self.assertGreater(os.path.getsize(first.pieces[0]), 0)

    def test_a_mesh_of_vtk(self):
        for blocks, made in self.maps.items():
            for cells in ("hexahedron", "polyhedron"):
                with self.subTest(blocks=blocks, cells=cells):
                    grid = made.to_vtk(cells)
                    self.assertEqual(grid.GetNumberOfCells(), self.counts["hexahedra"])
                    self.assertEqual(grid.GetNumberOfPoints(), self.counts["vertices"])
                    data = grid.GetCellData()
                    column = {name: vtk_to_numpy(data.GetArray(name)) for name in ("block", "level", "state", "id")}
                    self.assertEqual(sorted(set(column["block"])), list(range(blocks)))
                    self.assertEqual(sorted(column["id"]), sorted(set(column["id"])))
                    for level in range(3):
                        self.assertEqual((column["level"] == level).sum(), self.counts.get(f"level_{level}", 0))
                    self.assertEqual((column["state"] == 3).sum(), self.counts["cut"])

    def test_a_mesh_of_meshio(self):
        meshes = {}
        for blocks, made in self.maps.items():
            with self.subTest(blocks=blocks):
                mesh = made.to_meshio()
                self.assertEqual(mesh.points.shape, (self.counts["vertices"], 3))
                corners = mesh.cells_dict["hexahedron"]
                self.assertEqual(corners.shape, (self.counts["hexahedra"], 8))
                # Edges from corner 0 of a hexahedron that is not twisted span a positive volume.
                at = mesh.points[corners]
                edges = np.stack([at[:, end] - at[:, 0] for end in (1, 3, 4)], axis=1)
                self.assertTrue((np.linalg.det(edges) > 0).all())
                order = np.argsort(mesh.cell_data["id"][0])
                meshes[blocks] = (mesh.points, corners[order], mesh.cell_data["level"][0][order])
                for one, other in zip(meshes[blocks], meshes[1]):
                    np.testing.assert_array_equal(one, other)

    def test_packages_that_are_not_installed(self):
        made = self.maps[2]
        for module, package, call in (
            ("vtkmodules.vtkIOXML", "python3-vtk9", made.to_vtk),
            ("meshio", "python3-meshio", made.to_meshio),
            ("meshio.off", "python3-meshio", lambda: ndmap.Surface.read(self.torus)),
        ):
            with mock.patch.dict(sys.modules, {module: None}):
                with self.assertRaisesRegex(ndmap.MissingPackageError, f"install {package}$"):
                    call()


if __name__ == "__main__":
    unittest.main()
