#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures navigation: the latency of one beta and of a 2-ring, many betas at once, and a traversal of a whole map through
the SDK's Navigator beside the same traversal of one plain CGAL map. Real services on loopback. Writes
docs/navigation.json and, from it, docs/performance-navigation.md.

  bench/navigate.py [--blocks 4] [--surface FILE.off --cubes 11 --depth 4]

With --report nothing is run and the page is written again. The load average when it began is kept: work of others makes
numbers worse.
"""

import argparse
import datetime
import json
import os
import subprocess
import sys
import tempfile
from statistics import median

from common import DOCS, add_arguments, load_json, must_run, save_json, table

HEAD = """# Navigation: how fast

Made by `bench/navigate.py`, which keeps what was measured in [navigation.json](navigation.json) and writes this page. It
needs the release preset's programs.

```console
$ bench/navigate.py
```

One client, {processes} block servers and a coordinator on one machine of {cores} cores, over loopback. The map: `ndmap sample
bumpy-torus`, `--cubes {cubes}`, refined to depth {depth}, {hexahedra:,} hexahedra and {darts:,} darts in {blocks} blocks.
Load average when it began: {load:.1f} ({load_said}); {date}. CPU seconds are given as user + system.

"""


def start_cluster(build, processes):
    """`ndmap up` and its coordinator's address."""
    up = subprocess.Popen([os.path.join(build, "bin", "ndmap"), "up", "--processes", str(processes), "--json"],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
    said = ""
    while not said.endswith("}\n"):
        line = up.stdout.readline()
        if not line:
            sys.exit("ndmap up ended")
        said += line
    return up, json.loads(said)["coordinator"]


def measure(arguments, scratch):
    surface = arguments.surface
    if surface is None:
        surface = os.path.join(scratch, "bumpy-torus.off")
        must_run(arguments.build, "ndmap", ["sample", "bumpy-torus", "-o", surface, "--json"])
    load = os.getloadavg()[0]
    up, coordinator = start_cluster(arguments.build, arguments.processes)
    try:
        for name in ("still", "busy"):
            must_run(arguments.build, "ndmap", ["create", name, surface, "--cubes", str(arguments.cubes), "--blocks",
                                                str(arguments.blocks), "--coordinator", coordinator, "--json"])
        must_run(arguments.build, "ndmap", ["refine", "still", "--depth", str(arguments.depth), "--coordinator", coordinator,
                                            "--json"])
        result, _ = must_run(arguments.build, "bench_navigate",
                             [coordinator, "still", "--busy", "busy", "--busy-depth", str(arguments.depth + 1), "--samples",
                              str(arguments.samples), "--repeat", str(arguments.repeat)])
    finally:
        up.terminate()
        up.wait()
        up.stdout.close()
    return {**result, "load": load, "load_at_end": os.getloadavg()[0], "cores": os.cpu_count(),
            "date": datetime.date.today().isoformat(), "processes": arguments.processes, "cubes": arguments.cubes,
            "depth": arguments.depth}


def cpu(part, who=("client", "servers")):
    return sum(part[name][kind] for name in who if name in part for kind in ("user", "system"))


def split(part, who):
    return f"{part[who]['user']:.2f} + {part[who]['system']:.2f}" if who in part else "-"


def middle(samples):
    """The sample of median wall time."""
    return sorted(samples, key=lambda s: s["wall"])[len(samples) // 2]


def latency_page(result):
    rows = []
    for key, title, aim in (("beta", "one β (`Walk` of one dart)", 0.5), ("beta_described", "one β with all that is there (`Beta`)", 0),
                            ("two_ring", "2-ring of a hexahedron across faces (`Explore`)", 0),
                            ("beta_while_refining", "one β of a block that refines", 50)):
        part = result["latency"].get(key)
        if not part or not part["samples"]:
            continue
        verdict = "" if not aim else f"p99 < {aim:g}: {'yes' if part['p99'] < aim else 'no'}"
        rows.append([title, f"{part['samples']:,}", *(f"{part[p]:.3f}" for p in ("p50", "p90", "p99", "max")), verdict])
    return """## Latency

From the C++ client, one question after the other, of darts anywhere in the map; milliseconds.

""" + table(["question", "samples", "p50", "p90", "p99", "max", "aim"], rows) + """
The last row is of a map that is refined from its initial grid at the time of the questions, by as many worker threads as
there are cores: a question waits for a step of work of its block, and for a core.

"""


def batched_page(result):
    rows = []
    for part in result["batched"]:
        rows.append([",".join(part["word"]), part["order"], f"{part['betas'] / part['wall'] / 1e6:.1f}",
                     f"{part['betas'] / cpu(part) / 1e6:.1f}", split(part, "client"), split(part, "servers"),
                     f"{part['betas']:,}"])
    slowest = min(part["betas"] / cpu(part) for part in result["batched"])
    return """## Many at once

`MapHandle::Walk` of all darts of the map, again and again: one call for each 131,072 darts of one server, all crossings
followed by the servers. A core is a CPU second of client and servers together. *As traversed*: darts that lie near each
other in the blocks mostly follow each other; *scattered*: in random order.

""" + table(["word", "order", "million β a second", "million β a core", "client CPU, s", "servers CPU, s", "β"], rows) + f"""
Aim: above 1 million a second a core. The slowest: {slowest / 1e6:.1f} million.

"""


def traversal_page(result):
    t = result["traversal"]
    darts, hexahedra = t["cold"]["darts"], t["cold"]["hexahedra"]
    warm, cgal = middle(t["warm"]), middle(t["cgal"])
    rows = []
    for title, part, beside in (("plain CGAL", cgal, cgal), ("Navigator, once fetched", warm, cgal),
                                ("Navigator, with fetching", t["cold"], cgal),
                                ("plain CGAL, with every dart's point", middle(t["cgal_points"]), middle(t["cgal_points"])),
                                ("Navigator, once fetched, with every dart's point", middle(t["warm_points"]),
                                 middle(t["cgal_points"]))):
        rows.append([title, f"{part['wall']:.3f}", f"{3 * darts / part['wall'] / 1e6:.1f}", f"{hexahedra / part['wall']:,.0f}",
                     split(part, "client"), split(part, "servers"), f"{part['wall'] / beside['wall']:.2f}",
                     f"{cpu(part, ['client']) / max(cpu(beside, ['client']), 1e-9):.2f}"])
    ratio = median(part["wall"] for part in t["warm"]) / median(part["wall"] for part in t["cgal"])
    return f"""## The whole map, dart by dart

From one dart by β1, β2 and β3 until every hexahedron was visited, so every dart was, and each β asked once: {3 * darts:,} β. The
peer is the same map as one `Linear_cell_complex_for_combinatorial_map` with CGAL's own storage, in the client's
process; the same code goes over both, with CGAL's marks there and arrays of bits beside the Navigator. Sums of the points
of all darts in the order of their visits are compared to the bit. Medians of {len(t['warm'])} traversals, but one with fetching:
{t['fetched']['fetches']:,} calls, {t['fetched']['bytes'] / 1e6:.0f} MB.

""" + table(["", "wall, s", "million β a second", "hexahedra a second", "client CPU, s", "servers CPU, s", "wall, by CGAL's",
             "client CPU, by CGAL's"], rows) + f"""
Aim: the Navigator within 3 times plain CGAL, once fetched. It is {ratio:.2f} times.

"""


def write(path, result):
    load_said = "more than the cores: programs waited for each other" if result["load"] > result["cores"] else "a quiet machine"
    text = HEAD.format(**{**result, "hexahedra": result["traversal"]["cold"]["hexahedra"],
                          "darts": result["traversal"]["cold"]["darts"], "load_said": load_said})
    text += latency_page(result) + batched_page(result) + traversal_page(result)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text.rstrip("\n") + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_arguments(parser)
    parser.add_argument("--surface", help="default: ndmap's sample bumpy-torus")
    parser.add_argument("--cubes", type=int, default=11)
    parser.add_argument("--depth", type=int, default=4)
    parser.add_argument("--blocks", type=int, default=4)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--samples", type=int, default=10000, help="of one beta; a tenth of it of 2-rings")
    parser.add_argument("--repeat", type=int, default=5, help="traversals of each kind")
    parser.add_argument("--report", action="store_true", help="run nothing, only write the page again")
    parser.add_argument("--json", default=os.path.join(DOCS, "navigation.json"))
    parser.add_argument("--page", default=os.path.join(DOCS, "performance-navigation.md"))
    arguments = parser.parse_args()
    if not arguments.report:
        with tempfile.TemporaryDirectory(prefix="ndmap-bench-") as scratch:
            save_json(arguments.json, measure(arguments, scratch))
    write(arguments.page, load_json(arguments.json))


if __name__ == "__main__":
    main()
