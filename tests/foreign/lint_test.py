# SPDX-License-Identifier: GPL-3.0-or-later
"""The protos are as buf wants them, everything in them documented; and buf would notice if something were not."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

BUF = os.environ["NDMAP_BUF"]
PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"


class LintTest(unittest.TestCase):
    def lint(self, folder):
        with tempfile.TemporaryDirectory(prefix="ndmap-lint-") as home:
            return subprocess.run([BUF, "lint", folder], env={"PATH": os.environ["PATH"], "HOME": home}, check=False,
                                  stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def test_nothing_to_complain_about(self):
        run = self.lint(PROTO)
        self.assertEqual((run.returncode, run.stdout, run.stderr), (0, "", ""))

    def test_what_is_not_documented_is_noticed(self):
        with tempfile.TemporaryDirectory(prefix="ndmap-protos-") as folder:
            copy = pathlib.Path(shutil.copytree(PROTO, pathlib.Path(folder) / "proto"))
            with open(copy / "ndmap/v1/common.proto", "a", encoding="utf-8") as common:
                common.write("message Undocumented { uint32 number = 1; }\n")
            run = self.lint(copy)
        self.assertNotEqual(run.returncode, 0)
        self.assertIn('Message "Undocumented" should have a non-empty comment', run.stdout)
        self.assertIn('Field "number" should have a non-empty comment', run.stdout)


if __name__ == "__main__":
    if not os.access(BUF, os.X_OK):
        raise SystemExit(f"{BUF} is missing: ./setup packages test installs it")
    unittest.main()
