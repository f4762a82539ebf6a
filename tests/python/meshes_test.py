# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps made from mesh files: made with the help of the program `ndmap`, asked, read as numbers, VTK and meshio."""
import os
import unittest

import numpy as np

import ndmap
from cluster import BIN, ClusterTest, run_ndmap
from ndmap.file_numbers import mesh_file_numbers

# A cube, a prism beside it, a pyramid on the cube, a tetrahedron on the prism.
MIXED = """MeshVersionFormatted 1
Dimension 3
Vertices 12
0 0 0 0
1 0 0 0
1 1 0 0
0 1 0 0
0 0 1 0
1 0 1 0
1 1 1 0
0 1 1 0
2 0.5 0 0
2 0.5 1 0
0.5 0.5 2 0
1.5 0.5 2 0
Hexahedra 1
1 2 3 4 5 6 7 8 0
Prisms 1
2 9 3 6 10 7 0
Pyramids 1
5 6 7 8 11 0
Tetrahedra 1
6 10 7 12 0
End
"""
PROGRAM = os.path.join(BIN, "ndmap")


class MeshesTest(ClusterTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.mixed = os.path.join(cls.folder, "mixed.mesh")
        with open(cls.mixed, "w", encoding="utf-8") as out:
            out.write(MIXED)

    def mesh(self, name, **options):
        made = self.client.create_map_from_mesh(name, self.mixed, **{"blocks": 3, "program": PROGRAM, **options})
        self.addCleanup(self.client.delete_map, name)
        return made

    def test_made_and_asked(self):
        made = self.mesh("mixed", partition="metis")
        info = made.info
        self.assertIsNone(info.grid)
        self.assertEqual((info.mesh.name, info.mesh.cells, info.mesh.prisms, info.mesh.points), ("mixed.mesh", 4, 1, 12))
        self.assertEqual(info.mesh.box, ((0, 0, 0), (2, 1, 2)))
        self.assertIn("mesh 'mixed.mesh' of 4 cells", repr(made))
        self.assertEqual([made.cell(f"h{i}").kind for i in range(4)], ["hexahedron", "prism", "pyramid", "tetrahedron"])
        self.assertEqual(len(made.cell("h2").vertices), 5)
        self.assertEqual(made.cell("v0:0").kind, "")
        self.assertEqual([ids.text() for ids in made.locate([(1.4, 0.5, 0.5), (0.5, 0.5, 1.5), (1.9, 0.05, 0.5)])],
                         [["h1"], ["h2"], []])
        made.refine(2, "everything").result()
        self.assertTrue(made.check().valid)
        cells = made.cells(3)
        self.assertEqual(len(cells), 67)
        # In parts, as many as the limit asks for: the same.
        self.assertEqual(made._navigator().cells(3, 400), cells)
        stale = made.any_dart(0).dart
        made.refine(3, "list", cells=str(cells[0])).result()
        if stale.version != made.any_dart(0).dart.version:
            self.fails(ndmap.StaleDartError, "stale|version", made.orbit, stale, 3)

    def test_numbers_and_meshes_of_other_packages(self):
        made = self.mesh("mixed")
        made.refine(1, "everything").result()
        made.define("height", on="vertices", type="double", split="mean").result()
        vertices = made.read("height", on="vertices")
        self.assertEqual(len(vertices.ids), 12 + 27 - 8)
        points = {str(v.id): v for v in made.explore(vertices.ids, "", "details", 0)}
        made.write("height", vertices.ids, [points[text].points[0][2] for text in vertices.ids.text()])
        mesh = made.to_meshio()
        self.assertEqual({block.type: len(block.data) for block in mesh.cells},
                         {"hexahedron": 8, "wedge": 1, "pyramid": 1, "tetra": 1})
        self.assertEqual(mesh.point_data["height"].tolist(), mesh.points[:, 2].tolist())
        numbers = mesh_file_numbers(vertices.ids, 4)
        self.assertEqual(sorted(numbers.tolist()), mesh.point_data["id"].tolist())
        for block, ids in zip(mesh.cells, mesh.cell_data["id"]):
            self.assertEqual(len(block.data), len(ids))
        grid = made.to_vtk()
        self.assertEqual((grid.GetNumberOfCells(), grid.GetNumberOfPoints()), (11, 31))
        cells = made.cells(3)
        self.assertEqual(sorted(mesh_file_numbers(cells, 4).tolist()),
                         sorted(np.concatenate(mesh.cell_data["id"]).tolist()))

    def test_refused(self):
        create = self.client.create_map_from_mesh
        self.fails(ndmap.MissingPackageError, "needs the program 'no-such-ndmap'", create, "m", self.mixed,
                   program="no-such-ndmap")
        self.fails(ndmap.InvalidArgumentError, "5 blocks, expected 1 to 4", create, "m", self.mixed, blocks=5,
                   program=PROGRAM)
        self.fails(ndmap.InvalidArgumentError, "none.mesh", create, "m", os.path.join(self.folder, "none.mesh"),
                   program=PROGRAM)
        self.fails(ndmap.InvalidArgumentError, "routing 'best' is none of", create, "m", self.mixed, routing="best")
        self.assertNotIn("m", [info.name for info in self.client.maps()])

    def test_with_a_surface(self):
        ball = os.path.join(self.folder, "ball.off")
        run_ndmap("sample", "sphere", "-o", ball, "--triangles", 500, "--scale", 0.6)
        made = self.mesh("mixed", surface=ball)
        made.refine(2).result()
        self.assertEqual(made.cell("h1").state, "outside")


if __name__ == "__main__":
    unittest.main()
