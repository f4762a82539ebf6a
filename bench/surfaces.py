#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""The main job on real surfaces, held against a count that has no map at all. Writes docs/surfaces.json and,
from it, docs/surfaces.md. Cases that are done are not run again, so it can be stopped and started at any time.

  bench/surfaces.py [--only elephant --only cow] [--report]

The exit code is 1 if anything does not agree, and 2 if something has not been run yet.
"""

import argparse
import os
import shutil
import sys
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

from common import DOCS, add_arguments, find_surface, load_json, must_run, run_program, save_json, table

# name, --grid (None: what ndmap chooses), depth. Of these cow and dragon_871k intersect themselves.
SURFACES = [
    ("elephant", "9x12x8", 5),
    ("armadillo", "10x11x9", 5),
    ("bunny_52000", "10x10x8", 5),
    ("cow", "14x9x5", 5),
    ("turbineblade_199k", "8x12x6", 4),
    ("knot2", None, 4),
    ("cheese", None, 4),
    ("dragon_871k", None, 4),
]
# A sample of ndmap's own, so that one row needs no file; with the counts that are published for it.
REFERENCE = ("bumpy-torus", "--cubes 11", 5)
REFERENCE_COUNTS = {"made": 853490, "cut": 366186, "inside": 234838}
SELF_INTERSECTING = {"cow", "dragon_871k"}
BLOCKS = [1, 2, 4, 8, 32]
BROADCAST_BLOCKS = [4, 8]
EXPORT_BLOCKS = 4
COUNTS = ["made", "cut", "inside"]
KEPT = ["made", "cut", "inside", "removed", "hexahedra", "darts", "vertices", "critical_darts", "messages",
        "message_bytes", "hash", "valid", "grid", "findings"]
INSIDE, CUT = 2, 3  # Values of the cell array "state".


def volumes(folder):
    """Volume and number of the inside and of the cut cells of an export, from the points of its cells."""
    volume, count = {INSIDE: 0.0, CUT: 0.0}, {INSIDE: 0, CUT: 0}
    for name in sorted(os.listdir(folder)):
        if not name.endswith(".vtu"):
            continue
        reader = vtkXMLUnstructuredGridReader()
        reader.SetFileName(os.path.join(folder, name))
        reader.Update()
        grid = reader.GetOutput()
        points = vtk_to_numpy(grid.GetPoints().GetData())
        corners = points[vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 8)]
        low, high = corners.min(axis=1), corners.max(axis=1)
        off = np.minimum(corners - low[:, None, :], high[:, None, :] - corners)
        assert np.all(off == 0), "a cell is not a box"
        size = np.prod(high - low, axis=1)
        state = vtk_to_numpy(grid.GetCellData().GetArray("state"))
        for s in (INSIDE, CUT):
            volume[s] += float(size[state == s].sum())
            count[s] += int((state == s).sum())
    return {"v_inside": volume[INSIDE], "v_cut": volume[CUT], "inside": count[INSIDE], "cut": count[CUT]}


class Case:
    """One surface: its runs, kept by a name for each."""

    def __init__(self, arguments, results, name, grid, depth):
        self.arguments, self.results, self.name, self.depth = arguments, results, name, depth
        self.grid = grid
        self.runs = results.setdefault(name, {})

    def file(self):
        if self.name != REFERENCE[0]:
            return find_surface(self.arguments.meshes, self.name)
        path = os.path.join(self.arguments.scratch, self.name + ".off")
        if not os.path.exists(path):
            must_run(self.arguments.build, "ndmap", ["sample", self.name, "-o", path, "--json"])
        return path

    def grid_flags(self):
        if self.grid is None:
            return []
        return self.grid.split() if self.grid.startswith("--") else ["--grid", self.grid]

    def keep(self, key, value):
        self.runs[key] = value
        save_json(self.arguments.json, self.results)
        print(f"{self.name}: {key}", file=sys.stderr, flush=True)

    def refine(self, blocks, routing, depth, export):
        key = f"{blocks} {routing} depth {depth}" + (" export" if export else "")
        if key in self.runs:
            return
        folder = tempfile.mkdtemp(dir=self.arguments.scratch)
        flags = ["run", self.file(), *self.grid_flags(), "--depth", str(depth), "--blocks", str(blocks), "--routing",
                 routing, "--json"]
        try:
            result, errors, code, _ = run_program(self.arguments.build, "ndmap",
                                                  flags + (["-o", folder] if export else []))
            if result is None:
                sys.exit(f"ndmap {' '.join(flags)}: exit code {code}\n{errors}")
            value = {k: result[k] for k in KEPT}
            value["seconds"] = result["seconds"]["total"]
            value["exit_code"] = code
            value["told_self_intersections"] = "intersect" in errors
            if export:
                value["export"] = volumes(folder)
            self.keep(key, value)
        finally:
            shutil.rmtree(folder)

    def octree(self, depth):
        """The same grid, counted by a program that has no map."""
        key = f"octree depth {depth}"
        if key in self.runs:
            return
        flags = self.grid_flags()
        if not flags:
            flags = ["--grid", self.runs[f"{EXPORT_BLOCKS} direct depth 1 export"]["grid"]]
        result, _ = must_run(self.arguments.build, "ndmap_octree_count", [self.file(), *flags, "--depth", str(depth)])
        self.keep(key, result)

    def run_all(self):
        if self.file() is None:
            print(f"{self.name}: not in {self.arguments.meshes}", file=sys.stderr)
            return
        for depth in range(1, self.depth + 1):
            self.refine(EXPORT_BLOCKS, "direct", depth, True)
            self.octree(depth)
        for blocks in BLOCKS:
            if blocks != EXPORT_BLOCKS:
                self.refine(blocks, "direct", self.depth, False)
        for blocks in BROADCAST_BLOCKS:
            self.refine(blocks, "broadcast", self.depth, False)

    def expected_runs(self):
        keys = [f"{EXPORT_BLOCKS} direct depth {d} export" for d in range(1, self.depth + 1)]
        keys += [f"octree depth {d}" for d in range(1, self.depth + 1)]
        keys += [f"{b} direct depth {self.depth}" for b in BLOCKS if b != EXPORT_BLOCKS]
        return keys + [f"{b} broadcast depth {self.depth}" for b in BROADCAST_BLOCKS]

    def missing(self):
        return [key for key in self.expected_runs() if key not in self.runs]

    def exported(self):
        """Depth, run and octree count of every depth that is there."""
        for depth in range(1, self.depth + 1):
            run = self.runs.get(f"{EXPORT_BLOCKS} direct depth {depth} export")
            octree = self.runs.get(f"octree depth {depth}")
            if run and octree:
                yield depth, run, octree

    def problems(self):
        found = []
        refined = {k: r for k, r in self.runs.items() if not k.startswith("octree")}
        for key, run in refined.items():
            if run["valid"] is not True or run["exit_code"] != 0:
                found.append(f"{key}: not valid: {run['findings']}")
            if run["told_self_intersections"] != (self.name in SELF_INTERSECTING):
                found.append(f"{key}: ndmap's warning of self-intersections is not what is known of the surface")
            octree = self.runs.get(f"octree depth {key.split('depth ')[1].split()[0]}")
            if octree and any(run[c] != octree[c] for c in COUNTS):
                found.append(f"{key}: {[run[c] for c in COUNTS]}, but the octree has {[octree[c] for c in COUNTS]}")
            if self.name == REFERENCE[0] and f"depth {self.depth}" in key:
                found += [f"{key}: {c} is {run[c]}" for c in COUNTS if run[c] != REFERENCE_COUNTS[c]]
        hashes = {run["hash"] for key, run in refined.items() if f"depth {self.depth}" in key}
        if len(hashes) > 1:
            found.append(f"different hashes at depth {self.depth}: {sorted(hashes)}")
        return found + self.volume_problems()

    def volume_problems(self):
        found, before = [], None
        for depth, run, octree in self.exported():
            export = run["export"]
            for c in ("inside", "cut"):
                if export[c] != octree[c]:
                    found.append(f"depth {depth}: {export[c]} cells {c} in the export, {octree[c]} in the octree")
            if self.name not in SELF_INTERSECTING:
                if not export["v_inside"] <= octree["v_surface"] <= export["v_inside"] + export["v_cut"]:
                    found.append(f"depth {depth}: V(surface) is not between V(inside) and V(inside) + V(cut)")
            if before is not None and not export["v_cut"] < before:
                found.append(f"depth {depth}: V(cut) does not fall")
            before = export["v_cut"]
        return found


def hexahedra_row(case):
    done = [k for k in case.expected_runs() if not k.startswith("octree") and k in case.runs and
            f"depth {case.depth}" in k]
    octree = case.runs.get(f"octree depth {case.depth}")
    if not done or not octree:
        return None
    run = case.runs[done[0]]
    names = [k.split()[0] + (" broadcast" if "broadcast" in k else "") for k in done]
    return [case.name, run["grid"], case.depth, *[f"{octree[c]:,}" for c in COUNTS],
            ", ".join(sorted(names, key=lambda n: (len(n) > 3, int(n.split()[0])))), f"`{run['hash'][:8]}…`",
            "no: see below" if case.problems() else "yes"]


def volume_rows(case):
    for depth, run, octree in case.exported():
        export, surface = run["export"], abs(octree["v_surface"])
        yield [case.name, depth, f"{export['v_inside'] / surface:.5f}", f"{export['v_cut'] / surface:.5f}",
               f"{(export['v_inside'] + export['v_cut']) / surface:.5f}"]


def report(cases):
    text = """# Real surfaces, counted twice

