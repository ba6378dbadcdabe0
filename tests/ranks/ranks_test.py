#!/usr/bin/env python3
"""Verbs under mpirun: the same bytes as one process; a picture outlives its ranks.

    ranks_test.py NACRE MPIRUN

prints what differs and exits with 1 if anything does.
"""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "faults"))
import line  # noqa: E402

PHANTOM = """channels = ["R", "G"]
[slab]
thickness_mm = 10.0
eta = 1.5
[[medium]]
name = "white"
sigma_a_per_mm = [0.02, 0.04]
sigma_s_per_mm = [2.2, 2.6]
[[medium]]
name = "dark"
sigma_a_per_mm = [0.06, 0.2]
sigma_s_per_mm = [1.2, 1.6]
[pattern]
type = "chessboard"
cell_mm = 4
[grid]
points = [7, 6]
pitch_mm = 1.5
core = 5
"""

SCENE = """<scene version="0.6.0">
  <default name="size" value="24"/>
  <integrator type="path"/>
  <shape type="sphere">
    <subsurface type="dipole">
      <string name="material" value="marble"/><float name="scale" value="5"/>
    </subsurface>
  </shape>
  <emitter type="point">
    <point name="position" x="9" y="9" z="20"/>
    <spectrum name="intensity" value="500"/>
  </emitter>
  <sensor type="perspective">
    <float name="fov" value="30"/>
    <transform name="toWorld">
      <lookat origin="0,0,6" target="0,0,0" up="0,1,0"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="$size"/><integer name="height" value="$size"/>
    </film>
  </sensor>
</scene>
"""

SIMULATE = ["simulate", "phantom.toml", "--threads", "1", "--out", "o.rd.exr", "--solver"]
RENDER = ["render", "ball.xml", "--threads", "1", "--out", "o.exr", "--max-lit-points", "3000", "--no-lazy"]
DATA = "data.rd.exr"  # simulated before the rest
SESSION = "session"  # captured

# What is run under 2 ranks, under 4, and alone; and what it writes.
COMMANDS = [
    (["cluster", DATA, "--clusters", "3", "--threads", "1", "--out", "o.exr"], "o.exr"),
    (["factor", DATA, "--method", "svd", "--terms", "2", "--clusters", "2", "--threads", "1",
      "--out", "o.nacre.exr", "--json"], "o.nacre.exr"),
    (["factor", DATA, "--method", "nmf", "--terms", "2", "--threads", "1",
      "--out", "o.nacre.exr", "--json"], "o.nacre.exr"),
    (["factor", DATA, "--method", "tucker", "--terms", "2", "--threads", "1",
      "--out", "o.nacre.exr", "--json"], "o.nacre.exr"),
    (["factor", DATA, "--method", "bilinear", "--terms", "2", "--threads", "1",
      "--out", "o.nacre.exr", "--json"], "o.nacre.exr"),
    (["factor", DATA, "--method", "profiles", "--terms", "2", "--threads", "1",
      "--out", "o.nacre.exr", "--json"], "o.nacre.exr"),
    (["factor", DATA, "--method", "reciprocal", "--terms", "2", "--sides", "1", "--threads", "1",
      "--out", "o.nacre.exr", "--json"], "o.nacre.exr"),
    (["reconstruct", SESSION, "--calibration", "c.json", "--threads", "1", "--out", "o.rd.exr"],
     "o.rd.exr"),
    (SIMULATE + ["fast"], "o.rd.exr"),
    (SIMULATE + ["mc", "--photons", "3000"], "o.rd.exr"),
    (SIMULATE + ["mc", "--beam", "1,0", "--error", "0.9"], "o.rd.exr"),
    (RENDER + ["--lazy", "--adaptive", "--spp", "20"], "o.exr"),
    (RENDER + ["--reference", "--spp", "2"], "o.exr"),
]

# What works with devices and what is soon done is for one process.
ALONE = [
    ["capture", "rig.toml", "--out", "another"],
    ["calibrate", SESSION, "--out", "another"],
    ["edit", DATA, "--out", "another"],
]

# A picture that takes seconds (a kill takes half of one to be heard of), and shows itself after its first passes.
LONG = ["render", "ball.xml", "--threads", "1", "--out", "long.exr", "-D", "size=128", "--spp", "384",
        "--sampling", "even", "--checkpoint", "half", "--snapshot", "0.02"]


