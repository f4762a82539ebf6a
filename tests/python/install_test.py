# SPDX-License-Identifier: GPL-3.0-or-later
"""The package as a user installs it, by CMake and by pip without a network, used from outside the tree."""
import os
import shutil
import site
import subprocess
import sys
import tempfile
import unittest

import ndmap
from cluster import Cluster, run_ndmap

BUILD, CMAKE = os.environ["NDMAP_BUILD"], os.environ["NDMAP_CMAKE"]
PROGRAM = """
import sys, ndmap
with ndmap.connect(sys.argv[1]) as client:
    made = client.create_map("installed", sys.argv[2], grid="4x4x2", blocks=2)
    made.refine(1).result()
    print(made.hash(), len(made.beta(made.any_dart(0), "1,2,3")), ndmap.__version__)
    client.delete_map("installed")
print(ndmap.__file__)
"""


class InstallTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="ndmap-python-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.cluster = Cluster(1)
        self.addCleanup(self.cluster.stop)
        self.torus = os.path.join(self.folder, "torus.off")
        run_ndmap("sample", "torus", "-o", self.torus, "--triangles", 2000)

    def run_command(self, *command, **environment):
        inherited = {name: value for name, value in os.environ.items() if name != "PYTHONPATH" and not name.startswith("PIP_")}
        run = subprocess.run(command, cwd=self.folder, env={**inherited, **environment}, stdin=subprocess.DEVNULL,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        self.assertEqual(run.returncode, 0, f"{command}\n{run.stdout}")
        return run.stdout

    def try_out(self, python, folder, **environment):
        said, where = self.run_command(python, "-I" if not environment else "-s", "-c", PROGRAM,
                                       self.cluster.address, self.torus, **environment).splitlines()
        expected = run_ndmap("run", self.torus, "--grid", "4x4x2", "--depth", 1, "--keep", "all")["hash"]
        self.assertEqual(said, f"{expected} 1 {ndmap.__version__}")
        self.assertTrue(where.startswith(folder), where)

    def test_cmake_installs_into_a_prefix(self):
        prefix = os.path.join(self.folder, "prefix")
        self.run_command(CMAKE, "--install", BUILD, "--prefix", prefix, "--component", "python")
        folder = os.path.join(prefix, "lib", f"python{sys.version_info[0]}.{sys.version_info[1]}", "dist-packages")
        self.try_out(sys.executable, folder, PYTHONPATH=folder)
        installed = {name for _, _, names in os.walk(folder) for name in names if not name.endswith(".pyc")}
        self.assertLess({"py.typed", "common_pb2.py", "common_pb2.pyi", "coordinator_pb2_grpc.py"}, installed)

    def test_cmake_installs_where_debian_looks(self):
        for prefix in ("/usr", "/usr/local"):
            root = os.path.join(self.folder, "root")
            said = self.run_command(CMAKE, "--install", BUILD, "--prefix", prefix, "--component", "python", DESTDIR=root)
            folders = [line.split(": ")[1][len(root):] for line in said.splitlines() if line.endswith("/ndmap")]
            self.assertEqual(len(folders), 1, said)
            self.assertIn(os.path.dirname(folders[0]), site.getsitepackages())
            self.assertTrue(folders[0].startswith(prefix + "/lib/python3"))
            shutil.rmtree(root)

    def test_pip_installs_without_a_network(self):
        # pip writes beside what it builds.
        source = os.path.join(self.folder, "source")
        shutil.copytree(os.path.join(BUILD, "python"), source)
        environment = os.path.join(self.folder, "venv")
        self.run_command(sys.executable, "-m", "venv", "--system-site-packages", environment)
        python = os.path.join(environment, "bin", "python")
        self.run_command(python, "-m", "pip", "install", "--no-index", "--no-build-isolation", source)
        self.try_out(python, environment)


if __name__ == "__main__":
    unittest.main()
