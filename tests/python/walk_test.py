# SPDX-License-Identifier: GPL-3.0-or-later
"""Walks by Proposition 1 through the blocks and servers of a real cluster."""
import unittest

import numpy as np

import ndmap
from cluster import ClusterTest


def traverse(made):
    """Every dart that betas lead to from one dart, in the order of block and index; and how many crossings it took."""
    front = made.beta(made.any_dart(0), "").darts
    seen = {(int(front.block[0]), int(front.index[0]))}
    parts, crossings = [front], 0
    while len(front):
        fresh = []
        for letter in range(4):
            walks = made.beta(front, [letter])
            crossings += int(walks.block_crossings.sum())
            keys = list(zip(walks.darts.block.tolist(), walks.darts.index.tolist()))
            rows = [row for row, key in enumerate(keys) if key not in seen and not seen.add(key)]
            fresh.append(walks.darts[np.array(rows, np.int64)])
        front = joined(made.name, fresh)
        parts.append(front)
    every = joined(made.name, parts)
    return every[np.lexsort((every.index, every.block))], crossings


def joined(name, parts):
    columns = ("block", "index", "version", "point", "cell", "level", "critical")
    return ndmap.Darts(name, *(np.concatenate([getattr(part, column) for part in parts]) for column in columns))


class WalkTest(ClusterTest):
    def test_betas_lead_through_the_whole_map_whatever_its_blocks(self):
        seen = {}
        for blocks, routing in ((1, "direct"), (2, "direct"), (4, "direct"), (4, "broadcast")):
            with self.subTest(blocks=blocks, routing=routing):
                made = self.client.create_map("walk", self.torus, grid="4x4x2", blocks=blocks, routing=routing)
                made.refine(1, "sphere", centre=(1, 0, 0), radius=0.5).result()
                darts, crossings = traverse(made)
                counts = made.stats().counts
                self.assertEqual(len(darts), counts["darts"])
                self.assertEqual(int(darts.critical.sum()), counts["critical_darts"])
                self.assertEqual(sorted(set(darts.block.tolist())), list(range(blocks)))
                self.assertEqual(crossings > 0, blocks > 1)
                # What there is does not depend on the cut.
                rows = sorted(zip(map(tuple, darts.point.tolist()), darts.cell.tolist(), darts.level.tolist()))
                self.assertEqual(rows, seen.setdefault("rows", rows))
                self._check_laws(made, darts)
                self._check_columns(made, darts)
                self.client.delete_map("walk")

    def _check_columns(self, made, darts):
        """Many walks in columns end where walks one by one end."""
        darts = darts[np.random.default_rng(1).permutation(len(darts))]
        for word in ("3", "2,3,2,1,1,2,3,2,0,2,3,1"):
            expected, ends = made.beta(darts, word), made.walk(darts, word)
            for column in ("block", "index", "version"):
                np.testing.assert_array_equal(getattr(ends.darts, column), getattr(expected.darts, column))
            np.testing.assert_array_equal(ends.used, expected.used)
            np.testing.assert_array_equal(ends.free, expected.free)
        # Home again, from where others ended.
        np.testing.assert_array_equal(made.walk(made.walk(darts, "0"), "1").darts.index, darts.index)

    def _check_laws(self, made, darts):
        def ends(word):
            walks = made.beta(darts, word)
            return walks, np.stack([walks.darts.block, walks.darts.index], axis=1)

        here = np.stack([darts.block, darts.index], axis=1)
        for word in ("0,1", "1,0", "2,2"):
            walks, there = ends(word)
            self.assertFalse(walks.free.any())
            np.testing.assert_array_equal(there, here, word)
        # Beta 3 is free at the boundary of the map, and an involution elsewhere.
        walks, there = ends("3,3")
        np.testing.assert_array_equal(walks.used, np.where(walks.free, 0, 2))
        np.testing.assert_array_equal(there, here)
        self.assertTrue(walks.free.any() and not walks.free.all())
        # Faces that are glued run against each other.
        walks, there = ends("3,1,3,1")
        np.testing.assert_array_equal(there[~walks.free], here[~walks.free])
        crossed = darts.critical & ~walks.free
        self.assertTrue((walks.block_crossings[crossed] == 2).all())
        self.assertFalse(walks.block_crossings[~darts.critical].any())

    def test_a_word_is_its_letters_one_after_the_other(self):
        made = self.create("word", blocks=4)
        start = made.beta([made.any_dart(block) for block in range(4)], "")
        word = "2,3,2,1,1,2,3,2,0,2,3,1"
        walks = made.beta(start, word)
        step, used, crossings = start.darts, np.zeros(4, int), np.zeros((2, 4), int)
        under_way = np.ones(4, bool)
        for letter in word.replace(",", ""):
            walk = made.beta(step, letter)
            under_way &= ~walk.free
            used += under_way
            crossings += np.where(under_way, [walk.block_crossings, walk.server_crossings], 0)
            step = joined("word", [walk.darts[row:row + 1] if under_way[row] else step[row:row + 1] for row in range(4)])
        np.testing.assert_array_equal(walks.used, used)
        np.testing.assert_array_equal(walks.darts.index, step.index)
        np.testing.assert_array_equal(walks.darts.block, step.block)
        np.testing.assert_array_equal([walks.block_crossings, walks.server_crossings], crossings)

    def test_the_command_line_walks_the_same_way(self):
        made = self.create("same", blocks=4)
        for block in range(4):
            start = made.any_dart(block)
            for word in ("1,2,3", "2,3,2,3,2", "0,2,1,3"):
                said = self.cluster.ndmap("beta", "same", str(start.dart), word)
                walks = made.beta(start, word)
                self.assertEqual(said["dart"], str(walks.darts[0].dart))
                self.assertEqual(said["used"], walks.used[0])
                self.assertEqual(said["end"] == "free", walks.free[0])
                self.assertEqual(said["block_crossings"], walks.block_crossings[0])
                self.assertEqual(said["server_crossings"], walks.server_crossings[0])
                if said["steps"]:
                    self.assertEqual(said["steps"][-1]["point"], list(walks.darts[0].point))
                    self.assertEqual(said["steps"][-1]["hexahedron"], walks.darts[0].cell)

    def test_columns_are_made_of_what_there_is(self):
        made = self.create("columns")
        info = made.any_dart(1)
        expected = made.beta(info, "1,2").darts
        bare = ndmap.DartColumns("columns", [1], [info.dart.index])
        walked = made.walk(bare, "1")
        for darts, word in ((info, "1,2"), ([info.dart], [1, 2]), (bare, b"\1\2"), (walked, "2"), (walked.darts, "2")):
            self.assertEqual(made.walk(darts, word).darts.index.tolist(), expected.index.tolist())
        self.assertEqual(len(made.walk([], "1")), 0)
        self.assertEqual(walked.darts.version.tolist(), [info.dart.version])

    def test_darts_come_in_many_forms(self):
        made = self.create("forms")
        info = made.any_dart(1)
        bare = ndmap.Dart("forms", info.dart.block, info.dart.index)
        walks = made.beta([info, info.dart, bare], "1")
        self.assertEqual(len(set(walks.darts.index.tolist())), 1)
        for word in ("12", "1,2", [1, 2], b"\1\2", np.array([1, 2])):
            self.assertEqual(made.beta(info, word).darts[0], made.beta(bare, "1,2").darts[0])
        self.assertEqual(len(made.beta([], "1,2")), 0)
        self.assertEqual([dart.dart.block for dart in walks.darts], [1, 1, 1])
        self.assertEqual(made.beta(walks, "0").darts[0], info)

    def test_long_words_and_many_darts_go_in_parts(self):
        made = self.create("parts")
        start = made.any_dart(0)
        # A face of the initial grid has four edges.
        walks = made.beta(start, [1] * (4 * 40000))
        self.assertEqual(walks.darts[0], start)
        self.assertEqual(walks.used[0], 160000)
        walks = made.beta([start] * 70000, "1,1,1,1")
        self.assertEqual(set(walks.darts.index.tolist()), {start.dart.index})
        self.assertEqual(len(walks), 70000)


if __name__ == "__main__":
    unittest.main()
