#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports of maps made from meshes, read by VTK's own reader: they have the cells and points of the file, every cell the
right way round, and fit together; and a map made of an export is the same map.

  mesh_export_test.py --bin build/release/bin [--meshes FOLDER]

One small mesh is always tried, those of FOLDER when it is there.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import unittest

import check_vtu

BIN = MESHES = None
KINDS = ("tetrahedra", "pyramids", "prisms", "hexahedra")
# A cube, a prism beside it, a pyramid on the cube, a tetrahedron on the prism.
SMALL = """MeshVersionFormatted 1
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
# Points, and cells by kind, as the list of the meshes has them.
WHOLE = {
    "su2_brick_hex.vtu": (16000, (0, 0, 0, 14079)),
    "unstructured_hex_400.msh": (573, (0, 0, 0, 400)),
    "hand_tet.mesh": (7234, (29998, 0, 0, 0)),
    "piece_tet.msh": (3915, (13179, 0, 0, 0)),
    "nozzle_hybrid_tet_prism.msh": (3493, (4643, 0, 4614, 0)),
    "sphere_hybrid_tet_prism.msh": (1957, (2695, 0, 2556, 0)),
    "hybrid_tet_prism_pyramid.msh": (638, (765, 40, 640, 0)),
    "fichera-mixed.mfem.mesh": (26, (5, 0, 6, 3)),
    "mixed_all4.mfem.mesh": (11, (1, 1, 1, 1)),
}


class MeshExportTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(temporary.cleanup)
        cls.folder = temporary.name
        cls.small = os.path.join(cls.folder, "small.mesh")
        with open(cls.small, "w", encoding="utf-8") as out:
            out.write(SMALL)
        cls.up = subprocess.Popen(
            [os.path.join(BIN, "ndmap"), "up", "--processes", "2", "--threads", "1", "--json"],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        cls.addClassCleanup(cls.stop)
        text = ""
        while not text.endswith("}\n"):
            line = cls.up.stdout.readline()
            if not line:
                raise AssertionError(f"ndmap up ended, after saying: {text}")
            text += line
        cls.coordinator = json.loads(text)["coordinator"]

    @classmethod
    def stop(cls):
        cls.up.terminate()
        cls.up.wait()
        cls.up.stdout.close()

    def ndmap(self, *arguments):
        command = [os.path.join(BIN, "ndmap"), *map(str, arguments), "--json", "--coordinator", self.coordinator]
        run = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(run.returncode, 0, f"{arguments}: {run.stderr}")
        return json.loads(run.stdout)

    def export(self, name, cells="hexahedron"):
        """The index, and what VTK and check_vtu find in it, without a fault."""
        folder = os.path.join(self.folder, f"{name}-{cells}")
        index = self.ndmap("export", name, "-o", folder, "--cells", cells)["index"]
        report = check_vtu.check_export(index, fits=True, flat=False)
        self.assertEqual(report["errors"], [])
        return index, report

    def delete_all(self):
        for one in self.ndmap("maps")["maps"]:
            self.ndmap("delete", one["map"])

    def try_mesh(self, path, points, cells):
        self.delete_all()
        # In several blocks: the counts of the file, and the pieces fit together.
        self.ndmap("create", "whole", "--mesh", path, "--blocks", 3, "--partition", "metis")
        made = self.ndmap("hash", "whole")["hash"]
        _, report = self.export("whole")
        self.assertEqual(report["distinct_points"], points)
        self.assertEqual([report[kind] for kind in KINDS], list(cells))
        self.assertEqual(report["pieces"], 3)
        # In one block: what was written is read as the same mesh, and makes the same map.
        self.ndmap("create", "whole-one", "--mesh", path, "--blocks", 1)
        index, _ = self.export("whole-one")
        piece = check_vtu.piece_files(index)[0]
        self.assertEqual([self.ndmap("inspect", piece)["cells"][kind] for kind in KINDS], list(cells))
        self.ndmap("create", "again", "--mesh", piece, "--blocks", 2)
        self.assertEqual(self.ndmap("hash", "again")["hash"], made)
        # Hexahedra refined beside others: every face of the polyhedra joins two cells or is on the border.
        if cells[3]:
            self.ndmap("refine", "whole", "--oracle", "everything", "--depth", 1)
            _, fine = self.export("whole", "polyhedron")
            self.assertEqual(fine["cells"], sum(cells[:3]) + 8 * cells[3])
            self.assertAlmostEqual(fine["volume"] / report["volume"], 1, places=9)

    def test_small(self):
        self.try_mesh(self.small, 12, (1, 1, 1, 1))

    def test_meshes_of_the_folder(self):
        if MESHES is None or not os.path.isdir(MESHES):
            return
        for file, (points, cells) in WHOLE.items():
            with self.subTest(file):
                self.try_mesh(os.path.join(MESHES, file), points, cells)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", required=True)
    parser.add_argument("--meshes")
    options, rest = parser.parse_known_args()
    BIN, MESHES = options.bin, options.meshes
    unittest.main(argv=[sys.argv[0], *rest])
