# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces from arrays and files, and grids over them; no cluster."""
import os
import shutil
import tempfile
import unittest

import meshio
import numpy as np

import ndmap
from cluster import run_ndmap
from ndmap.grid import round_half_up

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
TRIANGLES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


class SurfaceTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="ndmap-python-")
        self.addCleanup(shutil.rmtree, self.folder)

    def test_the_id_follows_from_the_content_only(self):
        surface = ndmap.Surface(POINTS, TRIANGLES, "a")
        for other in (
            ndmap.Surface(POINTS.tolist(), TRIANGLES.tolist(), "b"),
            ndmap.Surface(np.asfortranarray(POINTS), TRIANGLES.astype(np.uint8)),
            ndmap.Surface(POINTS.astype(">f8"), TRIANGLES.astype(">i8")),
        ):
            self.assertEqual(other.id, surface.id)
        self.assertRegex(surface.id, "^[0-9a-f]{32}$")
        self.assertNotEqual(ndmap.Surface(POINTS * 2, TRIANGLES).id, surface.id)
        self.assertNotEqual(ndmap.Surface(POINTS, TRIANGLES[::-1]).id, surface.id)

    def test_arrays_that_are_no_surface(self):
        for points, triangles, words in (
            (POINTS[:, :2], TRIANGLES, r"points have the shape \(4, 2\)"),
            (POINTS, TRIANGLES[:, :2], r"triangles have the shape \(4, 2\)"),
            (POINTS[:0], TRIANGLES, "shape"),
            (POINTS, TRIANGLES[:0], "shape"),
            (POINTS, TRIANGLES * 1.5, "float64"),
            (POINTS, TRIANGLES - 1, "points -1 to 2, there are 4"),
            (POINTS[:3], TRIANGLES, "points 0 to 3, there are 3"),
            ("abc", TRIANGLES, "a surface of points and triangles"),
            ([(0, 0), (1, 2, 3)], TRIANGLES, "a surface of points and triangles"),
        ):
            with self.assertRaisesRegex(ndmap.InvalidArgumentError, words):
                ndmap.Surface(points, triangles)

    def test_files_of_every_kind(self):
        # With a point that is not used, and each corner on its own, as in STL.
        soup = np.concatenate([POINTS[TRIANGLES].reshape(-1, 3), [(9, 9, 9)]])
        mesh = meshio.Mesh(soup, [("triangle", np.arange(12, dtype=np.int32).reshape(-1, 3))])
        for name in ("a.off", "a.ply", "a.STL", "a.obj"):
            with self.subTest(name=name):
                path = os.path.join(self.folder, name)
                meshio.write(path, mesh, file_format=name[2:].lower())
                surface = ndmap.Surface.read(path)
                self.assertEqual((len(surface.points), len(surface.triangles)), (4, 4))
                self.assertEqual(surface.name, name)
                np.testing.assert_array_equal(surface.points[surface.triangles], POINTS[TRIANGLES])

    def test_files_that_are_none(self):
        def write(name, text):
            path = os.path.join(self.folder, name)
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            return path

        for path, kind, words in (
            (os.path.join(self.folder, "none.off"), ndmap.NotFoundError, "none.off': no such file"),
            (write("a.txt", ""), ndmap.InvalidArgumentError, r"a.txt'.*\.off"),
            (write("a.off", "hello"), ndmap.InvalidArgumentError, "a.off' cannot be read"),
            (write("b.ply", ""), ndmap.InvalidArgumentError, "b.ply' cannot be read"),
            (write("q.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"), ndmap.InvalidArgumentError, "quad"),
            (write("x.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n"), ndmap.InvalidArgumentError, "0 to 8, there are 3"),
            (write("p.obj", "v 0 0 0\n"), ndmap.InvalidArgumentError, "no triangles"),
        ):
            with self.subTest(path=path):
                with self.assertRaisesRegex(kind, words) as caught:
                    ndmap.Surface.read(path)
                self.assertNotIn("\n", str(caught.exception))

    def test_samples_read_as_the_command_line_wrote_them(self):
        for kind in ("sphere", "knot", "shells"):
            path = os.path.join(self.folder, f"{kind}.off")
            said = run_ndmap("sample", kind, "-o", path, "--triangles", 2000)
            surface = ndmap.Surface.read(path)
            self.assertEqual((len(surface.points), len(surface.triangles)), (said["points"], said["triangles"]))

    def test_numbers_are_rounded_as_in_the_services(self):
        for number, whole in ((0.5, 1), (1.5, 2), (2.5, 3), (0.49999999999999994, 0), (4503599627370495.5, 1 << 52)):
            self.assertEqual(round_half_up(number), whole)

    def test_grids(self):
        lo, hi = (0, 0, 0), (4, 2, 1)
        self.assertEqual(ndmap.Grid.from_counts(lo, hi, "4x2x1", 0), ndmap.Grid((4, 2, 1), lo, hi))
        self.assertEqual(ndmap.Grid.from_cubes(lo, hi, 4).cells, (4, 2, 1))
        # Near-cubic, about as many as asked for.
        self.assertEqual(ndmap.Grid.auto(lo, hi, 8).cells, (4, 2, 1))
        self.assertEqual(ndmap.Grid.auto(lo, (4, 2, 0.001), 8).cells, (4, 2, 1))
        self.assertEqual(str(ndmap.Grid.auto((0, 0, 0), (1, 1, 1))), "10x10x10")
        for box in (((0, 0, 0), (1, 1, 0)), ((0, 0, 0), (1, float("inf"), 1)), ((0, 0, float("nan")), (1, 1, 1))):
            with self.assertRaisesRegex(ndmap.InvalidArgumentError, "bounding box"):
                ndmap.Grid.from_cubes(*box, 3)


if __name__ == "__main__":
    unittest.main()
