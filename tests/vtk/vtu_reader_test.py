#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""What write_torus writes through core/io/vtu_writer, VTK's own reader reads as it was meant; and check_vtu.py, which
other tests rely on, finds what is wrong with a damaged export.

  vtu_reader_test.py --write-torus build/release/bin/write_torus
"""

import argparse
import filecmp
import json
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkIdList
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader, vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter

import check_vtu

WRITE_TORUS = None


class VtuReaderTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name

    def write(self, cells, depth=1, folder=""):
        """The index, and what write_torus says is in it."""
        folder = os.path.join(self.folder, folder)
        os.makedirs(folder, exist_ok=True)
        run = subprocess.run([WRITE_TORUS, folder, str(depth), cells], check=True, stdout=subprocess.PIPE)
        return os.path.join(folder, "torus.pvtu"), json.loads(run.stdout)

    def piece(self, index, number):
        return check_vtu.piece_files(index)[number]

    def damage(self, index, change):
        """Replaces piece 0 by what `change` makes of its grid, written by VTK; the errors that the check finds."""
        path = self.piece(index, 0)
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(path)
        reader.Update()
        grid = reader.GetOutput()
        grid = change(grid) or grid
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetFileName(path)
        writer.SetInputData(grid)
        writer.Write()
        return check_vtu.check_export(index)["errors"]

    def assert_error(self, errors, part):
        self.assertTrue(any(part in e for e in errors), f"no error says '{part}': {errors}")

    def check_as_written(self, cells, depth):
        index, written = self.write(cells, depth)
        report = check_vtu.check_export(index)
        self.assertEqual(report["errors"], [])
        for key in ("cells", "distinct_points", "pieces", "by_block", "by_level", "by_state"):
            self.assertEqual(report[key], written[key], key)
        self.assertEqual(report[cells], written["cells"])
        self.assertAlmostEqual(report["volume"], written["volume"], delta=1e-5 * written["volume"])
        self.assertGreater(report["points"], report["distinct_points"], "pieces share points")
        return report

    def test_hexahedra_are_read_as_written(self):
        self.check_as_written("hexahedra", 2)

    def test_polyhedra_are_read_as_written_and_fit_face_to_face(self):
        report = self.check_as_written("polyhedra", 2)
        self.assertEqual(set(report["by_level"]), {"0", "1", "2"}, "so there are points that hang on edges")

    def test_an_index_is_read_with_global_ids(self):
        index, _ = self.write("hexahedra")
        reader = vtkXMLPUnstructuredGridReader()
        reader.SetFileName(index)
        reader.Update()
        grid = reader.GetOutput()
        for attributes in (grid.GetPointData(), grid.GetCellData()):
            self.assertEqual(attributes.GetGlobalIds().GetName(), "id")
            self.assertEqual(attributes.GetGlobalIds().GetClassName(), "vtkIdTypeArray")

    def test_fields_of_every_type_are_read_from_a_piece_and_from_the_index(self):
        index, written = self.write("hexahedra")
        for path, kind in ((self.piece(index, 0), vtkXMLUnstructuredGridReader), (index, vtkXMLPUnstructuredGridReader)):
            reader = kind()
            reader.SetFileName(path)
            reader.Update()
            grid = reader.GetOutput()
            points, cells = grid.GetPointData(), grid.GetCellData()
            at = vtk_to_numpy(grid.GetPoints().GetData())
            np.testing.assert_array_equal(vtk_to_numpy(points.GetArray("first")), at[:, 0])
            np.testing.assert_array_equal(vtk_to_numpy(points.GetArray("place")), at)
            ids = vtk_to_numpy(cells.GetArray("id"))
            np.testing.assert_array_equal(vtk_to_numpy(cells.GetArray("number")), ids)
            side = cells.GetAbstractArray("side")
            self.assertEqual([side.GetValue(i) for i in range(grid.GetNumberOfCells())],
                             ["größere" if number < written["cells"] // 2 else "" for number in ids])
        self.assertEqual(grid.GetNumberOfCells(), written["cells"])

    def test_the_same_mesh_gives_the_same_bytes(self):
        for cells in ("hexahedra", "polyhedra"):
            once, _ = self.write(cells, folder="once")
            again, _ = self.write(cells, folder="again")
            for a, b in zip([once] + check_vtu.piece_files(once), [again] + check_vtu.piece_files(again)):
                self.assertTrue(filecmp.cmp(a, b, shallow=False), a)

    def test_an_empty_piece_is_read_alone(self):
        index, written = self.write("hexahedra")
        report = check_vtu.check_export(self.piece(index, written["pieces"] - 1))
        self.assertEqual(report["errors"], [])
        self.assertEqual((report["cells"], report["points"], report["volume"]), (0, 0, 0.0))
        self.assertEqual(report["cell_arrays"][:4], ["block", "level", "state", "id"])

    def test_a_wrong_point_id_is_found(self):
        index, _ = self.write("hexahedra")
        report = check_vtu.check_export(index)
        self.assertGreater(report["points"], report["distinct_points"], "there are points in several pieces")

        def change(grid):
            ids = grid.GetPointData().GetArray("id")
            x = [grid.GetPoint(i)[0] for i in range(grid.GetNumberOfPoints())]
            ids.SetValue(x.index(max(x)), 10**9)  # where the piece meets its neighbour

        self.assert_error(self.damage(index, change), "1 ids are given to points with the coordinates of another id")

    def test_two_points_with_one_id_are_found(self):
        index, _ = self.write("hexahedra")

        def change(grid):
            ids = grid.GetPointData().GetArray("id")
            ids.SetValue(0, ids.GetValue(1))

        errors = self.damage(index, change)
        self.assert_error(errors, "have the id of a point with other coordinates")
        self.assert_error(errors, "has a point twice")

    def test_a_cell_id_given_twice_is_found(self):
        index, _ = self.write("hexahedra")
        errors = self.damage(index, lambda grid: grid.GetCellData().GetArray("id").SetValue(0, 100))
        self.assert_error(errors, "two cells have the same id")

    def test_an_inside_out_hexahedron_is_found(self):
        index, _ = self.write("hexahedra")

        def change(grid):
            points = vtkIdList()
            grid.GetCellPoints(5, points)
            corners = [points.GetId(i) for i in range(8)]
            grid.GetCells().ReplaceCellAtId(5, 8, corners[4:] + corners[:4])

        errors = self.damage(index, change)
        self.assert_error(errors, "1 cells have no positive volume")
        self.assert_error(errors, "inverted at a corner")

    def test_a_missing_array_is_found(self):
        index, _ = self.write("hexahedra")
        errors = self.damage(index, lambda grid: grid.GetCellData().RemoveArray("level"))
        self.assert_error(errors, "array level not found")

    def test_a_polyhedron_whose_face_runs_the_wrong_way_is_found(self):
        index, _ = self.write("polyhedra")

        def change(grid):
            faces = grid.GetFaces()
            size = faces.GetValue(1)
            points = [faces.GetValue(2 + i) for i in range(size)]
            for i in range(size):
                faces.SetValue(2 + i, points[size - 1 - i])

        self.assert_error(self.damage(index, change), "1 cells are not closed by their faces, first: cell 0")

    def test_a_truncated_piece_is_found(self):
        index, _ = self.write("hexahedra")
        path = self.piece(index, 2)
        os.truncate(path, os.path.getsize(path) // 2)
        self.assert_error(check_vtu.check_export(index)["errors"], "VTK says")

    def test_a_missing_piece_is_found(self):
        index, _ = self.write("hexahedra")
        os.remove(self.piece(index, 1))
        self.assert_error(check_vtu.check_export(index)["errors"], "VTK says")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write-torus", required=True, help="the program of write_torus.cc")
    arguments, rest = parser.parse_known_args()
    WRITE_TORUS = arguments.write_torus
    unittest.main(argv=sys.argv[:1] + rest)
