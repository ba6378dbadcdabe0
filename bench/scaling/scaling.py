#!/usr/bin/env python3
"""Verbs under 1, 2 and 4 ranks, and a model of more.

    bench/scaling/scaling.py NACRE [--mpirun MPIRUN] [--only VERB …] [--keep measured.json]
    bench/scaling/scaling.py --from measured.json

runs verbs that share their work on two sizes of data, one thread a rank, checks that what
they write has the same bytes, fits a model of their cost (model.py) and prints the tables of
docs/scaling.md.
"""

import argparse
import hashlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import model

SOURCE = Path(__file__).resolve().parent.parent.parent
RANKS = (1, 2, 4)


def grid(text, points, core):
    text = re.sub(r"points = \[.*\]", f"points = [{points[0]}, {points[1]}]", text)
    return re.sub(r"core = \d+", f"core = {core}", text)


class Bench:
    def __init__(self, nacre, mpirun, folder):
        self.nacre = str(Path(nacre).resolve())
        self.mpirun = mpirun
        self.folder = Path(folder)
        self.environment = dict(
            os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
            OPENBLAS_NUM_THREADS="1")

    def run(self, arguments, ranks):
        """Seconds of the wall, CPU-seconds of all and of the busiest rank, its messages."""
        launch = [] if ranks == 1 else [
            self.mpirun, "-n", str(ranks), "--oversubscribe", "--bind-to", "none"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        start = time.monotonic()
        result = subprocess.run(launch + [self.nacre, *arguments, "-v", "--threads", "1"],
                                cwd=self.folder, env=self.environment, text=True,
                                capture_output=True, check=False)
        wall = time.monotonic() - start
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if result.returncode != 0:
            raise SystemExit(f"{arguments} under {ranks}: {result.stderr}")
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        row = {"ranks": ranks, "wall": wall, "cpu": cpu, "busiest": cpu, "bytes": 0, "messages": 0}
        said = re.search(r"^ranks: (\{.*\})$", result.stderr, re.M)
        if said:
            traffic = json.loads(said.group(1))
            row.update(busiest=max(traffic["cpu_seconds_by_rank"]),
                       cpu=sum(traffic["cpu_seconds_by_rank"]),
                       bytes=max(traffic["bytes_by_rank"]),
                       messages=max(traffic["messages_by_rank"]),
                       bytes_in_all=traffic["bytes"], messages_in_all=traffic["messages"])
        return row

    def measure(self, case):
        rows = []
        for size, (label, arguments) in zip(case["sizes"], case["runs"]):
            digests = set()
            for ranks in RANKS:
                out = self.folder / case["out"]
                out.unlink(missing_ok=True)
                row = self.run([*arguments, "--out", case["out"]], ranks)
                digests.add(hashlib.sha256(out.read_bytes()).hexdigest())
                row.update(size=size, label=label, written=out.stat().st_size)
                rows.append(row)
                print(f"{case['name']:12} {label:18} {ranks} ranks: {row['busiest']:.2f} CPU-s "
                      f"the busiest of {row['cpu']:.2f}, {row['wall']:.2f} s", file=sys.stderr)
            if len(digests) != 1:
                raise SystemExit(f"{case['name']} {label}: other bytes under other numbers of ranks")
        return rows

    def tool(self, *arguments):
        self.run(list(arguments), 1)

    def cases(self, only):
        """Each with two sizes of data; `size` is in values of R_d, or samples of a picture."""
        def runs(names, *arguments):
            return [(f"{p[0]} × {p[1]} points, core {core}", [arguments[0], n, *arguments[1:]])
                    for n, p, core in names]

        def values(names):
            return [p[0] * p[1] * core * core * 3 for _, p, core in names]

        marble = (SOURCE / "rigs/marble-flat.toml").read_text()
        board = (SOURCE / "rigs/chessboard4x4.toml").read_text()
        windows = [("w4.toml", (2, 2), 39), ("w16.toml", (4, 4), 39)]
        beams = [("b2.toml", (2, 1), 39), ("b8.toml", (4, 2), 39)]
        for text, names in ((marble, windows + beams),):
            for name, points, core in names:
                (self.folder / name).write_text(grid(text, points, core))
        cases = [
            {"name": "simulate fast", "out": "o.rd.exr", "passes": 0, "sizes": values(windows),
             "runs": runs(windows, "simulate", "--solver", "fast")},
            {"name": "simulate mc", "out": "o.rd.exr", "passes": 0, "sizes": values(beams),
             "runs": runs(beams, "simulate", "--solver", "mc", "--photons", "200000")},
        ]
        # Factorizations are shared from 8192 slices on.
        data = [("small.rd.exr", (128, 64), 11), ("large.rd.exr", (128, 128), 11)]
        if not only or {"factor", "cluster"} & set(only):
            for name, points, core in data:
                (self.folder / "board.toml").write_text(grid(board, points, core))
                self.tool("simulate", "board.toml", "--solver", "fast", "--out", name)
        for name, verb, passes, out in (
                ("factor", ["factor", "--method", "log-svd", "--terms", "10"], 2, "o.nacre.exr"),
                ("cluster", ["cluster", "--clusters", "8"], 1, "o.exr")):
            cases.append({"name": name, "sizes": values(data), "out": out, "passes": passes,
                          "runs": runs(data, *verb)})
        if not only or "reconstruct" in only:
            cases.append(self.reconstruct_case())
        scene = str(SOURCE / "bench/render/scenes/sphere.xml")
        cases.append({
            "name": "render", "out": "o.exr", "passes": 0, "sizes": [256 * 96**2, 256 * 192**2],
            "runs": [(f"{s}² pixels, 256 samples",
                      ["render", scene, "-D", f"size={s}", "--spp", "256", "--sampling", "even"])
                     for s in (96, 192)]})
        return [c for c in cases if not only or any(o in c["name"] for o in only)]

    def reconstruct_case(self):
        rig = (SOURCE / "rigs/simulated-chessboard4x4-quick.toml").read_text()
        phantom = (SOURCE / "rigs/chessboard4x4-quick.toml").read_text()
        runs = []
        sizes = []
        for points, core in (((12, 12), 11), ((24, 24), 11)):
            name = f"rig-{points[0]}"
            (self.folder / "chessboard4x4-quick.toml").write_text(grid(phantom, points, core))
            (self.folder / f"{name}.toml").write_text(grid(rig, points, core))
            self.tool("capture", f"{name}.toml", "--out", f"session-{name}")
            self.tool("calibrate", f"session-{name}", "--out", f"{name}.json")
            runs.append((f"{points[0]} × {points[1]} points",
                         ["reconstruct", f"session-{name}", "--calibration", f"{name}.json"]))
            sizes.append(points[0] * points[1] * core * core * 3)
        read = sum(f.stat().st_size for f in (self.folder / "session-rig-24").rglob("*"))
        return {"name": "reconstruct", "runs": runs, "sizes": sizes, "out": "o.rd.exr",
                "passes": 1, "read_bytes_a_value": read / sizes[-1]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("nacre", nargs="?")
    parser.add_argument("--mpirun", default="mpirun")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--keep")
    parser.add_argument("--from", dest="measured")
    arguments = parser.parse_args()
    if arguments.measured:
        cases = json.loads(Path(arguments.measured).read_text())
    else:
        with tempfile.TemporaryDirectory() as folder:
            bench = Bench(arguments.nacre, arguments.mpirun, folder)
            cases = bench.cases(arguments.only)
            for case in cases:
                case["rows"] = bench.measure(case)
                del case["runs"]
        print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores", file=sys.stderr)
    if arguments.keep:
        Path(arguments.keep).write_text(json.dumps(cases, indent=1))
    print(model.tables(cases))


if __name__ == "__main__":
    main()
