# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells, their ids and neighbourhoods, asked of a real cluster of three servers."""
import random
import unittest
from unittest import mock

import grpc
import numpy as np

import ndmap
from cluster import ClusterTest
from ndmap.v1 import block_service_pb2_grpc, navigate_pb2

# Two levels, next to unrefined hexahedra, with hanging vertices, edges and faces.
REFINED = "h0 h0/7 h4 h4/3"


def everything(made, give, dimension):
    return made.explore([ndmap.BlockAnchor(block) for block in range(made.info.block_count)], "", give, dimension)


class NavigateTest(ClusterTest):
    processes = 3

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.maps = {}
        for blocks in (1, 2, 8):
            made = cls.client.create_map(f"m{blocks}", cls.torus, grid="3x3x2", blocks=blocks)
            made.refine(2, "list", cells=REFINED).result()
            cls.maps[blocks] = made
        cls.eight = cls.maps[8]
        cls.all = [cls.eight.cells(dimension) for dimension in range(4)]

    def some(self, dimension, count):
        return random.Random(count + dimension).sample(list(self.all[dimension]), count)

    def test_the_same_ids_for_every_number_of_blocks(self):
        for made in self.maps.values():
            counts = [0] * 4
            for dimension, ids in enumerate(self.all):
                self.assertEqual(made.cells(dimension), ids)
                self.assertEqual(sorted(set(ids)), list(ids))
                counts[dimension] = len(ids)
            self.assertEqual(counts[0] - counts[1] + counts[2] - counts[3], 1)
            stats = made.stats().counts
            self.assertEqual((counts[0], counts[3]), (stats["vertices"], stats["hexahedra"]))
        self.assertEqual(len(set().union(*map(set, self.all))), sum(map(len, self.all)))

    def test_texts_are_those_of_the_server(self):
        address = self.eight.info.addresses[0]
        request = navigate_pb2.ExploreRequest(map="m8", give=navigate_pb2.GIVE_CELL_DETAILS)
        request.anchors.extend(navigate_pb2.Anchor(block=block) for block in range(8))
        with grpc.insecure_channel(address) as channel:
            for request.dimension in range(4):
                parts = list(block_service_pb2_grpc.BlockServiceStub(channel).Explore(request, timeout=60))
                cells = [cell for part in parts for cell in part.cells]
                self.assertEqual(len(cells), len(self.all[request.dimension]))
                for cell in cells:
                    parsed = ndmap.CellId.parse(cell.text)
                    self.assertEqual(parsed, ndmap.CellId(cell.id.hi, cell.id.lo))
                    self.assertEqual(str(parsed), cell.text)
                    self.assertEqual((parsed.dimension, parsed.level), (cell.dimension, cell.level))
                    if parsed.dimension == 3 and parsed.level:
                        self.assertEqual(str(parsed.parent), cell.text[:-2])

    def test_neighbours_are_mutual(self):
        made = self.eight
        for dimension in (0, 3):
            near = {cell: set(made.neighbors(cell)) for cell in self.all[dimension]}
            for cell, others in near.items():
                self.assertTrue(others and cell not in others)
                self.assertTrue(all(cell in near[other] for other in others), cell)
        for dimension in (1, 2):
            for cell in self.some(dimension, 10):
                for other in made.neighbors(cell):
                    self.assertIn(cell, made.neighbors(other))
        below = {cell: made.incident(cell, 2) for cell in self.all[3]}
        for face in self.all[2]:
            self.assertEqual(list(made.incident(face, 3)), [cell for cell in self.all[3] if face in below[cell]])
        # Across a face: the hexahedra that have one in common.
        for cell in self.all[3]:
            sharing = {other for other in below if other != cell and set(below[other]) & set(below[cell])}
            self.assertEqual(set(made.neighbors(cell)), sharing)

    def test_neighbourhoods_do_not_depend_on_the_blocks(self):
        for dimension in range(4):
            for cell in self.some(dimension, 3):
                for made in (self.maps[1], self.maps[2]):
                    for other in range(4):
                        self.assertEqual(made.incident(cell, other), self.eight.incident(cell, other))
                        if other != dimension:
                            self.assertEqual(made.ring(cell, 2, other), self.eight.ring(cell, 2, other))

    def test_a_ring_is_steps_to_neighbours(self):
        made = self.eight
        for dimension, through in ((3, None), (3, 0), (0, None), (1, 3)):
            cell = self.some(dimension, 1)[0]
            seen, front = {cell}, {cell}
            for k in range(1, 4):
                front = {other for at in front for other in made.neighbors(at, through)} - seen
                seen |= front
                self.assertEqual(set(made.ring(cell, k, through)), seen - {cell})
        self.assertEqual(made.ring("h8", 32), ndmap.CellIds.of(cell for cell in self.all[3] if str(cell) != "h8"))

    def test_details_tell_the_cell(self):
        for made in (self.maps[1], self.eight):
            for dimension in range(4):
                for cell in self.some(dimension, 5):
                    details = made.cell(str(cell))
                    self.assertEqual((details.id, details.dimension), (cell, dimension))
                    self.assertEqual((details.level, str(details)), (cell.level, str(cell)))
                    self.assertEqual(details.points.shape, (len(details.vertices), 3))
                    darts = made.orbit(cell)
                    self.assertEqual(len(darts), details.darts)
                    self.assertEqual(details.blocks, tuple(sorted(set(darts.block.tolist()))))
                    self.assertIn(details.dart, [at.dart for at in darts])
                    self.assertEqual(list(made.explore(details.dart, "", "cells", dimension)), [cell])
                    self.assertTrue(set(details.vertices) <= set(made.incident(cell, 0)))
                    free = made.beta(darts, "3").free
                    self.assertEqual(details.boundary, bool(free.any()))
        corner = self.eight.cell("h0/7.0")
        np.testing.assert_array_equal(corner.points[6] - corner.points[0] > 0, [False, True, True])
        self.assertEqual((corner.state, len(corner.vertices)), ("inside", 8))

    def test_an_orbit_is_what_betas_lead_to(self):
        for block in range(8):
            start = self.eight.any_dart(block)
            for i, words in ((0, ("2,1", "3,1", "0,2", "0,3")), (1, ("2", "3")), (2, ("1", "3")), (3, ("1", "2"))):
                orbit = self.eight.orbit(start, i)
                reached, front = {str(start.dart)}, [start]
                while front:
                    walks = [self.eight.beta(front, word) for word in words]
                    ends = [at for walk in walks for at, free in zip(walk.darts, walk.free) if not free]
                    front = [at for at in ends if not (str(at.dart) in reached or reached.add(str(at.dart)))]
                self.assertEqual({str(at.dart) for at in orbit}, reached)
                self.assertEqual(len(orbit), len(reached))
        self.assertEqual(set(self.eight.orbit(start, 3).cell), {start.cell})
        wider = self.eight.orbit("h8", 0)
        self.assertEqual(set(wider.cell), {"h8", *self.eight.neighbors("h8", 0).text()})

    def test_places_are_found(self):
        made = self.eight
        vertices = everything(made, "details", 0)
        self.assertEqual([vertex.id for vertex in vertices], list(self.all[0]))
        for vertex in vertices:
            found = made.nearest_vertex(vertex.points[0])
            self.assertEqual(found.id, vertex.id)
            np.testing.assert_array_equal(found.points, vertex.points)
        around = made.locate([vertex.points[0] for vertex in vertices])
        for vertex, cells in zip(vertices, around):
            self.assertEqual(cells, made.incident(vertex, 3))
        hexahedra = everything(made, "details", 3)
        inside = made.locate([cell.points.mean(axis=0) for cell in hexahedra])
        self.assertEqual([list(cells) for cells in inside], [[cell.id] for cell in hexahedra])
        self.assertEqual([len(cells) for cells in made.locate([(100, 0, 0)])], [0])
        self.assertEqual(made.locate([]), [])
        far = np.array(made.info.grid.hi)
        self.assertEqual(made.box(-100 * np.ones(3), 100 * np.ones(3)), self.all[3])
        self.assertEqual(made.box(far, far).text(), ["h17"])
        self.assertEqual(len(made.box(far + 1, far + 2)), 0)

    def test_what_is_over_a_limit_is_asked_in_parts(self):
        for made in (self.maps[1], self.eight):
            for dimension, ids in enumerate(self.all):
                self.assertEqual(made.cells(dimension, max_darts=600), ids)
            self.assertEqual(made.box((-9, -9, -9), (9, 9, 9), max_darts=8), self.all[3])
        for call in (
            lambda: self.eight.cells(3, max_darts=5),
            lambda: self.eight.box((-9, -9, -9), (9, 9, 9), max_darts=1),
            lambda: self.eight.explore("h8", "3,2", max_darts=5),
        ):
            self.fails(ndmap.ResourceExhaustedError, r"more than 5 darts|over the limit of 1 ", call)

    def test_parts_are_of_one_state_of_the_map(self):
        def states(*versions):
            return [np.array([(version,)], [("version", np.uint64)]) for version in versions]

        with mock.patch("ndmap.navigate.block_stats", side_effect=states(1, 2, 3, 3)) as asked:
            self.assertEqual(self.eight.cells(3), self.all[3])
            self.assertEqual(asked.call_count, 4)
        with mock.patch("ndmap.navigate.block_stats", side_effect=states(*range(8))):
            self.fails(ndmap.AbortedError, "m8.*changed 4 times", self.eight.cells, 3)

    def test_an_orbit_is_asked_again_when_its_block_changed_on_the_way(self):
        changed = ndmap.StaleDartError("block 0 has changed")
        expected = self.eight.orbit("h8")
        with mock.patch("ndmap.walk.beta", side_effect=[changed, changed, mock.Mock(darts=expected)]) as beta:
            np.testing.assert_array_equal(self.eight.orbit("h8").index, expected.index)
            self.assertEqual(beta.call_count, 3)
        with mock.patch("ndmap.walk.beta", side_effect=changed) as beta:
            self.fails(ndmap.AbortedError, "m8.*changed 4 times", self.eight.orbit, "h8")
            # The version is the caller's.
            self.fails(ndmap.StaleDartError, "has changed", self.eight.orbit, expected[0], 0)
            self.assertEqual(beta.call_count, 5)

    def test_anchors_come_in_many_forms(self):
        made = self.eight
        expected = made.incident("h8", 0)
        details = made.cell("h8")
        for anchors in ("h8", details, details.id, [details.id], ndmap.CellIds.of(["h8"]), details.dart,
                        made.orbit("h8"), made.beta(details.dart, ""), iter(["h8", details.dart])):
            self.assertEqual(made.explore(anchors, "3", dimension=0), expected)
        both = made.explore(["h8", ndmap.BoxAnchor(details.points.min(axis=0), details.points.max(axis=0))], [3])
        self.assertEqual(set(both), {details.id, *made.ring("h8", 1, 0)})
        self.assertEqual(made.explore("h8", "3,2", without_anchors=True), made.neighbors("h8"))
        self.assertEqual(made.explore(ndmap.PointAnchor(details.points.mean(axis=0))).text(), ["h8"])
        self.assertEqual(made.explore(ndmap.NearestVertexAnchor(details.points[0]), "0", "cells", 0)[0],
                         details.vertices[0])

    def test_ids_stay_when_other_cells_are_refined(self):
        made = self.create("stay", grid="3x3x2", blocks=4)
        before = [set(made.cells(dimension)) for dimension in range(4)]
        far, of_h17 = made.cell("h0"), [set(made.incident("h17", dimension)) for dimension in range(4)]
        made.refine(1, "list", cells="h17").result()
        after = [set(made.cells(dimension)) for dimension in range(4)]
        self.assertTrue(before[0] <= after[0])
        for dimension in range(4):
            self.assertTrue(before[dimension] - of_h17[dimension] <= after[dimension])
        self.assertEqual({str(cell) for cell in after[3] - before[3]}, {f"h17/{child}" for child in range(8)})
        self.assertEqual(before[3] - after[3], {ndmap.CellId.parse("h17")})
        np.testing.assert_array_equal(made.cell("h0").points, far.points)
        self.fails(ndmap.NotFoundError, "no cell h17", made.cell, "h17")

    def test_stale_darts_are_refused(self):
        made = self.create("old")
        dart = made.any_dart(0)
        orbit, cell = made.orbit(dart, 0), made.cell(dart.cell)
        made.refine(1, "everything").result()
        for call in (lambda: made.orbit(dart, 0), lambda: made.explore(orbit, "0"), lambda: made.orbit(cell.dart, 3)):
            self.fails(ndmap.StaleDartError, "has changed since version", call)
        self.assertTrue(len(made.orbit(ndmap.Dart("old", 0, made.any_dart(0).dart.index), 0)))

    def test_wrong_use(self):
        made, wrong = self.eight, ndmap.InvalidArgumentError
        for text in ("", "h", "h1/9", "h1/", "h1.2", "v1", "v1:8", "e1:12", "f1:6", "h1:2", " h1", "h1\n", "h-1", "H1",
                     "h17179869184", "h" + "1" * 5000, "h0/" + ".".join("0" * 30), "v1#536870912", "v1/0#1", "h\u0661"):
            self.fails(wrong, "expected the id of a cell", made.cell, text)
        self.fails(wrong, "expected the id of a cell", made.cell, 7)
        for words in ((0, 0), (-1, 1), (1 << 64, 1), (0, 4), (0, 63), ("a", 1), (1 << 29, 0)):
            self.fails(wrong, "id", ndmap.CellId, *words)
        self.fails(wrong, "no parent", lambda: ndmap.CellId.parse("v1:0").parent)
        self.fails(ndmap.NotFoundError, "no cell h99", made.neighbors, "h99")
        self.fails(ndmap.NotFoundError, "no cell h0 ", made.incident, "h0", 0)
        nan = float("nan")
        self.fails(wrong, "nan", made.locate, [(0, 0, 0), (0, nan, 0)])
        self.fails(wrong, "nan", made.nearest_vertex, (0, 0, nan))
        self.fails(wrong, "inf", made.box, (0, 0, 0), (1, float("inf"), 1))
        self.fails(wrong, "low corner", made.box, (1, 0, 0), (0, 1, 1))
        for points in ((1, 2, 3), [(1, 2)], "abc", [("a", 1, 2)], 7):
            self.fails(wrong, "points", made.locate, points)
        self.fails(wrong, r"a point \(x, y, z\)", made.nearest_vertex, (1, 2))
        for dimension in (4, -1, "3", True, 1.5):
            self.fails(wrong, "dimension", made.cells, dimension)
        self.fails(wrong, "another one expected", made.neighbors, "h8", 3)
        for k in (0, 33, 1.5):
            self.fails(wrong, "ring", made.ring, "h8", k)
        self.fails(wrong, "close", made.explore, "h8", "4")
        self.fails(wrong, "close", made.explore, "h8", 3)
        self.fails(wrong, "closures", made.explore, "h8", [3] * 65)
        self.fails(wrong, "give", made.explore, "h8", "3", "all")
        self.fails(wrong, "max_darts", made.explore, "h8", max_darts=-1)
        self.fails(wrong, "one anchor or more", made.explore, [])
        self.fails(wrong, "a dart, a cell or an anchor", made.explore, [7])
        self.fails(wrong, "map 'm1'", made.orbit, self.maps[1].any_dart(0), 0)
        self.fails(wrong, "i expected", made.orbit, made.any_dart(0))
        self.fails(ndmap.NotFoundError, "no block 8", made.explore, ndmap.BlockAnchor(8))
        self.fails(wrong, "block -1", made.explore, ndmap.BlockAnchor(-1))
        self.fails(ndmap.NotFoundError, "4000000000", made.orbit, ndmap.Dart("m8", 0, 4000000000), 0)


