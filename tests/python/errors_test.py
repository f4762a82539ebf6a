# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrong use of a real cluster: each gives a typed error with one sentence."""
import os
import signal
import socket
import unittest

import numpy as np

import ndmap
from cluster import Cluster, ClusterTest
from ndmap.export import stream_piece

TETRAHEDRON = (
    np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float),
    np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]),
)


class ErrorsTest(ClusterTest):
    def test_maps_and_jobs_that_are_not_there(self):
        self.fails(ndmap.NotFoundError, "nowhere", self.client.open_map, "nowhere")
        self.fails(ndmap.NotFoundError, "nowhere", self.client.delete_map, "nowhere")
        self.fails(ndmap.InvalidArgumentError, r"a/b", self.client.open_map, "a/b")
        self.fails(ndmap.NotFoundError, "123456", self.client.job(123456).get)
        self.fails(ndmap.NotFoundError, "123456", self.client.job(123456).result)
        self.fails(ndmap.NotFoundError, "123456", self.client.job(123456).cancel)
        self.fails(ndmap.NotFoundError, "123456", lambda: self.client.job(123456).progress)
        self.fails(ndmap.InvalidArgumentError, "-1", self.client.job, -1)
        made = self.client.create_map("gone", self.torus, grid="4x4x2", blocks=2)
        dart = made.any_dart(0)
        self.client.delete_map("gone")
        for call in (made.stats, made.hash, made.block_stats, made.refresh, made.trim):
            self.fails(ndmap.NotFoundError, "gone", call)
        self.fails(ndmap.NotFoundError, "gone", made.beta, dart, "1")
        self.fails(ndmap.NotFoundError, "gone", made.export, f"{self.folder}/none")
        self.assertFalse(os.path.exists(f"{self.folder}/none"))

    def test_a_stale_dart_is_refused(self):
        made = self.create("stale")
        dart = made.any_dart(0)
        made.refine(1, "everything").result()
        for call in (made.beta, made.walk):
            error = self.fails(ndmap.StaleDartError, "block 0 has changed since version", call, dart, "1")
            self.assertIsInstance(error, ndmap.FailedPreconditionError)
        twice = ndmap.DartColumns("stale", [0, 0], [1, 2], [dart.dart.version, dart.dart.version + 1])
        self.fails(ndmap.StaleDartError, "were named at versions", made.walk, twice, "1")
        # Without a version nobody compares.
        self.assertEqual(made.beta(ndmap.Dart("stale", 0, dart.dart.index), "1").used[0], 1)

    def test_darts_that_are_not_there(self):
        made = self.create("darts")
        self.fails(ndmap.NotFoundError, "4000000000", made.beta, ndmap.Dart("darts", 0, 4000000000), "1")
        self.fails(ndmap.NotFoundError, "no block 7, it has 2", made.beta, ndmap.Dart("darts", 7, 0), "1")
        self.fails(ndmap.NotFoundError, "no block 7, it has 2", made.any_dart, 7)
        self.fails(ndmap.InvalidArgumentError, "block -1", made.any_dart, -1)
        self.fails(ndmap.InvalidArgumentError, "below 2", made.beta, ndmap.Dart("darts", 0, -1), "1")
        self.fails(ndmap.InvalidArgumentError, "below 2", made.beta, ndmap.Dart("darts", 0, 1 << 32), "1")
        self.fails(ndmap.InvalidArgumentError, "below 2", made.beta, ndmap.Dart("darts", 0, "x"), "1")
        self.fails(ndmap.InvalidArgumentError, "map 'other'", made.beta, ndmap.Dart("other", 0, 0), "1")
        self.fails(ndmap.InvalidArgumentError, "Dart or DartInfo", made.beta, [7], "1")
        self.fails(ndmap.NotFoundError, "4000000000", made.walk, ndmap.DartColumns("darts", [0], [4000000000]), "1")
        self.fails(ndmap.NotFoundError, "no block 7, it has 2", made.walk, ndmap.DartColumns("darts", [7], [0]), "1")
        self.fails(ndmap.InvalidArgumentError, "map 'other'", made.walk, ndmap.DartColumns("other", [0], [0]), "1")
        for index in ([-1], [1 << 32], [0.5], [[1]], ["x"], 1):
            self.fails(ndmap.InvalidArgumentError, "index", ndmap.DartColumns, "darts", [0], index)
        self.fails(ndmap.InvalidArgumentError, "expected as many", ndmap.DartColumns, "darts", [0, 0], [1])

    def test_words_that_are_none(self):
        made = self.create("words")
        dart = made.any_dart(0)
        for word in ("4", "1,2,x", "1,,2", ",1", "1,", "1 2", "²"):
            self.fails(ndmap.InvalidArgumentError, "word of betas 0 ... 3", made.beta, dart, word)
        for word in ([4], [-1], [1, 2.5], [None], b"1"):
            self.fails(ndmap.InvalidArgumentError, "beta 0 ... 3", made.beta, dart, word)
            self.fails(ndmap.InvalidArgumentError, "beta 0 ... 3", made.walk, dart, word)
        self.fails(ndmap.InvalidArgumentError, "70000 letters", made.walk, dart, b"\1" * 70000)

    def test_maps_that_cannot_be_made(self):
        self.create("there")

        def create(name="new", surface=self.torus, **options):
            return self.client.create_map(name, surface, **options)

        self.fails(ndmap.AlreadyExistsError, "there", create, "there")
        for name in ("", "a b", ".hidden", "x" * 200):
            self.fails(ndmap.InvalidArgumentError, "", create, name)
        for options, words in (
            ({"routing": "pigeon"}, "direct, broadcast"),
            ({"partition": "pie"}, "pie"),
            ({"grid": "3x3"}, "12x12x4"),
            ({"grid": (3, 3, 0)}, "12x12x4"),
            ({"grid": (3, 3, 1.5)}, "12x12x4"),
            ({"grid": "70000x70000x2"}, "2.32 cells"),
            ({"grid": "3x3x3", "cubes": 3}, "exclude"),
            ({"cubes": 0}, "1 or more"),
            ({"padding": -1.0}, "0 or more"),
            ({"padding": float("nan")}, "0 or more"),
            ({"grid": "2x2x2", "blocks": 9}, "1 ... 8"),
            ({"blocks": 0}, "blocks 0"),
            ({"depth": 30}, "0 ... 29"),
            ({"surface": None}, r"Grid\(cells, lo, hi\)"),
            ({"surface": 7}, "a file's name"),
            ({"surface": (TETRAHEDRON[0], TETRAHEDRON[1][:3])}, "clos|edge"),
            ({"surface": (TETRAHEDRON[0] * float("nan"), TETRAHEDRON[1])}, "finite"),
            ({"surface": (TETRAHEDRON[0], TETRAHEDRON[1][:, [0, 0, 1]]), "grid": "2x2x2"}, ""),
        ):
            with self.subTest(**options):
                self.fails(ndmap.InvalidArgumentError, words, create, **options)
        self.fails(ndmap.FailedPreconditionError, "there", self.client.delete_surface,
                   self.client.open_map("there").info.surface_id)
        self.assertEqual([info.name for info in self.client.maps()], ["there"])

    def test_work_that_cannot_be_started(self):
        made = self.create("work")
        for arguments, options, words in (
            ((0,), {}, "1 ... 29"),
            ((32,), {}, "1 ... 29"),
            ((1, "delphi"), {}, "surface, everything"),
            ((1, "box"), {"lo": (0, 0, 0)}, "needs hi"),
            ((1, "surface"), {"size": 1}, "size is not for oracle surface"),
            ((1, "sphere"), {"centre": (0, 0), "radius": 1}, "a point"),
            ((1, "sphere"), {"centre": (0, 0, float("nan")), "radius": 1}, "nan"),
            ((1, "size"), {"size": -1}, "above 0"),
            ((1, "size"), {"size": "x"}, "a number"),
            ((1, "sphere"), {"centre": (0, 0, 0), "radius": 0}, "above 0"),
            ((1, "size"), {"size": float("inf")}, "inf"),
            ((1, "list"), {"cells": 7}, "ids such as"),
        ):
            with self.subTest(arguments=arguments, **options):
                self.fails(ndmap.InvalidArgumentError, words, lambda: made.refine(*arguments, **options).result())
        # What only the algorithms understand makes the job fail, and harms no map.
        self.fails(ndmap.JobFailedError, "x7", made.refine(1, "list", cells="x7").result)
        self.fails(ndmap.InvalidArgumentError, "keep 'some'", made.trim, "some")
        self.fails(ndmap.InvalidArgumentError, "hexahedron, polyhedron", made.export, self.folder, "cube")
        self.assertEqual(made.refresh().state, "ready")

    def test_folders_that_cannot_be_written(self):
        made = self.create("folders")
        self.fails(ndmap.OutputError, "torus.off", made.export, self.torus)
        self.fails(ndmap.OutputError, "torus.off/deeper", made.export, f"{self.torus}/deeper")

    def test_nobody_there(self):
        for target in ("", "7000", "host", "host:0", "host:65536", "host:x", "::1:7000", "host:²"):
            self.fails(ndmap.InvalidArgumentError, "HOST:PORT", ndmap.connect, target)
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            target = f"127.0.0.1:{listener.getsockname()[1]}"
            error = self.fails(ndmap.UnavailableError, f"the coordinator at {target} cannot be reached: .*refused",
                               ndmap.connect, target)
            self.assertIsInstance(error, ConnectionError)
            listener.listen()
            error = self.fails(ndmap.DeadlineExceededError, f"the coordinator at {target} did not answer in time",
                               ndmap.connect, target, ndmap.ClientOptions(connect_timeout=0.3))
            self.assertIsInstance(error, TimeoutError)

    def test_a_closed_client(self):
        made = self.create("closed")
        with ndmap.connect(self.cluster.address) as client:
            opened = client.open_map("closed")
            job = opened.refine(12)
            self.assertEqual(job.progress.state, "running")
        self.fails(ndmap.CancelledError, "", job.result)
        self.fails(ndmap.FailedPreconditionError, "is closed", client.maps)
        self.fails(ndmap.FailedPreconditionError, "is closed", opened.any_dart, 0)
        client.close()
        self.client.job(job.id).cancel()
        with self.assertRaises(ndmap.JobCancelledError):
            self.client.job(job.id).result()
        self.assertTrue(made.check().valid)


