# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of an export: all in their places, or those that were there; one export at a time in a folder."""
import os
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import ndmap
from ndmap.output import OutputFiles


class OutputTest(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name

    def put(self, name, text="old"):
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.write(text)

    def files(self):
        found = {}
        for name in os.listdir(self.folder):
            with open(os.path.join(self.folder, name), encoding="utf-8") as file:
                found[name] = file.read()
        return found

    def write(self, made, *names):
        for name in names:
            made.write(os.path.join(self.folder, name), iter([b"n", b"ew"]))

    def test_all_take_their_places_together_and_stale_pieces_go(self):
        for name in ("block_0000.vtu", "block_0001.vtu", "block_0007.vtu.new.part", "mesh.pvtu"):
            self.put(name)
        others = {name: "old" for name in ("block_1.vtu", "block_0007.vtu.bak", "xblock_0001.vtu", "notes")}
        for name in others:
            self.put(name)
        before = self.files()
        made = OutputFiles(self.folder)
        self.write(made, "block_0000.vtu", "mesh.pvtu")
        self.assertEqual({name: self.files()[name] for name in before}, before)
        made.put_in_place()
        made.keep()
        self.assertEqual(self.files(), {"block_0000.vtu": "new", "mesh.pvtu": "new", **others})

    def test_whatever_fails_the_earlier_export_stays(self):
        for name in ("block_0000.vtu", "block_0001.vtu", "mesh.pvtu"):
            self.put(name)
        before = self.files()
        # A piece that does not come to its end.
        made = OutputFiles(self.folder)
        self.write(made, "block_0000.vtu")
        with self.assertRaises(ndmap.DataLossError):
            made.write(f"{self.folder}/block_0001.vtu", (part for part in [b"half", self.fail_with()]))
        made.take_back()
        self.assertEqual(self.files(), before)
        # The index cannot be moved when the pieces have been; one of them is new.
        made = OutputFiles(self.folder)
        self.write(made, "block_0000.vtu", "block_0002.vtu", "mesh.pvtu")
        replace = os.replace

        def refuse(source, target):
            if source.endswith("mesh.pvtu.new"):
                raise OSError(28, "No space left on device")
            replace(source, target)

        with mock.patch("os.replace", refuse):
            with self.assertRaisesRegex(ndmap.OutputError, "cannot write '.*mesh.pvtu': No space left on device"):
                made.put_in_place()
        made.take_back()
        self.assertEqual(self.files(), before)

    @staticmethod
    def fail_with():
        raise ndmap.DataLossError("not the one that was sent")

    def test_one_export_at_a_time_writes_into_a_folder(self):
        made = OutputFiles(self.folder)
        with self.assertRaisesRegex(ndmap.OutputError, f"cannot write into '{self.folder}': another export is writing"):
            OutputFiles(self.folder)
        made.take_back()
        OutputFiles(self.folder).keep()
        self.assertEqual(os.listdir(self.folder), [])

    def test_one_that_was_killed_is_in_nobodys_way(self):
        program = f"from ndmap.output import OutputFiles; import os; OutputFiles({self.folder!r}); os._exit(9)"
        self.assertEqual(subprocess.run([sys.executable, "-c", program], check=False).returncode, 9)
        self.assertEqual(os.listdir(self.folder), [".ndmap-lock"])
        OutputFiles(self.folder).keep()
        self.assertEqual(os.listdir(self.folder), [])

    def test_folders_that_were_made_for_nothing_go(self):
        made = OutputFiles(f"{self.folder}/a/b")
        made.take_back()
        self.assertEqual(os.listdir(self.folder), [])


if __name__ == "__main__":
    unittest.main()
