#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Breaks each rule of the protocol on purpose and counts how many random cases notice.

usage: tests/property/mutations.py [--seeds N] [--build build/release]

Each mutation replaces one piece of core/algorithm/refine in a copy of the sources, which is compiled with the
flags of an existing build and run on seeds 0 ... N-1. A rule that no seed misses is reported as redundant.
Prints a table; exits 1 when a mutation that must be noticed is not.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SUBDIVIDER = "core/algorithm/refine/subdivider.h"
REFINE = "core/algorithm/refine/refine.h"
GEOMETRY = "core/algorithm/refine/geometry.h"

# (rule, file, what stands there, what is put there, must be noticed)
MUTATIONS = [
    ("sign of halves", SUBDIVIDER, "const unsigned begin = c.positive ? 0 : 1;", "const unsigned begin = 0;", True),
    ("sign of digits 2 and 3", SUBDIVIDER, "c.positive ? two : three, c.peer", "two, c.peer", True),
    ("face base label", SUBDIVIDER, "const Label base = AncestorLabel(c.label, l);", "const Label base = c.label;",
     True),
    ("the digit-2 label names a face", SUBDIVIDER, "if (l == 0 || LastDigit(name) == 2) return name;", "return name;",
     True),
    ("keep what is not made yet", REFINE, "    kept_[label].push_back(kind);\n    ++kept_count_;\n", "", True),
    ("retry after an own refinement", REFINE,
     "if (absl::Status status = RetryKept(out); !status.ok()) return status;\n      steps += 3;",
     "subdivider_.made_labels().clear();\n      steps += 3;", True),
    ("four-vertex check", REFINE, "if (!F::FaceIsWhole(map_, d, l)) {", "if (false) {", False),
    ("relay after SplitEdge", REFINE, "if (split.dart != d) Tell(kSplitEdge, split.label, split.dart, out);", "", True),
    ("relay after SplitFace", REFINE, "if (split.dart != x) Tell(kSplitEdge, split.label, split.dart, out);", "", True),
    ("tell others of an own edge", REFINE,
     "if (map_.template attribute<3>(split.dart) != cell) Tell(kSplitEdge, split.label, split.dart, out);", "", True),
    ("volume-centre order", GEOMETRY, "std::sort(values.begin(), values.end());", "", True),
    ("face centre from diagonals", GEOMETRY,
     "return Midpoint(Midpoint(corners[0], corners[2]), Midpoint(corners[1], corners[3]));",
     "return Midpoint(Midpoint(corners[0], corners[1]), Midpoint(corners[2], corners[3]));", True),
]


def compile_and_run(build, replaced, seeds):
    """How many of the seeds fail with `replaced` (file, text) in place of the original."""
    with tempfile.TemporaryDirectory() as work:
        shutil.copytree(os.path.join(ROOT, "core"), os.path.join(work, "core"))
        shutil.copytree(os.path.join(ROOT, "tests"), os.path.join(work, "tests"))
        with open(os.path.join(work, replaced[0]), "w") as f:
            f.write(replaced[1])
        program = os.path.join(work, "mutant")
        libraries = ["tests/reference/libndmap_reference.a", "core/libndmap_core_checked.a"]
        absl = sorted(f for f in os.listdir("/usr/lib/x86_64-linux-gnu") if re.fullmatch(r"libabsl_.*\.so", f))
        command = (["g++", "-std=c++20", "-O1", "-w", "-frounding-math", "-ffp-contract=off", "-I" + work]
                   + [os.path.join(work, s) for s in ("tests/property/property_main.cc",
                                                      "tests/property/property_case.cc",
                                                      "core/algorithm/registry.cc")]
                   + [os.path.join(build, lib) for lib in libraries] + ["-l" + a[3:-3] for a in absl]
                   + ["-lxxhash", "-lmetis", "-lz", "-llzma", "-lgmp", "-lmpfr", "-o", program])
        subprocess.run(command, check=True)
        first, failed = None, 0
        for seed in range(seeds):
            run = subprocess.run([program, "--seed", str(seed), "--storage", "flat"], stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL, timeout=600)
            if run.returncode != 0:
                failed += 1
                first = seed if first is None else first
        return failed, first


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--build", default=os.path.join(ROOT, "build", "release"))
    parser.add_argument("--only", help="mutations whose name contains this")
    options = parser.parse_args()
    missed = False
    print(f"{'rule broken':34} {'seeds':>6} {'failing':>8} {'first':>6}  verdict")
    for rule, path, old, new, must in MUTATIONS:
        if options.only and options.only not in rule:
            continue
        text = open(os.path.join(ROOT, path)).read()
        if text.count(old) != 1:
            sys.exit(f"mutation '{rule}': {path} has its text {text.count(old)} times, expected once")
        failed, first = compile_and_run(options.build, (path, text.replace(old, new)), options.seeds)
        if failed:
            verdict = "noticed"
        else:
            verdict = "NOT NOTICED" if must else "redundant"
            missed = missed or must
        print(f"{rule:34} {options.seeds:6} {failed:8} {'-' if first is None else first:>6}  {verdict}", flush=True)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
