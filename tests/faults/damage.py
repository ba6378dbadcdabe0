"""Bits turned and ends cut off, of every kind of file; then whatever reads it reads it."""

import json
import random
import shutil

from line import content

# (file, a command that reads all of it, what that writes, whether a turned bit must not
# pass: what others' programs write carries no checksum, so that another number is
# another file)
READERS = [
    ("d.rd.exr", ["factor", "d.rd.exr", "--method", "svd", "--terms", "2", "--out", "o.nacre.exr"], ["o.nacre.exr"], True),
    ("m.nacre.exr", ["render", "ball.xml", "--spp", "1", "--out", "o.exr"], ["o.exr"], True),
    ("c.json", ["reconstruct", "session", "--calibration", "c.json", "--out", "o.rd.exr"], ["o.rd.exr"], True),
    ("session/session.json", ["reconstruct", "session", "--calibration", "c.json", "--out", "o.rd.exr"], ["o.rd.exr"], True),
    ("session/journal", ["reconstruct", "session", "--calibration", "c.json", "--out", "o.rd.exr"], ["o.rd.exr"], True),
    ("session/frames", ["reconstruct", "session", "--calibration", "c.json", "--out", "o.rd.exr"], ["o.rd.exr"], True),
    ("d.psf", ["import", "d.psf", "--from", "psf", "--pitch-mm", "2", "--out", "o.rd.exr"], ["o.rd.exr"], False),
    ("mesh.ply", ["render", "ball.xml", "--spp", "1", "--out", "o.exr"], ["o.exr"], False),
    ("mesh.obj", ["mesh", "mesh.obj", "o.ply"], ["o.ply"], False),
    ("ball.xml", ["render", "ball.xml", "--spp", "1", "--out", "o.exr"], ["o.exr"], False),
    ("phantom.toml", ["simulate", "phantom.toml", "--solver", "fast", "--out", "o.rd.exr"], ["o.rd.exr"], False),
    ("rig.toml", ["capture", "rig.toml", "--plan"], [], False),
    ("p.toml", ["run", "p.toml", "--dry-run"], [], False),
]


def damaged(data, kind, chance):
    """Those bytes with one bit turned, or without their end."""
    if kind == "cut":
        return data[: chance.randrange(len(data))]
    at = chance.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << chance.randrange(8))]) + data[at + 1 :]


def same_numbers(line, folder, outputs):
    """Whether what was written holds the same numbers as in `before`; its provenance
    names the damaged file by its hash, and so is another."""
    for name in outputs:
        result = line.run(["compare", f"before/{name}", name, "--json"], folder)
        if result.returncode != 0 or json.loads(result.stdout)["relative_l2"] != 0:
            return False
    return True


def judge(result, same, must_be_found):
    if result.returncode < 0 or result.returncode == 70:
        return f"exit code {result.returncode}: {result.stderr.strip()[-200:]}"
    if result.returncode not in (0, 1, 2, 3):
        return f"exit code {result.returncode}"
    if result.returncode != 0 and "nacre: " not in result.stderr:
        return f"exit code {result.returncode} without a word"
    if result.returncode == 0 and must_be_found and not same:
        return "passed unseen, and the result is another"
    return None


def run(line, library, folder, most, report, only=None):
    del library
    chance = random.Random(20061)
    for name, arguments, outputs, must_be_found in READERS:
        if only and arguments[0] not in only:
            continue
        line.copy(folder)
        if line.run(arguments, folder).returncode != 0:
            raise SystemExit(f"{arguments} fails by itself")
        truth = content(folder, outputs)
        originals = line.folder.parent / "before"
        shutil.rmtree(originals, ignore_errors=True)
        originals.mkdir()
        for output in outputs:
            shutil.copy(folder / output, originals)
        for kind in ("bit turned", "cut"):
            for k in range(2 * most):
                line.copy(folder)
                path = folder / name
                if path.is_dir():
                    path = chance.choice(sorted(path.iterdir()))
                data = path.read_bytes()
                path.unlink()  # it is a link to the original
                path.write_bytes(damaged(data, kind, chance))
                result = line.run(arguments, folder)
                same = content(folder, outputs) == truth
                if result.returncode == 0 and must_be_found and not same:
                    shutil.copytree(originals, folder / "before")
                    same = same_numbers(line, folder, outputs)
                wrong = judge(result, same, must_be_found)
                if wrong is not None:
                    kept = folder.parent.parent / f"damaged-{path.name}-{k}"
                    shutil.copy(path, kept)
                    wrong += f" (kept as {kept})"
                report.add(arguments[0], f"{name}: {kind}", wrong, " ".join(arguments))