Each surface is refined by real services (`ndmap run SURFACE --grid … --depth … --blocks … --routing …`) with
1, 2, 4, 8 and 32 blocks (direct routing), and with 4 and 8 blocks once more with broadcast routing. A row says
yes if for *every* run named in it

- the map is valid: every property of Definition 1 holds, block against block;
- the hexahedra made, cut and inside are as many as `ndmap_octree_count` finds on the same grid: plain
  recursion over boxes with lists of triangles, no map, no blocks, neither ndmap's tree of triangles nor its parity;
- the hash is the same. (It says which cells there are, with their points and how they are joined, and says nothing
  of blocks.)

Made by `bench/surfaces.py`, which ends with an error if anything does not agree; all numbers are in
[surfaces.json](surfaces.json). `bumpy-torus` (`--cubes 11`) is the reference case, a sample that ndmap makes itself. The
others are scans and models in common use, which it does not bring along: `bench/surfaces.py --meshes FOLDER` says
where they are, and what is missing there is left out. Debian's `libcgal-demo` has most of them.

"""
    rows = [row for row in map(hexahedra_row, cases) if row]
    text += table(["surface", "grid", "depth", "made", "cut", "inside", "blocks", "hash", "all agree"], rows)
    text += """
## Volumes

The volume inside the surface lies between that of the hexahedra inside and that of those inside or cut, and what is cut
gets less at every depth. Volumes are those of the mesh itself: the sum over the cells of the exported VTU pieces (4
blocks), by the cell array `state`, from the points of each cell, as VTK's own reader reads them. The number of
cells of each state is compared with the octree count at every depth, too. Volumes are given relative to the volume that
the surface encloses (divergence theorem over its triangles). Surfaces that intersect themselves (cow, dragon_871k) have
no such volume: parity decides what is inside, and only the fall of V(cut) is checked.

