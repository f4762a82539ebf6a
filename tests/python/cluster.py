# SPDX-License-Identifier: GPL-3.0-or-later
"""A real cluster for tests, and the command line to compare with. NDMAP_BIN names the folder of the programs."""
import os
import shutil
import tempfile
import unittest

import ndmap
from programs import BIN, Cluster, run_ndmap

__all__ = ["BIN", "Cluster", "ClusterTest", "run_ndmap"]


class ClusterTest(unittest.TestCase):
    """Tests that share a cluster of some block servers, a client, and a folder with a surface, torus.off."""

    processes = 2

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="ndmap-python-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.torus = os.path.join(cls.folder, "torus.off")
        run_ndmap("sample", "torus", "-o", cls.torus, "--triangles", 2000)
        cls.cluster = Cluster(cls.processes)
        cls.addClassCleanup(cls.cluster.stop)
        cls.client = ndmap.connect(cls.cluster.address)
        cls.addClassCleanup(cls.client.close)

    def fails(self, kind, pattern, call, *arguments, **options):
        """That the call raises exactly this error, in one sentence with these words."""
        with self.assertRaisesRegex(ndmap.NdmapError, pattern) as caught:
            call(*arguments, **options)
        self.assertIs(type(caught.exception), kind, caught.exception)
        self.assertNotIn("\n", str(caught.exception))
        return caught.exception

    def create(self, name, **options):
        """A small map of the torus that goes away with the test."""
        made = self.client.create_map(name, self.torus, **{"grid": "6x6x3", "blocks": 2, **options})
        self.addCleanup(self.client.delete_map, name)
        return made
