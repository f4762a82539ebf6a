#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures ndmap: speed and memory beside one plain CGAL map, and the three published experiments. Writes
docs/benchmarks.json and, from it, docs/benchmarks.md and the plots in docs/pictures/.

  bench/run.py [core] [routing] [blocks] [memory] [--surface FILE.off --grid 9x12x8] [--repeat 3]

Without a name all four are run, one program at a time. With --report nothing is run and the page is written
again. Every sample is kept with the machine's load when it began: work of others makes numbers worse.
"""

import argparse
import datetime
import json
import os
import subprocess
import sys
import tempfile

import benchmark_page
from common import DOCS, add_arguments, load_json, must_run, save_json

EXPERIMENTS = ["core", "routing", "blocks", "memory"]
KEPT = ["made", "hexahedra", "removed", "cut", "inside", "darts", "vertices", "critical_darts", "messages",
        "message_bytes", "hash", "valid", "stopped_by_memory", "levels_reached", "seconds", "cpu_seconds", "user_seconds",
        "system_seconds", "peak_rss_bytes", "processes"]
DEPTH = 5  # Of the core job and of time against blocks; one less for the routing, one level is a factor of four.
MEMORY_DEPTH = 8  # More than fits.
MEMORY_LIMIT = "256MiB"
CORE_BLOCKS = [1, 2, 4]
ROUTING_BLOCKS = [2, 4, 8, 16, 32]
TIME_BLOCKS = [1, 2, 4, 8, 16, 32]
MEMORY_BLOCKS = [1, 2, 4, 8]


class Bench:
    def __init__(self, arguments, surface, results):
        self.arguments, self.surface, self.results = arguments, surface, results
        self.grid = ["--grid", arguments.grid] if arguments.grid else ["--cubes", str(arguments.cubes)]

    def job(self, depth):
        return [self.surface, *self.grid, "--depth", str(depth)]

    def ndmap(self, depth, blocks, *flags):
        load = os.getloadavg()[0]
        result, _ = must_run(self.arguments.build, "ndmap",
                             ["run", *self.job(depth), "--blocks", str(blocks), *flags, "--json"])
        sample = {k: result[k] for k in KEPT}
        sample["load"] = load
        for name in ("refined", "refined_at_boundary", "messages", "message_bytes"):
            sample["refine_" + name] = sum(level.get(name, 0) for level in result["levels"])
        for name in ("busy_seconds", "accounted_bytes", "hexahedra"):
            sample["block_" + name] = [block[name] for block in result["blocks"]]
        return sample

    def plain(self, depth):
        load = os.getloadavg()[0]
        result, _ = must_run(self.arguments.build, "bench_plain_cgal", self.job(depth))
        del result["surface"]
        return {**result, "load": load}

    def core_job(self, depth):
        """The same block algorithms in one process, without services."""
        load = os.getloadavg()[0]
        done = subprocess.run([os.path.join(self.arguments.build, "bin", "bench_core_job"), *self.job(depth),
                               "--blocks", "1"], stdout=subprocess.PIPE, text=True, check=True)
        sample = {"load": load, "seconds": {}, "user_seconds": {}, "system_seconds": {}, "peak_rss_bytes": 0}
        for phase in json.loads(done.stdout)[:-1]:
            for to, name in (("seconds", "wall"), ("user_seconds", "user"), ("system_seconds", "system")):
                sample[to][phase["phase"]] = sample[to].get(phase["phase"], 0) + phase[name]
            sample["peak_rss_bytes"] = max(sample["peak_rss_bytes"], phase["peak_rss_bytes"])
            if phase["phase"] == "trim":
                sample["made"] = phase["removed"] + phase["hexahedra"]
        return sample

    def repeat(self, experiment, measurements, times):
        """All of the measurements once, then again: what disturbs the machine disturbs all alike."""
        samples = {name: [] for name in measurements}
        for number in range(times):
            for name, measure in measurements.items():
                samples[name].append(measure())
                print(f"{experiment}: {name} {number + 1}/{times}", file=sys.stderr, flush=True)
        self.results[experiment] = {"samples": samples, "date": datetime.date.today().isoformat()}
        save_json(self.arguments.json, self.results)

    def core(self):
        measurements = {"plain": lambda: self.plain(DEPTH), "core": lambda: self.core_job(DEPTH)}
        for blocks in CORE_BLOCKS:
            measurements[f"ndmap {blocks}"] = lambda b=blocks: self.ndmap(DEPTH, b)
        self.repeat("core", measurements, self.arguments.repeat)

    def routing(self):
        self.repeat("routing", {f"{routing} {b}": lambda b=b, r=routing: self.ndmap(DEPTH - 1, b, "--routing", r)
                                for b in ROUTING_BLOCKS for routing in ("direct", "broadcast")}, self.arguments.repeat)

    def blocks(self):
        self.repeat("blocks", {str(b): lambda b=b: self.ndmap(DEPTH, b) for b in TIME_BLOCKS}, self.arguments.repeat)

    def memory(self):
        self.repeat("memory", {str(b): lambda b=b: self.ndmap(MEMORY_DEPTH, b, "--memory-limit", MEMORY_LIMIT)
                               for b in MEMORY_BLOCKS}, 1)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_arguments(parser)
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help=f"of {', '.join(EXPERIMENTS)}")
    parser.add_argument("--surface", help="default: ndmap's sample bumpy-torus, with --cubes 11")
    parser.add_argument("--grid", help="AxBxC")
    parser.add_argument("--cubes", type=int, default=11)
    parser.add_argument("--repeat", type=int, default=3, help="samples of each number; the page gives medians")
    parser.add_argument("--report", action="store_true", help="run nothing, only write the page again")
    parser.add_argument("--json", default=os.path.join(DOCS, "benchmarks.json"))
    parser.add_argument("--page", default=os.path.join(DOCS, "benchmarks.md"))
    arguments = parser.parse_args()
    unknown = [e for e in arguments.experiments if e not in EXPERIMENTS]
    if unknown:
        parser.error(f"no experiment {unknown[0]}: {', '.join(EXPERIMENTS)} expected")
    results = load_json(arguments.json)
    if not arguments.report:
        with tempfile.TemporaryDirectory(prefix="ndmap-bench-") as scratch:
            surface = arguments.surface
            if surface is None:
                surface = os.path.join(scratch, "bumpy-torus.off")
                must_run(arguments.build, "ndmap", ["sample", "bumpy-torus", "-o", surface, "--json"])
            bench = Bench(arguments, surface, results)
            for experiment in arguments.experiments or EXPERIMENTS:
                getattr(bench, experiment)()
    benchmark_page.write(arguments.page, results)


if __name__ == "__main__":
    main()