class IdsTest(unittest.TestCase):
    def test_texts_and_bits(self):
        for text, dimension, level, bits in (
            ("h0", 3, 0, 1),
            ("h12", 3, 0, 12 << 94 | 1),
            ("h12/0.3.7", 3, 3, 12 << 94 | 0o1037),
            ("v12/0.3.7:5", 0, 3, 12 << 94 | 0o1037 << 5 | 10),
            ("e12:11", 1, 0, 12 << 94 | 1 << 5 | 22),
            ("f12/0:2", 2, 1, 12 << 94 | 8 << 5 | 20),
            ("v12#5", 0, 0, 12 << 94 | 1 << 31 | 5),
            ("f12", 2, 0, 12 << 94 | 2),
            ("f3#536870911", 2, 0, 3 << 94 | 1 << 31 | 2 << 29 | 536870911),
            ("h17179869183/" + ".".join("7" * 29), 3, 29, (1 << 34) - 1 << 94 | (1 << 88) - 1),
            ("v1/" + ".".join("0" * 29) + ":7", 0, 29, 1 << 94 | 1 << 92 | 13),
        ):
            cell = ndmap.CellId.parse(text)
            self.assertEqual((cell.hi << 64 | cell.lo, cell.dimension, cell.level), (bits, dimension, level), text)
            self.assertEqual(str(ndmap.CellId(cell.hi, cell.lo)), text)
        # The service takes zeros in front, too.
        self.assertEqual(str(ndmap.CellId.parse("v007/1:05")), "v7/1:5")

    def test_every_level_round_trips(self):
        chosen = random.Random(1)
        for level in range(30):
            for prefix, count in (("h", 1), ("v", 8), ("e", 12), ("f", 6)):
                path = ".".join(str(chosen.randrange(8)) for _ in range(level))
                for number in range(count):
                    text = f"{prefix}{chosen.randrange(1 << 34)}{'/' if level else ''}{path}"
                    text += "" if prefix == "h" else f":{number}"
                    cell = ndmap.CellId.parse(text)
                    self.assertEqual((str(cell), cell.level), (text, level))
                    self.assertEqual(cell.dimension, "vefh".index(prefix))

    def test_parents_lead_to_the_initial_hexahedron(self):
        cell = ndmap.CellId.parse("h7/1.2.3")
        self.assertEqual([str(cell.parent), str(cell.parent.parent.parent)], ["h7/1.2", "h7"])
        self.assertIsNone(ndmap.CellId.parse("h7").parent)
        self.assertEqual(cell.initial, 7)

    def test_columns(self):
        ids = ndmap.CellIds.of(["h1", ndmap.CellId.parse("h1/2"), "v2:3"])
        self.assertEqual(ids.text(), ["h1", "h1/2", "v2:3"])
        self.assertEqual((len(ids), str(ids[1]), ids[1:].text()), (3, "h1/2", ["h1/2", "v2:3"]))
        self.assertEqual(ids[np.array([2, 0])].text(), ["v2:3", "h1"])
        self.assertTrue("h1" in ids and "h2" not in ids)
        self.assertEqual(ids, ndmap.CellIds.from_words(ids.hi, ids.lo))
        self.assertNotEqual(ids, ids[:2])
        array = np.asarray(ids)
        self.assertEqual(array.dtype.names, ("hi", "lo"))
        array["hi"] = 0
        self.assertEqual(str(ids[0]), "h1")
        self.assertEqual(repr(ids[:2]), "<CellIds 2: h1, h1/2>")
        self.assertRaises(IndexError, lambda: ids[3])


if __name__ == "__main__":
    unittest.main()
