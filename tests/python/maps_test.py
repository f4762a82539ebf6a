# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps and jobs of a real cluster, against what the command line says of them."""
import subprocess
import sys
import threading
import unittest

import numpy as np

import ndmap
from cluster import ClusterTest, run_ndmap


class MapsTest(ClusterTest):
    def test_a_map_from_creation_to_deletion_has_the_hash_of_the_command_line(self):
        run = run_ndmap("run", self.torus, "--grid", "6x6x3", "--depth", 2)
        for blocks in (1, 2, 4):
            with self.subTest(blocks=blocks):
                made = self.client.create_map("torus", self.torus, grid="6x6x3", blocks=blocks)
                self.assertEqual(made.info.state, "ready")
                self.assertEqual(made.stats().counts["hexahedra"], 108)
                heard = []
                result = made.refine(2, progress=heard.append).result()
                self.assertEqual([phase.algorithm for phase in result.phases], ["refine", "refine", "classify"])
                self.assertEqual(heard[-1].state, "done")
                self.assertEqual([one.phase_index for one in heard], sorted(one.phase_index for one in heard))
                trimmed = made.trim().result().phases[1]
                stats = made.stats()
                self.assertEqual(stats.counts["hexahedra"], trimmed.counts["hexahedra"])
                self.assertEqual(stats.counts["hexahedra"], run["hexahedra"])
                self.assertEqual(sum(stats.levels.values()), run["hexahedra"])
                self.assertEqual(stats.blocks["hexahedra"].sum(), run["hexahedra"])
                self.assertEqual(stats.blocks["block"].tolist(), list(range(blocks)))
                self.assertTrue(made.check().valid)
                self.assertEqual(made.hash(), run["hash"])
                self.assertEqual(made.hash(), self.cluster.ndmap("hash", "torus")["hash"])
                self.assertEqual(self.client.jobs("torus")[0].kind, "create")
                self.client.delete_map("torus")
                self.assertEqual(self.client.maps(), [])

    def test_grids_are_those_of_the_command_line_bit_for_bit(self):
        for options in ({"grid": "7x5x3"}, {"cubes": 9}, {}, {"grid": "4x4x2", "padding": 0.3}, {"padding": 0.1}):
            with self.subTest(**options):
                flags = [word for name, value in options.items() for word in (f"--{name}", value)]
                self.cluster.ndmap("create", "theirs", self.torus, *flags)
                theirs = self.client.open_map("theirs").info
                ours = self.client.create_map("ours", self.torus, **options).info
                self.assertEqual(ours.grid, theirs.grid)
                self.assertEqual(ours.surface_id, theirs.surface_id)
                self.assertEqual((ours.routing, ours.partition), (theirs.routing, theirs.partition))
                self.client.delete_map("theirs")
                self.client.delete_map("ours")

    def test_a_surface_of_arrays_is_the_surface_of_the_file(self):
        read = ndmap.Surface.read(self.torus)
        made = self.client.create_map("arrays", (read.points, read.triangles), grid=(6, 6, 3), blocks=2)
        self.addCleanup(self.client.delete_map, "arrays")
        self.assertEqual(made.info.surface_id, read.id)
        self.assertEqual(made.hash(), self.create("file").hash())

    def test_a_surface_is_sent_in_parts_and_told_of(self):
        told = []
        sphere = f"{self.folder}/large.off"
        run_ndmap("sample", "sphere", "-o", sphere, "--triangles", 120000)
        surface = ndmap.Surface.read(sphere)
        identity = self.client.upload_surface(surface, lambda sent, total: told.append((sent, total)))
        self.assertEqual(identity, surface.id)
        size = surface.points.nbytes + surface.triangles.nbytes
        self.assertEqual(told[-1], (size, size))
        self.assertGreater(len(told), 3)
        self.client.delete_surface(identity)

    def test_a_map_without_a_surface(self):
        grid = ndmap.Grid((3, 2, 1), (0, 0, 0), (3, 2, 1))
        made = self.client.create_map("bare", None, grid=grid, blocks=2)
        self.addCleanup(self.client.delete_map, "bare")
        self.assertEqual((made.info.surface_id, made.info.grid), ("", grid))
        self.assertEqual(made.refine(1, "everything").result().phases[0].counts["refined"], 6)
        self.assertEqual(made.stats().levels, {1: 48})

    def test_oracles_refine_what_they_should(self):
        made = self.create("oracles")

        def refined(*arguments, **options):
            phases = made.refine(*arguments, **options).result().phases
            return sum(phase.counts.get("refined", 0) for phase in phases)

        self.assertEqual(refined(1, "list", cells="h0 h5"), 2)
        self.assertEqual(refined(1, "list", cells=["h7"]), 1)
        self.assertEqual(refined(1, "sphere", centre=(100, 0, 0), radius=1), 0)
        self.assertEqual(refined(1, "box", lo=(-100, -100, -100), hi=np.array([100.0, 100, 100])), 105)
        self.assertEqual(refined(1, "size", size=1000), 0)
        self.assertEqual(refined(2, "everything", by_level=False), 108 * 8)
        self.assertTrue(made.check().valid)

    def test_a_job_is_a_future_that_can_be_cancelled(self):
        made = self.create("long")
        begun = threading.Event()
        job = made.refine(12, progress=lambda progress: begun.set())
        self.assertTrue(begun.wait(60))
        self.assertFalse(job.done())
        with self.assertRaises(ndmap.DeadlineExceededError):
            job.result(timeout=0)
        with self.assertRaisesRegex(ndmap.FailedPreconditionError, f"job {job.id}"):
            made.trim()
        self.assertEqual(made.refresh().running_jobs, (job.id,))
        job.cancel()
        with self.assertRaisesRegex(ndmap.JobCancelledError, f"job {job.id} .*cancelled"):
            job.result()
        self.assertTrue(job.done())
        self.assertEqual(job.progress.state, "cancelled")
        self.assertEqual(self.client.job(job.id).get().state, "cancelled")
        self.assertTrue(made.check().valid)

    def test_what_a_callback_raises_comes_out_of_result(self):
        def callback(progress):
            raise RuntimeError("the caller's own")

        job = self.create("callback").refine(1, progress=callback)
        with self.assertRaisesRegex(RuntimeError, "the caller's own"):
            job.result()
        self.assertEqual(job.get().state, "done")

    def test_a_program_may_end_while_a_job_is_watched(self):
        made = self.create("left")
        program = (
            "import sys, threading, ndmap\n"
            "begun = threading.Event()\n"
            "made = ndmap.connect(sys.argv[1]).open_map('left')\n"
            "print(made.refine(12, progress=lambda progress: begun.set()).id)\n"
            "begun.wait()\n"
        )
        run = subprocess.run([sys.executable, "-c", program, self.cluster.address], capture_output=True, text=True,
                             timeout=60, check=False)
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        job = self.client.job(int(run.stdout))
        self.assertEqual(job.progress.state, "running")
        job.cancel()
        with self.assertRaises(ndmap.JobCancelledError):
            job.result()
        self.assertTrue(made.check().valid)

    def test_servers_and_processes(self):
        made = self.create("processes")
        servers = self.client.servers()
        self.assertEqual([server.alive for server in servers], [True, True])
        self.assertEqual([server.blocks for server in servers], [1, 1])
        self.assertEqual({server.release for server in servers}, {self.client.release})
        self.assertEqual(self.client.release, ndmap.__version__)
        stats = made.server_stats()
        self.assertEqual([one.address for one in stats], sorted(server.address for server in servers))
        self.assertEqual(len({one.pid for one in stats} | {self.client.coordinator_stats().pid}), 3)
        self.assertTrue(all(one.peak_rss_bytes >= one.rss_bytes > 1 << 20 for one in stats))


if __name__ == "__main__":
    unittest.main()
