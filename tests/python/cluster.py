# SPDX-License-Identifier: GPL-3.0-or-later
"""A real cluster for tests, and the command line to compare with. NDMAP_BIN names the folder of the programs."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

import ndmap

BIN = os.environ["NDMAP_BIN"]


def run_ndmap(*arguments):
    """What `ndmap ... --json` prints."""
    environment = {name: value for name, value in os.environ.items() if name != "NDMAP_COORDINATOR"}
    run = subprocess.run(
        [os.path.join(BIN, "ndmap"), *map(str, arguments), "--json"],
        env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False,
    )
    if run.returncode != 0:
        raise AssertionError(f"ndmap {arguments}: exit code {run.returncode}: {run.stderr}")
    return json.loads(run.stdout)


class Cluster:
    """`ndmap up` on free ports, until stopped."""

    def __init__(self, processes=2):
        self._up = subprocess.Popen(
            [os.path.join(BIN, "ndmap"), "up", "--processes", str(processes), "--threads", "1", "--json"],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        text = ""
        while not text.endswith("}\n"):
            line = self._up.stdout.readline()
            if not line:
                self.stop()
                raise AssertionError(f"ndmap up ended, after saying: {text}")
            text += line
        self.address = json.loads(text)["coordinator"]

    def stop(self):
        self._up.terminate()
        self._up.wait()
        self._up.stdout.close()

    def ndmap(self, *arguments):
        return run_ndmap(*arguments, "--coordinator", self.address)


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
