# SPDX-License-Identifier: GPL-3.0-or-later
"""The programs under test, without any client of ours. NDMAP_BIN names their folder."""
import json
import os
import subprocess

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