class Runner:
    def __init__(self, nacre, mpirun, folder):
        self.nacre = nacre
        self.mpirun = mpirun
        self.folder = Path(folder)
        self.failures = []
        (self.folder / "phantom.toml").write_text(PHANTOM)
        (self.folder / "ball.xml").write_text(SCENE)
        grid = ("[8, 8]", "[12, 12]")  # slices of several batches
        (self.folder / "rig.toml").write_text(line.RIG.format(size=160).replace(*grid))
        grey = line.PHANTOM.format(channels='"R"', a="0.02", s="2.2")
        (self.folder / "grey.toml").write_text(grey.replace(*grid))

    def start(self, ranks, arguments):
        launch = [] if ranks == 1 else [
            self.mpirun, "-n", str(ranks), "--oversubscribe", "--bind-to", "none"]
        environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1",
                           OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1", OPENBLAS_NUM_THREADS="1")
        return subprocess.Popen(launch + [self.nacre, *arguments], cwd=self.folder,
                                env=environment, text=True, errors="replace",
                                stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def run(self, ranks, arguments):
        process = self.start(ranks, arguments)
        out, err = process.communicate(timeout=100)
        return process.returncode, out, err

    def check(self, holds, what):
        if not holds:
            self.failures.append(what)
            print("FAILED:", what, flush=True)

    def same_bytes(self):
        for arguments in (["simulate", "phantom.toml", "--solver", "fast", "--out", DATA],
                          ["capture", "rig.toml", "--out", SESSION],
                          ["calibrate", SESSION, "--out", "c.json"]):
            code, _, err = self.run(1, arguments)
            self.check(code == 0, f"{arguments}: {code} {err}")
        for arguments, written in COMMANDS:
            name = " ".join(arguments)
            made = {}
            for ranks in (1, 2, 4):
                file = self.folder / written
                file.unlink(missing_ok=True)
                code, out, err = self.run(ranks, arguments)
                self.check(code == 0, f"{name} under {ranks}: {code} {err}")
                lines = lines if ranks > 1 else out.count("\n")
                self.check(out.count("\n") == lines, f"{name} under {ranks} said: {out}")
                made[ranks] = file.read_bytes() if file.exists() else None
            for ranks in (2, 4):
                self.check(made[ranks] == made[1], f"{name}: other bytes under {ranks} ranks")

    def one_error(self):
        """All ranks find out, one says so, and the exit code is that of one process."""
        code, _, err = self.run(2, ["simulate", "nothing.toml", "--out", "o.rd.exr"])
        alone, _, _ = self.run(1, ["simulate", "nothing.toml", "--out", "o.rd.exr"])
        self.check(code == alone != 0, f"exit code {code} for a missing file, {alone} alone")
        self.check("nothing.toml" in err, f"no word of nothing.toml: {err}")

    def refused(self):
        """One line, the exit code of a usage error, and nothing is written."""
        for arguments in ALONE:
            code, out, err = self.run(2, arguments)
            self.check(code == 2 and not out, f"{arguments} under 2: {code} {out}")
            self.check("run it without mpirun" in err, f"{arguments} under 2: {err}")
            self.check(not (self.folder / "another").exists(), f"{arguments} under 2 wrote")

    def killed(self):
        """SIGKILL of a rank, then the same command again: the bytes of a picture made in one go."""
        picture = self.folder / "long.exr"
        kept = self.folder / "half"
        code, _, err = self.run(1, LONG)
        self.check(code == 0, f"render: {code} {err}")
        whole = picture.read_bytes()
        for victim in (1, 0):
            picture.unlink()
            kept.unlink(missing_ok=True)
            process = self.start(2, LONG)
            pid = self.rank_of(process, victim)
            while not picture.exists() and process.poll() is None:
                time.sleep(0.005)
            os.kill(pid, signal.SIGKILL)
            _, err = process.communicate(timeout=100)
            self.check(process.returncode != 0, f"exit code 0 with rank {victim} killed")
            if victim == 1:  # the root has the time to keep what it has
                self.check(kept.exists(), f"nothing was kept: {err}")
                self.check("the same command goes on" in err, f"no word of going on: {err}")
            code, _, err = self.run(2, LONG)
            self.check(code == 0, f"taken up again: {code} {err}")
            self.check(picture.read_bytes() == whole, f"other bytes after rank {victim} was killed")

    def rank_of(self, mpirun, rank):
        """The process of a rank, once it has begun."""
        for _ in range(1000):
            for status in Path("/proc").glob("[0-9]*/status"):
                try:
                    parent = f"PPid:\t{mpirun.pid}\n" in status.read_text()
                    environment = (status.parent / "environ").read_bytes()
                except OSError:
                    continue
                if parent and f"OMPI_COMM_WORLD_RANK={rank}\0".encode() in environment:
                    return int(status.parent.name)
            time.sleep(0.01)
        raise SystemExit(f"no rank {rank} of {mpirun.args}")


def main():
    nacre, mpirun = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(str(Path(nacre).resolve()), mpirun, folder)
        runner.same_bytes()
        runner.one_error()
        runner.refused()
        runner.killed()
    print(f"{len(runner.failures)} failures")
    return 1 if runner.failures else 0


if __name__ == "__main__":
    sys.exit(main())