"""
    text += table(["surface", "depth", "V(inside)", "V(cut)", "V(inside) + V(cut)"],
                  [row for case in cases for row in volume_rows(case)])
    problems = [f"- {case.name}: {p}" for case in cases for p in case.problems()]
    if problems:
        text += "\n## What does not agree\n\n" + "\n".join(problems) + "\n"
    missing = []
    for case in cases:
        left, all_runs = case.missing(), case.expected_runs()
        if left:
            missing.append(f"- {case.name}: " + ("nothing was run" if len(left) == len(all_runs) else ", ".join(left)))
    if missing:
        text += "\n## Not run yet\n\n" + "\n".join(missing) + "\n"
    return text, problems, missing


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_arguments(parser)
    parser.add_argument("--only", action="append", help="only this surface (again for more)")
    parser.add_argument("--report", action="store_true", help="run nothing, only write the page again")
    parser.add_argument("--json", default=os.path.join(DOCS, "surfaces.json"))
    parser.add_argument("--page", default=os.path.join(DOCS, "surfaces.md"))
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ndmap-surfaces-") as scratch:
        arguments.scratch = scratch
        results = load_json(arguments.json)
        cases = [Case(arguments, results, *surface) for surface in [REFERENCE, *SURFACES]]
        if not arguments.report:
            for case in cases:
                if not arguments.only or case.name in arguments.only:
                    case.run_all()
        text, problems, missing = report(cases)
    with open(arguments.page, "w", encoding="utf-8") as page:
        page.write(text)
    print("\n".join(problems + missing), file=sys.stderr)
    return 1 if problems else 2 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
