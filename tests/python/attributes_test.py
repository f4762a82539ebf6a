# SPDX-License-Identifier: GPL-3.0-or-later
"""Attributes of the cells of a real map, against what numpy makes of the same cells."""
import math
import threading
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

import ndmap
from cluster import ClusterTest
from ndmap.connection import server_name
from ndmap.v1 import attributes_pb2 as pb

CUBES = ndmap.Grid((3, 3, 3), (0, 0, 0), (3, 3, 3))


def warmth(point):
    """A linear function: the mean of a cell's corners is its value at the centre, here without any rounding."""
    return 20 + 4 * point[:, 0] - 2 * point[:, 1] + point[:, 2] / 2


class AttributesTest(ClusterTest):
    def cubes(self, name="cubes", blocks=4):
        """27 unit cubes, of which the one in the middle can be split."""
        made = self.client.create_map(name, None, grid=CUBES, blocks=blocks)
        self.addCleanup(self.client.delete_map, name)
        return made

    def test_a_field_is_computed_in_one_line_and_follows_refinement(self):
        cubes = self.cubes()
        cubes.define("warmth", on="vertices", split="mean").result()
        self.assertEqual(cubes.compute("warmth", warmth, "@point"), ndmap.Written(64))
        cubes.refine(2, "box", lo=(1.4, 1.4, 1.4), hi=(1.6, 1.6, 1.6)).result()
        values = cubes.read("warmth", "@point", "@level")
        self.assertEqual(values.ids, cubes.cells(0))
        self.assertGreater(len(values), 64)
        np.testing.assert_array_equal(values["warmth"], warmth(values["@point"]))
        self.assertEqual(sorted(set(values["@level"].tolist())), [0, 1, 2])
        # Each on its own, as another question tells them.
        for row in range(0, len(values), 7):
            np.testing.assert_array_equal(cubes.cell(values.ids[row]).points[0], values["@point"][row])
        half = values.rows(values["warmth"] < 24)
        self.assertEqual(cubes.write("warmth", half, half["warmth"] + 100).written, len(half))
        again = cubes.read("warmth", ids=values)
        self.assertEqual(again.ids, values.ids)
        np.testing.assert_array_equal(again["warmth"], np.where(values["warmth"] < 24, values["warmth"] + 100, values["warmth"]))

    def test_every_type_on_every_dimension(self):
        cubes = self.cubes()
        kinds = {
            "double": lambda n: np.arange(n) / 3,
            "int64": lambda n: np.arange(n) - (1 << 62),
            "vec3": lambda n: np.arange(3.0 * n).reshape(n, 3) * 1e-300,
            "category": lambda n: [f"größe {i % 5}" for i in range(n)],
        }
        for dimension, on in enumerate(("vertices", "edges", "faces", "hexahedra")):
            ids = cubes.cells(dimension)
            for kind, values in kinds.items():
                with self.subTest(on=on, kind=kind):
                    name = f"{kind}.{on}"
                    cubes.define(name, on=on, type=kind).result()
                    self.assertEqual(cubes.write(name, ids, values(len(ids))).written, len(ids))
                    read = cubes.read(name)
                    self.assertEqual(read.ids, ids)
                    self.assertEqual(np.array_equal(read[name], values(len(ids))), True)
            self.assertEqual(cubes.read("@level", on=on, ids=ids)["@level"].tolist(), [0] * len(ids))
        self.assertEqual(len(cubes.attributes()), 16)
        self.assertEqual({each.on for each in cubes.refresh().attributes}, {"vertices", "edges", "faces", "hexahedra"})

    def test_what_new_hexahedra_get(self):
        cubes = self.cubes()
        for name, options in (
            ("copied", {"fill": 3.0}),
            ("mass", {"split": "divide", "fill": 8.0}),
            ("nothing", {"split": "zero", "type": "int64", "fill": 5}),
            ("rock", {"type": "category", "fill": "chalk"}),
        ):
            cubes.define(name, on="hexahedra", **options).result()
        cubes.set("rock", "clay", ids=["h13"])
        cubes.set("copied", 4.0, ids="h13")
        cubes.refine(1, "list", cells="h13").result()
        new = cubes.read("copied", "mass", "nothing", "rock", "@volume", levels=1)
        self.assertEqual(new.ids.text(), [f"h13/{i}" for i in range(8)])
        self.assertEqual((set(new["copied"]), set(new["mass"]), set(new["nothing"])), ({4.0}, {1.0}, {0}))
        self.assertEqual((set(new["rock"]), set(new["@volume"])), ({"clay"}, {0.125}))
        self.assertEqual(cubes.aggregate("mass").sum, 27 * 8)
        self.assertEqual(cubes.read("nothing", levels=0)["nothing"].tolist(), [5] * 26)

    def test_cells_are_chosen_by_ids_box_level_and_question(self):
        cubes = self.cubes()
        cubes.define("mark", on="vertices", type="int64").result()
        cubes.define("group", on="hexahedra", type="category").result()
        corner = ((0, 0, 0), (0.5, 0.5, 0.5))
        self.assertEqual(cubes.set("mark", 1, box=corner).written, 8)
        self.assertEqual(cubes.read("mark", box=corner)["mark"].tolist(), [1] * 8)
        self.assertEqual(cubes.aggregate("mark").sum, 8)
        self.assertEqual(cubes.set("group", "beside", where="h13", close="32").written, 7)
        self.assertEqual(cubes.set("group", "middle", where=ndmap.PointAnchor((1.5, 1.5, 1.5))).written, 1)
        self.assertEqual({name: each.count for name, each in cubes.aggregate(by="category:group").items()},
                         {"": 20, "beside": 6, "middle": 1})
        self.assertEqual(cubes.read("group", box=((1.2,) * 3, (1.3,) * 3)).ids.text(), ["h13"])
        self.assertEqual(cubes.set("mark", 7).written, 64)
        self.assertEqual(cubes.set("mark", 9, levels=(1, 5)).written, 0)
        self.assertEqual(cubes.aggregate("mark", by="level")[0].min, 7)

    def test_cells_that_are_not_there(self):
        cubes = self.cubes()
        cubes.define("age", on="hexahedra", type="int64").result()
        cubes.refine(1, "list", cells="h13").result()
        ids = ["h14", "h13", "h13/0", "h99"]
        self.assertEqual(cubes.write("age", ids, [1, 2, 3, 4]), ndmap.Written(2, 2, ("h13", "h99")))
        self.fails(ndmap.NotFoundError, "has no h13, h99: 2 of 4 cells", cubes.read, "age", ids=ids)
        there = cubes.read("age", ids=ids, skip_missing=True)
        self.assertEqual((there.ids.text(), there["age"].tolist()), (["h14", "h13/0"], [1, 3]))

    def test_aggregates_are_those_of_numpy_whatever_the_blocks(self):
        sums = set()
        for blocks in (1, 2, 5):
            with self.subTest(blocks=blocks):
                made = self.create(f"torus{blocks}", blocks=blocks)
                made.refine(1).result()
                made.trim().result()
                made.define("height", on="vertices").result()
                made.define("heat", on="hexahedra").result()
                made.define("side", on="hexahedra", type="category").result()
                made.compute("height", lambda point: np.sin(9 * point[:, 0]) * 1e10 ** point[:, 2], "@point")
                made.compute("heat", lambda point: point[:, 0], "@point")
                made.compute("side", lambda point: np.where(point[:, 0] < 0, "west", "east"), "@point")
                heights = made.read("height", "@level")
                whole = made.aggregate("height", histogram=(7, -1.0, 1.0), integral=True)
                self.assertEqual(whole.sum, math.fsum(heights["height"]))
                self.assertEqual((whole.count, whole.not_finite), (len(heights), 0))
                self.assertEqual((whole.min, whole.max), (heights["height"].min(), heights["height"].max()))
                inside = np.histogram(heights["height"], whole.edges)[0]
                self.assertEqual(whole.histogram.tolist(), inside.tolist())
                self.assertEqual(whole.below + whole.above + inside.sum(), len(heights))
                by_level = made.aggregate("height", by="level")
                for level, group in by_level.items():
                    self.assertEqual(group.sum, math.fsum(heights["height"][heights["@level"] == level]))
                cells = made.read("heat", "side", "@volume", "@block", "@point")
                for side, group in made.aggregate("heat", by="category:side").items():
                    self.assertEqual(group.count, (cells["side"] == side).sum())
                    self.assertEqual(group.sum, math.fsum(cells["heat"][cells["side"] == side]))
                over = made.aggregate("heat", integral=True, levels=1)
                fine = made.read("heat", "@volume", levels=1)
                self.assertEqual(over.integral, math.fsum(fine["heat"] * fine["@volume"]))
                self.assertEqual(over.volume, math.fsum(fine["@volume"]))
                by_block = made.aggregate("@volume", by="block")
                self.assertEqual(list(by_block), list(range(blocks)))
                self.assertEqual([group.count for group in by_block.values()], np.bincount(cells["@block"]).tolist())
                sums.add((whole.sum, whole.integral, over.integral, made.aggregate("@volume").sum))
        self.assertEqual(len(sums), 1)

    def test_cells_need_no_attribute_to_be_counted_and_read(self):
        seen = set()
        for blocks in (1, 4):
            cubes = self.cubes(f"bare{blocks}", blocks)
            cubes.refine(1, "list", cells="h13").result()
            for dimension, on in enumerate(("vertices", "edges", "faces", "hexahedra")):
                with self.subTest(blocks=blocks, on=on):
                    ids = cubes.cells(dimension)
                    self.assertEqual(cubes.aggregate(on=on).count, len(ids))
                    values = cubes.read("@point", "@level", "@block", on=on)
                    self.assertEqual(values.ids, ids)
                    levels = {level: group.count for level, group in cubes.aggregate(on=on, by="level").items()}
                    self.assertEqual(list(levels.values()), np.bincount(values["@level"]).tolist())
                    in_blocks = [group.count for group in cubes.aggregate(on=on, by="block").values()]
                    self.assertEqual(in_blocks, np.bincount(values["@block"]).tolist())
                    some = cubes.read("@point", "@block", ids=ids[5:9], on=on)
                    np.testing.assert_array_equal(some["@point"], values["@point"][5:9])
                    np.testing.assert_array_equal(some["@block"], values["@block"][5:9])
                    seen.add((on, ids.text()[-1], values["@point"].tobytes(), str(levels)))
            self.assertEqual(cubes.aggregate("@volume").sum, 27.0)
        self.assertEqual(len(seen), 4)

    def test_two_clients_that_write_the_same_vertices_leave_one_value_everywhere(self):
        cubes = self.cubes()
        cubes.define("who", on="vertices", type="int64").result()
        ids = cubes.cells(0)
        barrier = threading.Barrier(2)

        def write(who):
            with ndmap.connect(self.cluster.address) as client:
                made = client.open_map("cubes")
                barrier.wait()
                for turn in range(10):
                    made.write("who", ids, np.full(len(ids), 100 * who + turn))

        writers = [threading.Thread(target=write, args=(who,)) for who in (1, 2)]
        for writer in writers:
            writer.start()
        for writer in writers:
            writer.join()
        request = pb.ReadAttributesRequest(map="cubes", dimension=0, names=["who"],
                                           select=pb.CellSelection(all=pb.CellSelection.All()))
        answers = set()
        for address in cubes.info.servers():
            stub = cubes._connection.block_server(address)
            parts = cubes._connection.guarded(lambda: list(stub.ReadAttributes(request, timeout=30)), server_name(address))
            answers.add(tuple(value for part in parts for value in part.columns[0].integers))
        self.assertEqual(len(cubes.info.servers()), 2)
        values = {value for answer in answers for value in answer}
        self.assertEqual(len(values), 1, values)
        self.assertIn(values.pop(), (109, 209))

    def test_meshes_have_the_values(self):
        made = self.create("fields")
        made.define("warmth", on="vertices", split="mean").result()
        made.define("wind", on="vertices", type="vec3").result()
        made.define("area", on="faces").result()
        made.define("rock", on="hexahedra", type="category").result()
        made.compute("warmth", warmth, "@point")
        made.compute("wind", lambda point: -point, "@point")
        made.compute("rock", lambda point: np.where(point[:, 2] < 0, "clay", "chalk"), "@point")
        made.refine(2).result()
        made.compute("warmth", warmth, "@point")
        made.compute("wind", lambda point: -point, "@point")
        made.compute("rock", lambda point: np.where(point[:, 2] < 0, "clay", "chalk"), "@point")
        made.trim().result()
        mesh = made.to_meshio()
        self.assertEqual(sorted(mesh.point_data), ["id", "warmth", "wind"])
        np.testing.assert_array_equal(mesh.point_data["warmth"], warmth(mesh.points))
        np.testing.assert_array_equal(mesh.point_data["wind"], -mesh.points)
        centres = mesh.points[mesh.cells_dict["hexahedron"]].mean(axis=1)
        rocks = np.array(mesh.info["categories"]["rock"])[mesh.cell_data["rock"][0]]
        np.testing.assert_array_equal(rocks, np.where(centres[:, 2] < 0, "clay", "chalk"))
        for cells in ("hexahedron", "polyhedron"):
            grid = made.to_vtk(cells)
            points = vtk_to_numpy(grid.GetPoints().GetData())
            np.testing.assert_array_equal(vtk_to_numpy(grid.GetPointData().GetArray("warmth")), warmth(points))
            np.testing.assert_array_equal(vtk_to_numpy(grid.GetPointData().GetArray("wind")), -points)
            texts = grid.GetCellData().GetAbstractArray("rock")
            told = {int(vtk_to_numpy(grid.GetCellData().GetArray("id"))[i]): texts.GetValue(i)
                    for i in range(grid.GetNumberOfCells())}
            self.assertEqual(told, dict(zip(mesh.cell_data["id"][0].tolist(), rocks.tolist())))
        self.assertEqual(sorted(made.to_meshio(["warmth"]).point_data), ["id", "warmth"])
        self.assertEqual(sorted(made.to_meshio([]).cell_data), ["block", "id", "level", "state"])
        self.fails(ndmap.NotFoundError, "no attribute 'colour'", made.to_vtk, attributes=["colour"])
        self.fails(ndmap.InvalidArgumentError, "'area' is on faces", made.to_meshio, "area")

    def test_names_come_and_go(self):
        cubes = self.cubes()
        result = cubes.define("heat", on="vertices", fill=1.5).result()
        self.assertEqual((result.kind, result.state), ("define attribute", "done"))
        first, = cubes.attributes()
        self.assertEqual((first.name, first.on, first.type, first.split, first.fill),
                         ("heat", "vertices", "double", "copy", 1.5))
        self.fails(ndmap.AlreadyExistsError, "heat", cubes.define, "heat", on=3)
        self.assertEqual(cubes.drop("heat").result().kind, "drop attribute")
        self.assertEqual(cubes.attributes(), [])
        self.fails(ndmap.NotFoundError, "heat", cubes.read, "heat")
        self.fails(ndmap.NotFoundError, "heat", cubes.write, "heat", "v0:0", 1)
        self.fails(ndmap.NotFoundError, "heat", cubes.aggregate, "heat")
        self.fails(ndmap.NotFoundError, "heat", cubes.drop, "heat")
        cubes.define("heat", on="hexahedra", type="int64").result()
        second, = cubes.attributes()
        self.assertGreater(second.number, first.number)
        self.assertEqual(cubes.read("heat")["heat"].tolist(), [0] * 27)

    def test_what_the_services_refuse(self):
        cubes = self.cubes()
        for options, words in (
            ({"name": "a b", "on": 0}, "a b"),
            ({"name": "", "on": 0}, "name"),
            ({"name": "x", "on": 3, "split": "mean"}, "mean and midpoint are for numbers on vertices"),
            ({"name": "x", "on": 0, "split": "divide"}, "divide is for"),
            ({"name": "x", "on": 0, "type": "category", "split": "midpoint"}, "mean and midpoint"),
        ):
            with self.subTest(**options):
                self.fails(ndmap.InvalidArgumentError, words, cubes.define, **options)
        cubes.define("heat", on="vertices").result()
        self.fails(ndmap.InvalidArgumentError, "@volume", cubes.read, "@volume", "heat")
        long = cubes.refine(12, "box", lo=(1.01, 1.01, 1.01), hi=(1.02, 1.02, 1.02))
        try:
            self.fails(ndmap.FailedPreconditionError, f"job {long.id}", cubes.define, "more", on=0)
        finally:
            long.cancel()
            with self.assertRaises(ndmap.JobCancelledError):
                long.result()
        self.assertEqual(len(cubes.read("heat")), len(cubes.cells(0)))


if __name__ == "__main__":
    unittest.main()
