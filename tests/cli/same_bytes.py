#!/usr/bin/env python3
"""Every verb that writes an artefact, run in other ways: the bytes have to be the same.

    same_bytes.py NACRE                       threads, OpenBLAS's threads
    same_bytes.py NACRE --quick               three threads, without what takes longest
    same_bytes.py NACRE --only factor         commands whose names have that word
    same_bytes.py NACRE --cpu                 libraries told to use fewer instructions too
    same_bytes.py NACRE --processors          other processors too, by qemu-user
    same_bytes.py NACRE --other NACRE2        another build (any number of them)
    same_bytes.py NACRE --no-threads          not the threads

prints a table and exits with 1 if anything differs that may not.
"""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "faults"))
from line import Line, content  # noqa: E402

METHODS = ["svd", "sqrt-svd", "tucker", "nmf", "profiles", "bilinear", "reciprocal"]

SLOW = ["run", "export mtlx", "export cycles", "report session", "report material", "simulate diffusion"]

THREADS = {
    "2 threads": (2, {"OPENBLAS_NUM_THREADS": "2"}),
    "3 threads": (3, {"OPENBLAS_NUM_THREADS": "3"}),
}

# What chooses its instructions at run time, told not to.
CPU = {
    "OpenBLAS: SSE": (1, {"OPENBLAS_CORETYPE": "Prescott"}),
    "glibc: no FMA, AVX2": (1, {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F"}),
    "OpenCV: SSE3": (1, {"OPENCV_CPU_DISABLE": "SSE4_1,SSE4_2,AVX,FP16,AVX2,AVX512_SKX"}),
    "Embree: SSE2": (1, {"NACRE_TEST_EMBREE": "isa=sse2"}),
}

# What the whole command runs on: without AVX, and with AVX2 and FMA but no AVX-512.
# OpenBLAS takes the first for one with AVX.
PROCESSORS = {"Nehalem": {"OPENBLAS_CORETYPE": "Prescott"}, "Haswell": {}}


def commands(line):
    """(name, arguments, what it writes), those of the line and others of the same verbs."""
    yield from line.commands()
    phantom = ["simulate", "phantom.toml", "--out", "o.rd.exr"]
    yield "simulate mc", phantom + ["--solver", "mc", "--photons", "2000"], ["o.rd.exr"]
    yield "simulate diffusion", phantom + ["--solver", "diffusion"], ["o.rd.exr"]
    factor = ["factor", "d.rd.exr", "--terms", "2", "--out", "o.nacre.exr", "--method"]
    for method in METHODS:
        yield f"factor {method}", factor + [method], ["o.nacre.exr"]
    yield "factor reciprocal sides", factor + ["reciprocal", "--sides", "1", "--rest", "2"], ["o.nacre.exr"]
    yield "factor clusters", factor + ["log-svd", "--clusters", "3"], ["o.nacre.exr"]
    render = ["render", "ball.xml", "--spp", "2", "--out", "o.exr", "--aovs"]
    yield "render reference", render + ["--reference"], ["o.exr"]
    yield "render adaptive", render + ["--adaptive"], ["o.exr"]
    yield "import npy", ["import", "scan.npy", "--from", "npy", "--pitch-mm", "2", "--out", "o.rd.exr"], ["o.rd.exr"]
    yield "export sss", ["export", "d.rd.exr", "--to", "sss", "--out", "o.sss"], ["o.sss"]
    yield "export cycles", ["export", "m.nacre.exr", "--to", "cycles", "--out", "o"], ["o"]
    preset = ["preset", "make", "m.nacre.exr", "--dataset", "d.rd.exr", "--name", "one", "--out", "o"]
    yield "preset make", preset + ["--thumbnail-px", "16", "--thumbnail-spp", "2"], ["o"]
    yield "report material", ["report", "m.nacre.exr", "--out", "o.html"], ["o.html"]
    yield "report session", ["report", "session", "--out", "o.html"], ["o.html"]


def write_npy(path):
    """An array of 4 x 4 points with windows of 3 x 3, as doubles."""
    header = "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 4, 3, 3), }"
    header += " " * (63 - (10 + len(header)) % 64) + "\n"
    import struct

    values = [1e-3 * (1 + n % 9) / (1 + n // 9) for n in range(144)]
    path.write_bytes(
        b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + struct.pack("<144d", *values)
    )


def run(line, arguments, outputs, folder, threads, environment, nacre=None):
    copy = line.copy(folder)
    environment = dict(environment)
    embree = environment.pop("NACRE_TEST_EMBREE", None)
    if embree:  # Embree looks for its settings in the home folder
        (copy / ".embree3").write_text(embree + "\n")
        environment["HOME"] = str(copy)
    result = line.run(arguments, copy, environment, threads=threads, nacre=nacre, timeout=1800)
    if result.returncode != 0:
        raise SystemExit(f"{' '.join(arguments)}: exit code {result.returncode}: {result.stderr}")
    files = content(copy, outputs)
    files.pop("o/lock", None)  # whose process a session was
    return copy, files


def numbers(value):
    if isinstance(value, dict):
        return [n for key in sorted(value) for n in numbers(value[key])]
    if isinstance(value, list):
        return [n for element in value for n in numbers(element)]
    return [float(value)] if isinstance(value, (int, float)) else []


def difference(nacre, one, other):
    """How far two files are apart, relatively; None where that can't be said."""
    if one.suffix == ".json":
        a, b = (numbers(json.loads(f.read_text())) for f in (one, other))
        if len(a) != len(b):
            return None
        return max((abs(x - y) / max(abs(x), abs(y), 1e-300) for x, y in zip(a, b)), default=0)
    result = subprocess.run(
        [nacre, "compare", str(other), str(one), "--json", "--quiet"], capture_output=True, text=True, check=False
    )
    if result.returncode != 0:
        return None
    return json.loads(result.stdout).get("relative_l2")


def compare(nacre, reference, made):
    """"same", or what the worst file differs by."""
    (folder, files), (other, others) = reference, made
    if files.keys() != others.keys():
        return "other files"
    worst = 0
    for name, data in files.items():
        if data != others[name]:
            off = difference(nacre, folder / name, other / name)
            if off is None or math.isnan(off):
                return f"{name} differs"
            worst = max(worst, off, sys.float_info.min)
    return worst if worst else "same"


def emulated(nacre, processor, folder):
    """The command on another processor: every choice of instructions is another one."""
    qemu = shutil.which("qemu-x86_64")
    if qemu is None:
        raise SystemExit("--processors needs qemu-x86_64 (Debian: qemu-user)")
    script = Path(folder) / processor
    script.write_text(f'#!/bin/sh\nexec {qemu} -cpu {processor} {nacre} "$@" 2>/dev/null\n')
    script.chmod(0o755)
    return str(script)


def chosen_ways(arguments, nacre, folder):
    """{column: (threads, environment, command or None)}"""
    ways = {} if arguments.no_threads else {name: (*way, None) for name, way in THREADS.items()}
    if arguments.quick:
        ways.pop("2 threads", None)
    if arguments.cpu:
        ways.update({name: (*way, None) for name, way in CPU.items()})
    if arguments.processors:
        for name, environment in PROCESSORS.items():
            ways[name] = (1, environment, emulated(nacre, name, folder))
    for other in arguments.other:
        ways[Path(other).resolve().parent.name] = (1, {}, os.path.abspath(other))
    return ways


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("nacre")
    parser.add_argument("--cpu", action="store_true")
    parser.add_argument("--processors", action="store_true")
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--no-threads", action="store_true")
    parser.add_argument("--only", default="")
    parser.add_argument("--other", action="append", default=[], help="another build of it")
    parser.add_argument("--bound", type=float, default=0, help="relative difference that all but threads may make")
    arguments = parser.parse_args()
    nacre = os.path.abspath(arguments.nacre)
    failed = 0
    with tempfile.TemporaryDirectory() as scratch:
        ways = chosen_ways(arguments, nacre, scratch)
        line = Line(nacre, Path(scratch) / "inputs")
        write_npy(line.folder / "scan.npy")
        print("| command | " + " | ".join(ways) + " |\n|---|" + "---|" * len(ways))
        for name, words, outputs in commands(line):
            if arguments.only not in name or (arguments.quick and name in SLOW):
                continue
            reference = run(line, words, outputs, Path(scratch) / "one", 1, {})
            assert reference[1], f"{name} wrote nothing"
            cells = []
            for way, (threads, environment, other) in ways.items():
                made = run(line, words, outputs, Path(scratch) / "other", threads, environment, other)
                found = compare(nacre, reference, made)
                bound = 0 if way in THREADS else arguments.bound
                failed += found != "same" and not (isinstance(found, float) and found <= bound)
                cells.append(found if isinstance(found, str) else f"{found:.1e}")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    if failed:
        raise SystemExit(f"{failed} differ by more than they may")


if __name__ == "__main__":
    main()
