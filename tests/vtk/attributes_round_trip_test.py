#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes through everything that a mesh goes through: defined, written, split, removed, exported, read by VTK,
written again by VTK in every encoding, and imported into another map of the same shape, in other blocks.

  attributes_round_trip_test.py --bin BUILD/bin
"""

import argparse
import csv
import io
import json
import os
import shutil
import subprocess
import tempfile
import unittest
from collections import Counter

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkFiltersCore import vtkThreshold
from vtkmodules.vtkIOXML import (vtkXMLPUnstructuredGridReader, vtkXMLUnstructuredGridReader,
                                 vtkXMLUnstructuredGridWriter)

BIN = None
vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)


def run(*arguments, text=None, code=0):
    """Standard output (and error, when it fails as it should) of ndmap."""
    done = subprocess.run([os.path.join(BIN, "ndmap"), *map(str, arguments)], input=text, stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, timeout=100, check=False)
    assert done.returncode == code, (arguments, done.returncode, done.stderr)
    return done.stdout if code == 0 else done.stderr


def rows(text):
    """CSV as a dictionary from id to the other columns."""
    table = list(csv.reader(io.StringIO(text)))
    return {row[0]: tuple(row[1:]) for row in table[1:]}


def read(path):
    """The grid that VTK makes of a file, without a complaint."""
    window = vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    reader = vtkXMLPUnstructuredGridReader() if path.endswith(".pvtu") else vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    assert not window.GetOutput(), window.GetOutput()
    return reader.GetOutput()


class RoundTrip(unittest.TestCase):
    ATTRIBUTES = {
        "height": ["--dim", 0, "--type", "double", "--split", "mean"],
        "speed": ["--dim", 0, "--type", "vec3", "--split", "midpoint", "--fill", "1,2,3"],
        "count": ["--dim", 3, "--type", "int64", "--split", "copy", "--fill", "7"],
        "mass": ["--dim", 3, "--type", "double", "--split", "divide"],
        "rock": ["--dim", 3, "--type", "category", "--split", "copy"],
        "mark": ["--dim", 0, "--type", "category", "--split", "zero", "--fill", "old"],
    }

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="ndmap-attributes-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        torus = os.path.join(cls.folder, "torus.off")
        run("sample", "torus", "-o", torus, "--triangles", 2000)
        up = subprocess.Popen([os.path.join(BIN, "ndmap"), "up", "--processes", "3", "--json"],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        cls.addClassCleanup(lambda: (up.terminate(), up.wait(), up.stdout.close()))
        said = ""
        while not said.endswith("\n}\n"):
            line = up.stdout.readline()
            assert line, "the cluster ended"
            said += line
        os.environ["NDMAP_COORDINATOR"] = json.loads(said)["coordinator"]
        for name, blocks in (("one", 8), ("two", 3)):
            run("create", name, torus, "--grid", "6x6x3", "--blocks", blocks)
            for attribute, options in cls.ATTRIBUTES.items():
                run("attr", "define", name, attribute, *options)
        cls.write_values()
        # Splits, of which some are next to others, and removes.
        for name in ("one", "two"):
            run("refine", name, "--depth", 1, "--oracle", "sphere", "--centre", "1,0,0", "--radius", 0.6)
            run("refine", name, "--depth", 2, "--oracle", "list", "--cells", "h50 h50/0 h50/7")
            run("trim", name)
        cls.mesh = os.path.join(cls.folder, "mesh")
        cls.note = subprocess.run([os.path.join(BIN, "ndmap"), "export", "one", "-o", cls.mesh, "--cells", "polyhedron"], check=True,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True).stderr

    @classmethod
    def write_values(cls):
        points = rows(run("attr", "read", "one", "@point", "--dim", 0, "--all", "-o", "csv"))
        table = ["id,height,speed:0,speed:1,speed:2"]
        for cell, (x, y, z) in points.items():
            x, y, z = float(x), float(y), float(z)
            table.append(f"{cell},{0.1 + x + 2 * y + 3 * z!r},{y!r},{0 - z!r},{x * y + 0.0!r}")
        text = "\n".join(table) + "\n"
        run("attr", "write", "one", "height", text=text)
        run("attr", "write", "one", "speed", text=text)
        run("attr", "set", "one", "mass", 60, "--all")
        run("attr", "set", "one", "count", -3, "--box", "0,0,0", "2,2,2")
        run("attr", "set", "one", "rock", "k\u00e4se, \"hart\"", "--box", "-2,-2,-2", "0,0,0")
        run("attr", "set", "one", "rock", "basalt", "--box", "0,-2,-2", "2,0,2")

    def values(self, name, attribute):
        return rows(run("attr", "read", name, attribute, "--all", "-o", "csv"))

    def import_all(self, path):
        for attribute in self.ATTRIBUTES:
            run("attr", "write", "two", attribute, "--from", path)

    def check_equal(self, what):
        for attribute in self.ATTRIBUTES:
            one, two = self.values("one", attribute), self.values("two", attribute)
            differing = [(cell, one.get(cell), two.get(cell)) for cell in one.keys() | two.keys() if one.get(cell) != two.get(cell)]
            self.assertEqual(differing[:5], [], (what, attribute, len(differing)))

    def reset(self):
        """Other values than those of the file."""
        for attribute, value in (("height", "nan"), ("speed", "9,9,9"), ("count", 99), ("mass", -1),
                                 ("rock", "nothing"), ("mark", "nothing")):
            run("attr", "set", "two", attribute, value, "--all")

    def test_values_went_through_split_and_removal(self):
        points = rows(run("attr", "read", "one", "@point", "--dim", 0, "--all", "-o", "csv"))
        height = self.values("one", "height")
        self.assertEqual(points.keys(), height.keys())
        # Means of a linear function are the function.
        for cell, (x, y, z) in points.items():
            wanted = 0.1 + float(x) + 2 * float(y) + 3 * float(z)
            self.assertAlmostEqual(float(height[cell][0]), wanted, places=12)
        levels = rows(run("attr", "read", "one", "mass", "@level", "--all", "-o", "csv"))
        for cell, (mass, level) in levels.items():
            self.assertEqual(float(mass), 60 / 8 ** int(level), cell)
        self.assertEqual({level for _, level in levels.values()}, {"0", "1", "2"})
        marks = self.values("one", "mark")
        self.assertEqual({mark for mark, in marks.values()}, {"old", ""})

    def test_what_vtk_reads_is_what_the_map_has(self):
        grid = read(os.path.join(self.mesh, "mesh.pvtu"))
        height = self.values("one", "height")
        ids = vtk_to_numpy(grid.GetPointData().GetArray("id"))
        # Points that three and more blocks have, which all have the same value.
        shared = [number for number, count in Counter(ids.tolist()).items() if count >= 3]
        self.assertGreater(len(shared), 4)
        by_id = {}
        for number, value in zip(ids.tolist(), vtk_to_numpy(grid.GetPointData().GetArray("height")).tolist()):
            self.assertEqual(by_id.setdefault(number, value), value)
        self.assertEqual(sorted(by_id.values()), sorted(float(value) for value, in height.values()))
        points = vtk_to_numpy(grid.GetPoints().GetData())
        linear = 0.1 + points @ np.array([1.0, 2.0, 3.0])
        np.testing.assert_allclose(vtk_to_numpy(grid.GetPointData().GetArray("height")), linear, atol=1e-12)
        self.assertEqual(grid.GetPointData().GetArray("speed").GetNumberOfComponents(), 3)
        texts = grid.GetCellData().GetAbstractArray("rock")
        counted = Counter(texts.GetValue(i) for i in range(texts.GetNumberOfValues()))
        self.assertEqual(counted, Counter(rock for rock, in self.values("one", "rock").values()))
        self.assertEqual(len(counted), 3)
        groups = json.loads(run("agg", "one", "--by", "category:rock", "--json"))["groups"]
        self.assertEqual({group["group"]: group["count"] for group in groups}, dict(counted))
        mass = vtk_to_numpy(grid.GetCellData().GetArray("mass"))
        total = json.loads(run("agg", "one", "mass", "--json"))["groups"][0]
        self.assertEqual(total["sum"], [float(mass.sum())])
        self.assertEqual(total["count"], len(mass))

    def test_import_of_the_export(self):
        self.reset()
        self.import_all(os.path.join(self.mesh, "mesh.pvtu"))
        self.check_equal("pvtu")

    def test_import_of_polyhedra(self):
        folder = os.path.join(self.folder, "polyhedra")
        run("export", "one", "-o", folder, "--cells", "polyhedron")
        self.reset()
        self.import_all(os.path.join(folder, "mesh.pvtu"))
        self.check_equal("polyhedra")

    def test_import_of_what_vtk_wrote_again(self):
        grid = read(os.path.join(self.mesh, "mesh.pvtu"))
        for mode in ("Ascii", "Binary", "Appended"):
            for compressor in ("None", "ZLib", "LZMA"):
                writer = vtkXMLUnstructuredGridWriter()
                writer.SetInputData(grid)
                getattr(writer, f"SetDataModeTo{mode}")()
                getattr(writer, f"SetCompressorTypeTo{compressor}")()
                path = os.path.join(self.folder, f"{mode}{compressor}.vtu")
                writer.SetFileName(path)
                self.assertEqual(writer.Write(), 1)
                self.reset()
                self.import_all(path)
                self.check_equal(os.path.basename(path))
                if mode == "Ascii":
                    break

    def test_part_of_the_mesh_from_a_filter(self):
        """What VTK's filters leave of an export still knows its cells."""
        threshold = vtkThreshold()
        threshold.SetInputData(read(os.path.join(self.mesh, "mesh.pvtu")))
        threshold.SetInputArrayToProcess(0, 0, 0, 1, "count")
        threshold.SetUpperThreshold(-1)
        threshold.SetThresholdFunction(vtkThreshold.THRESHOLD_LOWER)
        threshold.SetLowerThreshold(-1)
        threshold.Update()
        self.assertGreater(threshold.GetOutput().GetNumberOfCells(), 0)
        writer = vtkXMLUnstructuredGridWriter()
        writer.SetInputData(threshold.GetOutput())
        path = os.path.join(self.folder, "part.vtu")
        writer.SetFileName(path)
        writer.Write()
        run("attr", "set", "two", "count", 0, "--all")
        run("attr", "write", "two", "count", "--from", path)
        self.assertEqual({cell for cell, (count,) in self.values("two", "count").items() if count == "-3"},
                         {cell for cell, (count,) in self.values("one", "count").items() if count == "-3"})
        # Under another name, into another attribute.
        run("attr", "write", "two", "mass", "--from", path, "--array", "count")

    def test_what_does_not_fit_is_refused(self):
        mesh = os.path.join(self.mesh, "mesh.pvtu")
        self.assertIn("its points have no array 'nothing'",
                      run("attr", "write", "two", "height", "--from", mesh, "--array", "nothing", code=1))
        self.assertIn("components", run("attr", "write", "two", "height", "--from", mesh, "--array", "speed", code=1))
        self.assertIn("expected whole numbers",
                      run("attr", "write", "two", "count", "--from", mesh, "--array", "mass", code=1))
        torus = os.path.join(self.folder, "torus.off")
        run("create", "other", torus, "--grid", "2x2x2", "--blocks", 1)
        run("attr", "define", "other", "mass")
        self.assertIn("is the file an export of such a map",
                      run("attr", "write", "other", "mass", "--from", mesh, code=1))
        run("attr", "define", "other", "level")
        run("attr", "define", "other", "flux", "--dim", 2)
        done = subprocess.run([os.path.join(BIN, "ndmap"), "export", "other", "-o", os.path.join(self.folder, "o")],
                              check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.assertIn("note: left out: flux is of faces", done.stderr)
        self.assertIn("is of faces", run("export", "other", "-o", self.folder + "/p", "--attributes", "flux", code=1))
        run("export", "other", "-o", self.folder + "/none", "--attributes", "none")
        grid = read(self.folder + "/none/mesh.pvtu")
        self.assertEqual(grid.GetCellData().GetNumberOfArrays(), 4)
        self.assertIn("has no attribute 'none_such'",
                      run("export", "other", "-o", self.folder + "/p", "--attributes", "mass,none_such", code=1))
        run("export", "other", "-o", self.folder + "/mass", "--attributes", "mass")
        grid = read(self.folder + "/mass/mesh.pvtu")
        self.assertIsNotNone(grid.GetCellData().GetArray("mass"))
        self.assertEqual(grid.GetCellData().GetNumberOfArrays(), 5)
        # An attribute that is called as an array of every export.
        run("attr", "set", "other", "level", 5, "--ids", "h3")
        run("export", "other", "-o", self.folder + "/o")
        grid = read(self.folder + "/o/mesh.pvtu")
        self.assertEqual(sorted(vtk_to_numpy(grid.GetCellData().GetArray("level (attribute)")).tolist()), [0] * 7 + [5])
        run("attr", "set", "other", "level", -1, "--all")
        run("attr", "write", "other", "level", "--from", self.folder + "/o/mesh.pvtu")
        self.assertEqual(self.values("other", "level")["h3"], ("5.0",))
        run("delete", "other")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", required=True)
    options, rest = parser.parse_known_args()
    BIN = os.path.abspath(options.bin)
    unittest.main(argv=["attributes_round_trip_test.py", *rest])
