"""The line in the small: inputs, and a command of every verb that writes something."""

import os
import shutil
import subprocess
from pathlib import Path

PHANTOM = """channels = [{channels}]
[slab]
thickness_mm = 10.0
eta = 1.5
[[medium]]
name = "white"
sigma_a_per_mm = [{a}]
sigma_s_per_mm = [{s}]
g = 0.0
[[medium]]
name = "dark"
sigma_a_per_mm = [{a}]
sigma_s_per_mm = [{s}]
g = 0.5
[pattern]
type = "chessboard"
cell_mm = 4
[grid]
points = [8, 8]
pitch_mm = 2.0
core = 5
"""

RIG = """kind = "simulated"
[sample]
name = "tiny"
eta = 1.5
[grid]
points = [8, 8]
pitch_mm = 2.0
core = 5
[camera]
exposures_us = [40000, 2000]
dark_frames = 2
target_exposure_us = 12000
flat_exposures_us = [1000, 3000, 6000, 10000]
[targets]
checkerboard_columns = 10
checkerboard_rows = 7
checkerboard_square_mm = 5.5
checkerboard_poses = 6
reference_reflectance = 0.99
reference_exposure_us = 100
laser_lattice = 5
[scanner]
mm_per_rad = 400.0
channels = ["R"]
[schedule]
spot_spacing_cells = 5
[simulated]
phantom = "grey.toml"
seed = 1
[simulated.camera]
width_px = {size}
height_px = {size}
field_mm = 82.0
electrons_per_us_per_radiance = [6.5]
[simulated.laser]
power_mw = [10.0]
[simulated.lamp]
electrons_per_us = 1.4
"""

SCENE = """<scene version="0.6.0">
  <shape type="ply"><string name="filename" value="mesh.ply"/>
    <subsurface type="svd">
      <string name="material" value="m.nacre.exr"/>
      <string name="mapping" value="triplanar"/>
    </subsurface>
  </shape>
  <emitter type="point">
    <point name="position" x="9" y="9" z="20"/>
    <spectrum name="intensity" value="500"/>
  </emitter>
  <sensor type="perspective">
    <transform name="toWorld">
      <lookat origin="0,0,20" target="0,0,0" up="0,1,0"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="16"/><integer name="height" value="16"/>
    </film>
  </sensor>
</scene>
"""

OBJ = """v -3 -3 0
v 3 -3 0
v 3 3 1
v -3 3 1
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3
f 1/1 3/3 4/4
"""

PROJECT = """[[stage]]
run = "simulate phantom.toml --solver fast --out p.rd.exr"
[[stage]]
run = "factor p.rd.exr --method svd --terms 2 --out p.nacre.exr"
"""


class Line:
    """Inputs in one folder, made once; commands that are run in copies of it."""

    def __init__(self, nacre, folder):
        self.nacre = str(nacre)
        self.folder = Path(folder)
        self.folder.mkdir(parents=True)
        self._write_texts()
        for arguments in (
            ["simulate", "phantom.toml", "--solver", "fast", "--out", "d.rd.exr"],
            ["factor", "d.rd.exr", "--method", "reciprocal", "--terms", "1", "--out", "m.nacre.exr"],
            ["mesh", "mesh.obj", "mesh.ply"],
            ["export", "d.rd.exr", "--to", "psf", "--out", "d.psf"],
            ["capture", "rig.toml", "--out", "session"],
            ["calibrate", "session", "--out", "c.json"],
        ):
            result = self.run(arguments, self.folder)
            if result.returncode != 0:
                raise SystemExit(f"{arguments}: {result.stderr}")

    def _write_texts(self):
        three = PHANTOM.format(channels='"R", "G", "B"', a="0.02, 0.04, 0.07", s="2.2, 2.6, 3.0")
        grey = PHANTOM.format(channels='"R"', a="0.02", s="2.2")
        for name, text in (
            ("phantom.toml", three),
            ("grey.toml", grey),
            ("rig.toml", RIG.format(size=160)),
            ("ball.xml", SCENE),
            ("mesh.obj", OBJ),
            ("p.toml", PROJECT),
        ):
            (self.folder / name).write_text(text)

    def commands(self):
        """(verb, arguments, what it writes) of every verb that leaves something behind."""
        return [
            ("simulate", ["simulate", "phantom.toml", "--solver", "fast", "--out", "o.rd.exr"], ["o.rd.exr"]),
            ("capture", ["capture", "rig.toml", "--out", "o"], ["o"]),
            ("calibrate", ["calibrate", "session", "--out", "o.json"], ["o.json"]),
            ("reconstruct", ["reconstruct", "session", "--calibration", "c.json", "--out", "o.rd.exr"], ["o.rd.exr"]),
            ("cluster", ["cluster", "d.rd.exr", "--clusters", "3", "--out", "o.exr"], ["o.exr", "o.png"]),
            ("edit", ["edit", "d.rd.exr", "--range", "1.2", "--out", "o.rd.exr"], ["o.rd.exr"]),
            ("factor", ["factor", "d.rd.exr", "--method", "log-svd", "--terms", "2", "--out", "o.nacre.exr"], ["o.nacre.exr"]),
            ("import", ["import", "d.psf", "--from", "psf", "--pitch-mm", "2", "--out", "o.rd.exr"], ["o.rd.exr"]),
            ("export", ["export", "d.rd.exr", "--to", "psf", "--out", "o.psf"], ["o.psf"]),
            ("export mtlx", ["export", "m.nacre.exr", "--to", "mtlx", "--out", "o"], ["o"]),
            ("mesh", ["mesh", "mesh.obj", "o.ply"], ["o.ply"]),
            ("render", ["render", "ball.xml", "--spp", "2", "--out", "o.exr", "--png", "o.png"], ["o.exr", "o.png"]),
            ("report", ["report", "d.rd.exr", "--out", "o.html"], ["o.html"]),
            ("run", ["run", "p.toml"], ["p.rd.exr", "p.nacre.exr"]),
        ]

    def copy(self, folder):
        """A folder for one command: the inputs, without copying their bytes."""
        folder = Path(folder)
        if folder.exists():
            shutil.rmtree(folder)
        shutil.copytree(self.folder, folder, copy_function=os.link)
        return folder

    def run(self, arguments, folder, environment=None, preexec=None, timeout=120, threads=1, nacre=None):
        variables = dict(os.environ)
        variables.pop("NACRE_FAULT", None)
        # With more it doesn't load in little memory, and sums in another order.
        variables["OPENBLAS_NUM_THREADS"] = "1"
        variables.update(environment or {})
        return subprocess.run(
            [nacre or self.nacre, *arguments]
            + ([] if arguments == ["--version"] else ["--threads", str(threads)]),
            cwd=folder,
            env=variables,
            capture_output=True,
            text=True,
            errors="replace",
            preexec_fn=preexec,
            timeout=timeout,
            check=False,
        )


def content(folder, names):
    """Bytes of files, and of all files in folders, by their paths."""
    result = {}
    for name in names:
        path = Path(folder) / name
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        for file in files:
            if file.exists():
                result[str(file.relative_to(folder))] = file.read_bytes()
    return result
