# SPDX-License-Identifier: GPL-3.0-or-later
"""What the benchmark scripts share: where things are, how the programs are run, how results are kept."""

import json
import os
import resource
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
DOCS = os.path.join(ROOT, "docs")


def add_arguments(parser):
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "release"), help="build folder")
    parser.add_argument("--meshes", default=os.path.join(ROOT, "..", "shared", "meshes", "surfaces"),
                        help="folder with the surfaces")


def find_surface(folder, name):
    """The file NAME.off or NAME.off.xz of the folder; None if it has neither."""
    for suffix in (".off", ".off.xz"):
        path = os.path.join(folder, name + suffix)
        if os.path.exists(path):
            return path
    return None


def run_program(build, program, arguments):
    """Runs a program of the build tree that prints one JSON object. Returns (object or None, what it wrote to
    standard error, exit code, {"user", "system"} seconds of it and its children)."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([os.path.join(build, "bin", program), *arguments], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = {"user": after.ru_utime - before.ru_utime, "system": after.ru_stime - before.ru_stime}
    try:
        result = json.loads(done.stdout)
    except ValueError:
        result = None
    return result, done.stderr, done.returncode, cpu


def must_run(build, program, arguments):
    """As run_program, for a run that has to succeed: ends this program with its message otherwise."""
    result, errors, code, cpu = run_program(build, program, arguments)
    if code != 0 or result is None:
        sys.exit(f"{program} {' '.join(arguments)}: exit code {code}\n{errors}")
    return result, cpu


def load_json(path):
    if not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def save_json(path, value):
    """Whole or not at all: a run that is stopped loses nothing."""
    with open(path + ".part", "w", encoding="utf-8") as file:
        json.dump(value, file, indent=1, sort_keys=True)
        file.write("\n")
    os.replace(path + ".part", path)


def table(head, rows):
    """A Markdown table; numbers to the right."""
    lines = ["| " + " | ".join(head) + " |", "|" + "|".join("---" if i == 0 else "--:" for i in range(len(head))) + "|"]
    lines += ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"
