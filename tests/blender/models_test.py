"""The three models of translucency, and an opaque material, all from Blender's own scene."""

import bpy
import numpy as np
import support
from support import check

support.install()
support.empty_scene()
support.add_camera((0, -6, 1), (0, 0, 0), 25)
support.add_lamp("SUN", (-4, -2, 3), (0, 0, 0), 3.0)
ball = support.add_ball(None)


def picture(material):
    ball.data.materials.clear()
    ball.data.materials.append(material)
    result = support.render(material.name)
    check(np.isfinite(result).all(), material.name + ": every pixel is a number")
    # The ball covers a third of the picture; lit from the left, above.
    left, right = result[:, :24].mean(), result[:, 24:].mean()
    check(left > 1.5 * right, material.name + ": the lit side is the bright one (%.3f, %.3f)"
          % (left, right))
    return result


plain = bpy.data.materials.new("opaque")
plain.use_nodes = True
pictures = {"OPAQUE": picture(plain)}
for model in ("DIPOLE", "SVD", "MEDIUM"):
    material = support.translucent(model)
    if model == "SVD":
        material.nacre.preset = "SVD_S10_Chess8x8"
    if model == "MEDIUM":
        material.nacre.ior = 1.0  # a sun finds its way through no glass but by chance
    pictures[model] = picture(material)
for model in ("DIPOLE", "SVD", "MEDIUM"):
    check(support.relative_l2(pictures[model], pictures["OPAQUE"]) > 0.05,
          model + " isn't the opaque picture")

# Light goes on into the shadow, the farther the less absorbing the medium is.
marble = support.translucent("DIPOLE", mm_per_unit=4.0)
clear = picture(marble)
shadow = np.s_[14:30, 33:37]
check(clear[shadow].mean() > 1.3 * pictures["DIPOLE"][shadow].mean(),
      "a smaller ball lets more light into its shadow (%.4f against %.4f)"
      % (clear[shadow].mean(), pictures["DIPOLE"][shadow].mean()))

# A medium without a boundary of index, path traced, and the dipole of the same medium, whose theory it is: a ball
# of 53 free paths, twice as large for a grey one. What the dipole's picture adds is its coat's reflection.
def even(model):
    material = support.translucent(model, mm_per_unit=20.0)
    material.nacre.ior = 1.0
    material.nacre.roughness = 1.0
    return material


scene = bpy.context.scene
scene.nacre.samples = 64
exact, diffuse = picture(even("MEDIUM")), picture(even("DIPOLE"))
scene.nacre.samples = 8
ratio = diffuse.mean() / exact.mean()
check(0.9 < ratio < 1.1, "dipole and medium send back alike (%.3f)" % ratio)

# A file instead of a preset is the same material.
measured = support.translucent("SVD")
measured.nacre.source = "FILE"
from nacre_blender import presets  # noqa: E402

preset = presets.all_presets()["SVD_S10_Chess8x8"]
measured.nacre.file = preset["folder"] + "/" + preset["files"]["material"]
check(support.relative_l2(picture(measured), pictures["SVD"]) < 0.02,
      "a file is what its preset is")
support.done()