class LostServerTest(ClusterTest):
    """Takes servers away from a cluster of its own."""

    def test_a_server_that_is_gone(self):
        cluster = Cluster(1)
        self.addCleanup(cluster.stop)
        options = ndmap.ClientOptions(first_pause=0.001)
        with ndmap.connect(cluster.address, options) as client:
            made = client.create_map("lost", self.torus, grid="6x6x3", blocks=2)
            dart = made.any_dart(0)
            job = made.refine(12)
            self.assertEqual(job.progress.state, "running")
            # The cluster's own command ends when one of its services does.
            os.kill(made.server_stats()[0].pid, signal.SIGKILL)
            # Whether the coordinator lives to say that the job failed is a matter of timing.
            with self.assertRaises((ndmap.JobFailedError, ndmap.UnavailableError)):
                job.result()
            self.fails(ndmap.UnavailableError, "the block server at", made.beta, dart, "1")
            self.fails(ndmap.UnavailableError, "the block server at", made.block_stats)
            self.fails(ndmap.UnavailableError, "the block server at", made.export, f"{self.folder}/new/lost")
            self.assertFalse(os.path.exists(f"{self.folder}/new"))
            cluster.stop()
            self.fails(ndmap.UnavailableError, "the coordinator at", client.maps)

    def test_a_server_that_goes_in_the_middle_of_a_stream(self):
        cluster = Cluster(1)
        self.addCleanup(cluster.stop)
        with ndmap.connect(cluster.address) as client:
            # A piece of several times what gRPC sends ahead of the reader.
            made = client.create_map("big", self.torus, grid="60x60x60", blocks=1)
            pid = made.server_stats()[0].pid
            stream = stream_piece(client._connection, made.info, 0, {"cells": "polyhedron"})
            self.assertTrue(next(stream))
            os.kill(pid, signal.SIGKILL)
            self.fails(ndmap.UnavailableError, "the block server at", list, stream)


if __name__ == "__main__":
    unittest.main()
