#!/usr/bin/env python3
"""Verbs under 1, 2 and 4 ranks, and a model of more.

    bench/scaling/scaling.py NACRE [--mpirun MPIRUN] [--only VERB …] [--keep measured.json]
                             [--page docs/scaling.md]
    bench/scaling/scaling.py --from measured.json [--page docs/scaling.md]

runs verbs that share their work on two sizes of data, one thread a rank, checks that what
they write has the same bytes, fits a model of their cost (model.py) and prints the tables of
docs/scaling.md, or puts them there.
"""

import argparse
import array
import hashlib
import json
import math
import operator
import os
import random
import re
import resource
import struct
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

    def start(self, arguments, ranks):
        launch = [] if ranks == 1 else [
            self.mpirun, "-n", str(ranks), "--oversubscribe", "--bind-to", "none"]
        return subprocess.Popen(launch + [self.nacre, *arguments, "-v", "--threads", "1"],
                                cwd=self.folder, env=self.environment, text=True,
                                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)

    def run(self, arguments, ranks, copies=1):
        """Seconds of the wall, CPU-seconds of all and of the busiest rank, its messages; of
        `copies` that run side by side (the arguments have a place for the copy's number)."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.monotonic()
        running = [self.start([a.replace("#", str(k)) for a in arguments], ranks)
                   for k in range(copies)]
        said = [process.communicate()[1] for process in running]
        wall = time.monotonic() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if any(process.returncode != 0 for process in running):
            raise SystemExit(f"{arguments} under {ranks}: {said}")
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        cpu /= copies
        row = {"ranks": ranks, "wall": wall, "cpu": cpu, "busiest": cpu, "bytes": 0, "messages": 0}
        told = re.search(r"^ranks: (\{.*\})$", said[0], re.M)
        if told:
            traffic = json.loads(told.group(1))
            row.update(busiest=max(traffic["cpu_seconds_by_rank"]),
                       cpu=sum(traffic["cpu_seconds_by_rank"]),
                       bytes=max(traffic["bytes_by_rank"]),
                       messages=max(traffic["messages_by_rank"]),
                       bytes_in_all=traffic["bytes"], messages_in_all=traffic["messages"])
        return row

    def measure(self, case):
        """One process has a copy of itself beside it, as a rank has another: each of two busy
        cores is slower than one that is busy alone."""
        rows = []
        for size, (label, arguments) in zip(case["sizes"], case["runs"]):
            digests = set()
            out = self.folder / ("0" + case["out"])
            command = [*arguments, "--out", "#" + case["out"]]
            for ranks in RANKS:
                out.unlink(missing_ok=True)
                row = self.run(command, ranks, copies=2 if ranks == 1 else 1)
                digests.add(hashlib.sha256(out.read_bytes()).hexdigest())
                row.update(size=size, label=label, written=out.stat().st_size)
                if ranks == 1 and not rows:
                    row["alone"] = self.run(command, 1)["cpu"]
                rows.append(row)
                print(f"{case['name']:12} {label:18} {ranks} ranks: {row['busiest']:.2f} CPU-s "
                      f"the busiest of {row['cpu']:.2f}, {row['wall']:.2f} s", file=sys.stderr)
            if len(digests) != 1:
                raise SystemExit(f"{case['name']} {label}: other bytes under other numbers of ranks")
        return rows

    def tool(self, *arguments):
        self.run(list(arguments), 1)

    def dataset(self, name, points, core):
        """A veined stone made up: profiles between two of a slab, no two slices alike."""
        levels = 64
        cells = [(u - core // 2, v - core // 2) for v in range(core) for u in range(core)]
        profiles = []
        for level in range(levels):
            t = level / (levels - 1)
            profiles.append([
                (0.9 - 0.5 * t) * math.exp(-math.hypot(u, v) * (0.25 + 0.1 * c + 0.3 * t))
                / (1 + u * u + v * v) for c in range(3) for u, v in cells])
        draw = random.Random(1)
        noise = [1 + 0.01 * draw.gauss(0, 1) for _ in range(1 << 16)]
        size = 3 * core * core
        head = str({"descr": "<f4", "fortran_order": False,
                    "shape": (points[1], points[0], 3, core, core)}).encode()
        head += b" " * (63 - (10 + len(head)) % 64) + b"\n"
        with open(self.folder / "made.npy", "wb") as file:
            file.write(b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head)
            for y in range(points[1]):
                for x in range(points[0]):
                    vein = math.sin(0.11 * x + 2 * math.sin(0.07 * y)) ** 2
                    at = draw.randrange(len(noise) - size)
                    array.array("f", map(operator.mul, profiles[int(vein * (levels - 1))],
                                         noise[at:at + size])).tofile(file)
        self.tool("import", "made.npy", "--from", "npy", "--axes", "yxcvu", "--pitch-mm", "0.4",
                  "--eta", "1.5", "--out", name)

    def cases(self, only):
        """Each with two sizes of data; `size` is in values of R_d, or samples of a picture."""
        def wanted(name):
            return not only or any(o in name for o in only)

        def case(name, data, arguments, **more):
            """`data`: names, points and cores of two sizes."""
            return dict({
                "name": name, "out": "o.rd.exr", "passes": 0,
                "sizes": [p[0] * p[1] * core * core * 3 for _, p, core in data],
                "runs": [(f"{p[0]} × {p[1]} points, core {core}", [arguments[0], n, *arguments[1:]])
                         for n, p, core in data]}, **more)

        marble = (SOURCE / "rigs/marble-flat.toml").read_text()
        windows = [("w32.toml", (8, 4), 39), ("w128.toml", (16, 8), 39)]
        beams = [("b8.toml", (4, 2), 39), ("b32.toml", (8, 4), 39)]
        for name, points, core in windows + beams:
            (self.folder / name).write_text(grid(marble, points, core))
        # SVDs are shared from 8192 slices on.
        many = [("many.rd.exr", (128, 128), 21), ("more.rd.exr", (256, 192), 21)]
        few = [("few.rd.exr", (40, 40), 9), ("some.rd.exr", (64, 64), 11)]
        cases = [
            case("simulate fast", windows, ["simulate", "--solver", "fast"]),
            case("simulate mc", beams, ["simulate", "--solver", "mc", "--photons", "100000"])]
        for method, most in (("svd", {"most_ranks": 64}), ("log-svd", {"most_ranks": 64})):
            cases.append(case(f"factor {method}", many,
                              ["factor", "--method", method, "--terms", "10"],
                              out="o.nacre.exr", passes=2, made=True, **most))
        for method, most_ranks in (("nmf", 64), ("tucker", 16)):
            cases.append(case(f"factor {method}", many,
                              ["factor", "--method", method, "--terms", "6"],
                              out="o.nacre.exr", passes=4, made=True, most_ranks=most_ranks))
        # Its pairs are ten million at most, its sums eight, one rank after the other.
        cases.append(case("factor reciprocal", few, ["factor", "--method", "reciprocal"],
                          out="o.nacre.exr", passes=5, made=True, most_ranks=8, most_size=2e7,
                          chain=True))
        for method, passes in (("bilinear", 4), ("profiles", 11)):
            cases.append(case(f"factor {method}", few, ["factor", "--method", method],
                              out="o.nacre.exr", passes=passes, made=True))
        cases.append(case("cluster", many, ["cluster", "--clusters", "8"], out="o.exr", passes=1,
                          made=True))
        cases = [c for c in cases if wanted(c["name"])]
        for name, points, core in many + few:
            if any(c.get("made") and name in c["runs"][0][1] + c["runs"][1][1] for c in cases):
                self.dataset(name, points, core)
        if wanted("reconstruct"):
            cases.append(self.reconstruct_case())
        scene = str(SOURCE / "bench/render/scenes/sphere.xml")
        render = {
            "name": "render", "out": "o.exr", "passes": 0, "queue": True,
            "sizes": [model.SAMPLES * s**2 for s in (192, 384)],
            "runs": [(f"{s}² pixels, {model.SAMPLES} samples",
                      ["render", scene, "-D", f"size={s}", "--spp", str(model.SAMPLES),
                       "--sampling", "even"])
                     for s in (192, 384)]}
        return cases + ([render] if wanted("render") else [])

    def reconstruct_case(self):
        """Sessions of rigs/simulated-chessboard4x4.toml and of its inner quarter, seen by a quarter
        of the camera's pixels."""
        rig = (SOURCE / "rigs/simulated-chessboard4x4.toml").read_text()
        phantom = (SOURCE / "rigs/chessboard4x4.toml").read_text()
        core = 15
        half = rig
        for whole in ("width_px = 560", "height_px = 560", "field_mm = 172.0",
                      "checkerboard_square_mm = 12.0"):
            name, value = whole.split(" = ")
            number = float(value) if "." in value else int(value)
            if whole not in rig:
                raise SystemExit(f"no {whole} in the rig")
            half = half.replace(whole, f"{name} = {type(number)(number / 2)}")
        made = []
        for points, text in (((32, 32), half), ((64, 64), rig)):
            name = f"rig-{points[0]}"
            (self.folder / "chessboard4x4.toml").write_text(grid(phantom, points, core))
            (self.folder / f"{name}.toml").write_text(grid(text, points, core))
            self.tool("capture", f"{name}.toml", "--out", f"session-{name}")
            self.tool("calibrate", f"session-{name}", "--out", f"{name}.json")
            made.append((name, points))
        sizes = [p[0] * p[1] * core * core * 3 for _, p in made]
        read = sum(f.stat().st_size for f in (self.folder / f"session-{made[-1][0]}").rglob("*"))
        return {"name": "reconstruct", "sizes": sizes, "out": "o.rd.exr", "passes": 1,
                "read_bytes_a_value": read / sizes[-1],
                "runs": [(f"{p[0]} × {p[1]} points, core {core}",
                          ["reconstruct", f"session-{name}", "--calibration", f"{name}.json"])
                         for name, p in made]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("nacre", nargs="?")
    parser.add_argument("--mpirun", default="mpirun")
    parser.add_argument("--only", nargs="*", default=[])
    parser.add_argument("--keep")
    parser.add_argument("--from", dest="measured")
    parser.add_argument("--page")
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
            slower = [case["rows"][0]["cpu"] / case["rows"][0]["alone"] for case in cases]
            print(f"CPU-seconds beside a copy over alone: {min(slower):.2f} to {max(slower):.2f}",
                  file=sys.stderr)
        print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores", file=sys.stderr)
    if arguments.keep:
        Path(arguments.keep).write_text(json.dumps(cases, indent=1))
    tables = model.tables(cases)
    print("\n\n".join("\n".join(lines) for lines in tables))
    if arguments.page:
        page = Path(arguments.page)
        page.write_text(model.replace_tables(page.read_text(), tables))


if __name__ == "__main__":
    main()
