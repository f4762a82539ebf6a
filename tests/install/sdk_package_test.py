# SPDX-License-Identifier: GPL-3.0-or-later
"""The installed CMake package: a project in a folder of its own finds it, is built, and talks to a cluster of the
installed programs. NDMAP_BUILD names the build folder."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import programs

BUILD = os.environ["NDMAP_BUILD"]
CMAKE = os.environ["NDMAP_CMAKE"]
EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"


class SdkPackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="ndmap-sdk-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.prefix = cls.folder / "prefix"
        for component in ("sdk", "programs"):
            cls.run_command(CMAKE, "--install", BUILD, "--prefix", cls.prefix, "--component", component)

    @staticmethod
    def run_command(*command, fails=False):
        run = subprocess.run([str(word) for word in command], check=False, text=True, stdin=subprocess.DEVNULL,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        if (run.returncode != 0) != fails:
            raise AssertionError(f"{command}: exit code {run.returncode}: {run.stdout}")
        return run.stdout

    def test_a_project_outside_the_tree_is_built_and_talks_to_a_cluster(self):
        project, build = self.folder / "project", self.folder / "build"
        shutil.copytree(EXAMPLES / "outside", project)
        shutil.copy(EXAMPLES / "edge_star.cc", project)
        self.run_command(CMAKE, "-S", project, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug",
                         f"-DCMAKE_PREFIX_PATH={self.prefix}")
        self.run_command(CMAKE, "--build", build)
        # It was given nothing of this tree or its build folder.
        used = (build / "build.ninja").read_text(encoding="utf-8")
        self.assertIn(f"{self.prefix}/lib", used)
        self.assertNotIn(BUILD, used)
        self.assertNotIn(str(EXAMPLES.parent) + "/", used)

        self.addCleanup(setattr, programs, "BIN", programs.BIN)
        programs.BIN = str(self.prefix / "bin")
        torus = self.folder / "torus.off"
        programs.run_ndmap("sample", "torus", "-o", torus, "--triangles", 2000)
        cluster = programs.Cluster(2)
        self.addCleanup(cluster.stop)
        cluster.ndmap("create", "m", torus, "--grid", "4x4x2", "--blocks", 2)
        said = self.run_command(build / "edge_star", cluster.address, "m")
        self.assertRegex(said, r"(?s)\Aaround an edge of h\d+ in block 0\n.*(boundary|back) after \d+ hexahedra\n\Z")
        self.assertIn('no map \"nowhere\"', self.run_command(build / "edge_star", cluster.address, "nowhere", fails=True).replace("'", '"'))

    def test_another_version_is_not_found(self):
        project = self.folder / "later"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.25)\nproject(later LANGUAGES CXX)\nfind_package(ndmap 99 REQUIRED)\n",
            encoding="utf-8")
        said = self.run_command(CMAKE, "-S", project, "-B", self.folder / "later-build", "-G", "Ninja",
                                f"-DCMAKE_PREFIX_PATH={self.prefix}", fails=True)
        self.assertRegex(said, r'compatible\s+with\s+requested\s+version\s+"99"')

    def test_what_is_installed_is_the_sdk_alone(self):
        headers = list((self.prefix / "include").rglob("*.h"))
        names = {str(header.relative_to(self.prefix / "include")) for header in headers}
        self.assertLess({"ndmap/client/sdk/client.h", "ndmap/client/sdk/navigator.h", "ndmap/v1/common.pb.h"}, names)
        for header in headers:
            text = header.read_text(encoding="utf-8")
            self.assertNotRegex(text, r'#include ["<](CGAL|core|server|service|coordinator)/')
            if not header.name.endswith(".pb.h"):
                self.assertTrue(text.startswith("// SPDX-License-Identifier: Apache-2.0\n"), header)
        self.assertEqual({library.name for library in (self.prefix / "lib").glob("*")},
                         {"cmake", "libndmap_proto.a", "libndmap_sdk.a"})
        self.assertTrue((self.prefix / "share/ndmap/proto/ndmap/v1/navigate.proto").exists())
        self.assertEqual({program.name for program in (self.prefix / "bin").iterdir()},
                         {"ndmap", "ndmap-coordinator", "ndmap-picture", "ndmap-server"})
        exported = (self.prefix / "lib/cmake/ndmap/ndmap-targets.cmake").read_text(encoding="utf-8")
        self.assertIsNone(re.search(r"-Werror|ndmap_options", exported))


if __name__ == "__main__":
    unittest.main()
