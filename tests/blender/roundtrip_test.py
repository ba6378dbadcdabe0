"""A scene built in Blender against the same one written by hand (roundtrip.xml): the same
picture, to noise. A dragon of a preset on a glossy, checkered floor under three kinds of light."""

import os

import bpy
import support
from mathutils import Matrix
from support import check

MESH = os.environ.get("NACRE_TEST_MESH", "")
HAND_WRITTEN = os.path.join(os.path.dirname(os.path.abspath(__file__)), "roundtrip.xml")

support.install()
scene = support.empty_scene()
scene.render.resolution_x, scene.render.resolution_y = 80, 60
scene.nacre.samples = 16

# The mesh, on which both agree; millimetres, y up.
prepared = support.path("mesh.ply")
if os.path.isfile(MESH):
    support.nacre("mesh", MESH, prepared, "--width-mm", "126", "--quiet")
else:
    print("without the dragon (NACRE_TEST_MESH): a monkey instead")
    bpy.ops.mesh.primitive_monkey_add(size=100)
    bpy.context.object.modifiers.new("", "TRIANGULATE")
    bpy.ops.export_mesh.ply(filepath=prepared, use_selection=True, axis_forward="-Z", axis_up="Y")
    bpy.ops.object.delete()
bpy.ops.import_mesh.ply(filepath=prepared)
dragon = bpy.context.object
dragon.data.use_auto_smooth = False
bpy.ops.object.shade_smooth()
# Centimetres, z up.
dragon.matrix_world = Matrix.Scale(0.1, 4) @ Matrix.Rotation(1.5707963267948966, 4, "X")
stone = support.translucent("SVD", mm_per_unit=10.0)
stone.nacre.preset = "SVD_S10_Chess8x8"
stone.nacre.roughness = 0.2 ** 0.5
dragon.data.materials.clear()
dragon.data.materials.append(stone)

bpy.ops.mesh.primitive_plane_add(size=2)
floor = bpy.context.object
floor.matrix_world = Matrix.Scale(40, 4)
polished = bpy.data.materials.new("floor")
polished.use_nodes = True
nodes = polished.node_tree.nodes
shader = nodes["Principled BSDF"]
shader.inputs["Roughness"].default_value = 0.3
checker = nodes.new("ShaderNodeTexChecker")
checker.inputs["Color1"].default_value = (0.3, 0.28, 0.25, 1)
checker.inputs["Color2"].default_value = (0.05, 0.06, 0.07, 1)
checker.inputs["Scale"].default_value = 16
polished.node_tree.links.new(checker.outputs["Color"], shader.inputs["Base Color"])
floor.data.materials.append(polished)

support.add_camera((-3, -29, 8), (0, 0, 3.3), 28)
spot = support.add_lamp("SPOT", (-26, -9, 20), (-0.5, 0, 3.6), 40000.0, (1, 0.97, 0.93))
spot.data.spot_size = 0.6
spot.data.spot_blend = 0
area = support.add_lamp("AREA", (23, -26, 19), (0, 0, 4), 3000.0, (0.8, 0.9, 1))
area.data.shape = "RECTANGLE"
area.data.size, area.data.size_y = 18, 12
scene.world.color = (0.02, 0.022, 0.03)

ours = support.render("blender")
pictures = []
for seed in ("1", "2"):
    out = support.path("hand%s.exr" % seed)
    support.nacre("render", HAND_WRITTEN, "--out", out, "-D", "model=" + prepared,
                  "--seed", seed, "--quiet")
    pictures.append(support.pixels_of(out))
noise = support.relative_l2(pictures[1], pictures[0])
off = support.relative_l2(ours, pictures[0])
means = ours.mean() / pictures[0].mean()
check(0.001 < noise < 0.5, "two seeds differ by %.4f" % noise)
check(off < 1.2 * noise, "the two scenes differ by %.4f (relative L2), two seeds by %.4f"
      % (off, noise))
check(abs(means - 1) < 0.02, "the means' ratio is %.5f" % means)
support.done()
