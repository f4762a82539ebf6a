#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""ndmap-picture draws what it is asked for, and says in one line why it cannot.

  picture_test.py --write-torus build/release/bin/write_torus --picture build/release/bin/ndmap-picture
"""

import argparse
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkStringArray
from vtkmodules.vtkFiltersCore import vtkCellCenters
from vtkmodules.vtkIOImage import vtkPNGReader
from vtkmodules.vtkIOXML import vtkXMLPUnstructuredGridReader, vtkXMLUnstructuredGridWriter

ARGUMENTS = None
BLUE, ORANGE, GREEN, RED = (0x4E, 0x79, 0xA7), (0xF2, 0x8E, 0x2B), (0x59, 0xA1, 0x4F), (0xE1, 0x57, 0x59)
COARSEST = (0x46, 0x51, 0x8F)


def pixels(path):
    reader = vtkPNGReader()
    reader.SetFileName(path)
    reader.Update()
    width, height, _ = reader.GetOutput().GetDimensions()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).reshape(height, width, -1).astype(float)


def share(picture, color):
    """The share of pixels that have this colour, lit more or less: the same ratios of red, green and blue."""
    lit = picture / np.maximum(np.linalg.norm(picture, axis=2, keepdims=True), 1)
    return float((np.abs(lit - np.array(color) / np.linalg.norm(color)).max(axis=2) < 0.02).mean())


class PictureTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = temporary.name
        for cells in ("hexahedra", "polyhedra"):
            os.mkdir(os.path.join(cls.folder, cells))
            subprocess.run([ARGUMENTS.write_torus, os.path.join(cls.folder, cells), "1", cells], check=True,
                           stdout=subprocess.DEVNULL)

    def start(self, *options, cells="hexahedra", output="picture.png"):
        command = [ARGUMENTS.picture, f"{self.folder}/{cells}/torus.pvtu", "-o", f"{self.folder}/{output}", *options]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def draw(self, *options, cells="hexahedra"):
        run = self.start(*options, cells=cells)
        _, complaint = run.communicate()
        self.assertEqual((run.returncode, complaint), (0, ""))
        return pixels(f"{self.folder}/picture.png")

    def test_blocks_have_their_colours(self):
        for cells in ("hexahedra", "polyhedra"):
            picture = self.draw("--color", "block", "--clip", "none", "--size", "640x480", cells=cells)
            self.assertEqual(picture.shape, (480, 640, 3))
            for color in (BLUE, ORANGE, GREEN, RED):
                self.assertGreater(share(picture, color), 0.02)

    def test_the_plane_takes_the_front_away(self):
        picture = self.draw("--color", "block", "--clip", "y", "--size", "640x480")
        for color in (BLUE, ORANGE):
            self.assertLess(share(picture, color), 0.001)
        for color in (GREEN, RED):
            self.assertGreater(share(picture, color), 0.05)

    def test_the_plane_shows_the_coarse_cells_inside(self):
        whole = self.draw("--color", "level", "--clip", "none", "--size", "640x480")
        opened = self.draw("--color", "level", "--clip", "z", "--size", "640x480")
        self.assertGreater(share(opened, COARSEST), share(whole, COARSEST) + 0.05)

    def test_edges_are_drawn_unless_they_are_not_wanted(self):
        shapes = ("--color", "block", "--clip", "none", "--size", "640x480", "--no-shadows")
        dark = [int((self.draw(*shapes, option).max(axis=2) < 80).sum()) for option in ("--edges", "--no-edges")]
        self.assertGreater(dark[0], dark[1] + 1000)

    def write_fields(self):
        """The mesh in one file, with the x of its points and cells, and what that means."""
        reader = vtkXMLPUnstructuredGridReader()
        reader.SetFileName(f"{self.folder}/hexahedra/torus.pvtu")
        reader.Update()
        grid = reader.GetOutput()
        centres = vtkCellCenters()
        centres.SetInputData(grid)
        centres.Update()
        points = vtk_to_numpy(grid.GetPoints().GetData())
        middle = vtk_to_numpy(centres.GetOutput().GetPoints().GetData())
        side, nowhere = vtkStringArray(), numpy_to_vtk(np.full(len(middle), np.nan), deep=True)
        for x, _, _ in middle:
            side.InsertNextValue("west" if x < 0 else "east")
        wind = points * [[1, 0, 0]]
        wind[0] = np.nan
        arrays = {"warmth": points[:, 0].copy(), "wind": wind}
        for name, array in arrays.items():
            array = numpy_to_vtk(array, deep=True)
            array.SetName(name)
            grid.GetPointData().AddArray(array)
        for name, array in (("where", side), ("nowhere", nowhere)):
            array.SetName(name)
            grid.GetCellData().AddArray(array)
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetFileName(f"{self.folder}/hexahedra/fields.vtu")
        writer.SetInputData(grid)
        writer.Write()
        return f"{self.folder}/hexahedra/fields.vtu"

    def draw_field(self, export, by):
        run = subprocess.run([ARGUMENTS.picture, export, "-o", f"{self.folder}/field.png", "--color", by, "--clip",
                              "none", "--up", "z", "--size", "640x480", "--no-shadows", "--no-edges"],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        self.assertEqual((run.returncode, run.stdout), (0, ""))
        # From the top to the bottom.
        return pixels(f"{self.folder}/field.png")[::-1]

    def test_fields_have_colours_from_the_lowest_to_the_highest_value(self):
        export = self.write_fields()
        # From the front right: x grows to the right, and somewhat away from the camera.
        warmth = self.draw_field(export, "warmth")
        blue = warmth[..., 2] > warmth[..., 0] + 25
        red = warmth[..., 0] > warmth[..., 2] + 25
        # Below the legend.
        columns = [np.argwhere(mask[140:])[:, 1] for mask in (blue, red)]
        self.assertGreater(min(map(len, columns)), 5000)
        self.assertLess(columns[0].mean() + 60, columns[1].mean())
        # The bar of the legend, and both its ends in dark letters beside it.
        legend = warmth[45:70]
        bar = np.flatnonzero((np.abs(legend[12] - (0x30, 0x36, 0x5F)) < 12).all(axis=1))
        ink = np.argwhere(legend.max(axis=2) < 90)[:, 1]
        self.assertGreater((ink < bar[0]).sum(), 15)
        self.assertGreater((ink > bar[0] + 12 * 640 / 45).sum(), 15)
        # The length of a vector has no sign: both ends are red.
        wind = self.draw_field(export, "wind")
        both = np.argwhere((wind[..., 0] > wind[..., 2] + 25)[140:])[:, 1]
        self.assertLess(both.min() + 200, both.max())
        side = self.draw_field(export, "where")
        for color in (BLUE, ORANGE):
            self.assertGreater(share(side, color), 0.05)
        code, said = self.refused(ARGUMENTS.picture, export, "-o", f"{self.folder}/a.png", "--color", "nowhere")
        self.assertEqual((code, said), (1, "ndmap-picture: array 'nowhere' has no finite number to draw"))

    def test_two_views_side_by_side_as_wide_as_asked(self):
        picture = self.draw("--color", "block,state", "--size", "1000x400")
        self.assertEqual(picture.shape, (400, 1000, 3))
        for half in (picture[:, :500], picture[:, 500:]):
            self.assertGreater(float((half.min(axis=2) < 250).mean()), 0.1)

    def test_several_pictures_at_once_find_displays_of_their_own(self):
        runs = [self.start("--size", "300x200", output=f"at_once_{i}.png") for i in range(4)]
        for run in runs:
            _, complaint = run.communicate()
            self.assertEqual((run.returncode, complaint), (0, ""))
        for i in range(4):
            self.assertEqual(pixels(f"{self.folder}/at_once_{i}.png").shape, (200, 300, 3))

    def refused(self, *command, environment=None):
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
        return run.returncode, run.stdout.strip()

    def test_what_cannot_be_drawn_gives_one_line(self):
        good = f"{self.folder}/hexahedra/torus.pvtu"
        empty = f"{self.folder}/hexahedra/torus & blocks_4.vtu"
        broken = f"{self.folder}/broken.vtu"
        with open(broken, "w") as file:
            file.write("<VTKFile")
        for export, output, part in ((f"{self.folder}/no.pvtu", "a.png", "no.pvtu: no such file"),
                                     (empty, "a.png", "has no cells to draw"),
                                     (broken, "a.png", "cannot be read"),
                                     (good, "no/such/a.png", "a.png: cannot be written")):
            code, said = self.refused(ARGUMENTS.picture, export, "-o", f"{self.folder}/{output}", "--size", "300x200")
            self.assertEqual(code, 1, said)
            self.assertIn(part, said)
            self.assertEqual(len(said.splitlines()), 1, said)
            self.assertFalse(os.path.exists(f"{self.folder}/a.png"))
        code, said = self.refused(ARGUMENTS.picture, good, "-o", f"{self.folder}/a.png", "--color", "colour")
        self.assertEqual((code, said), (1, "ndmap-picture: the export has no array 'colour', it has block, first, id, level, number, "
                                      "place, side, state"))
        code, said = self.refused(ARGUMENTS.picture, good, "-o", f"{self.folder}/a.png", "--color", "level,")
        self.assertEqual(code, 2)
        self.assertIn("'level,' is not the name of an array", said)

    def test_says_what_to_install(self):
        code, said = self.refused("/bin/sh", ARGUMENTS.picture, "a.pvtu", "-o", "a.png", environment={"PATH": "/none"})
        self.assertEqual(code, 3)
        self.assertIn("apt-get install --no-install-recommends xvfb xauth", said)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write-torus", required=True, help="the program of write_torus.cc")
    parser.add_argument("--picture", required=True, help="ndmap-picture")
    ARGUMENTS, rest = parser.parse_known_args()
    unittest.main(argv=sys.argv[:1] + rest)
