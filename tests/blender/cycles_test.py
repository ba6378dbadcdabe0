"""Knife-edges by Blender's Cycles, from what we export, against the datasets' own.

Light falls on the half x < 0 of a slab; the exitance across the edge, over that far
from it, is the dataset's edge response E(x) = sum of its slices' columns left of x."""

import os

import bpy
import numpy as np
import support
from support import check

PIXELS = 48
# Of Jensen's table, marble with more colour and skin; pitch and width of the picture in mm.
SAMPLES = {
    "marble": ((0.01, 0.02, 0.06), (2.0, 2.0, 2.0), 0.5, 24.0),
    "skin": ((0.032, 0.17, 0.48), (0.74, 0.88, 1.01), 0.5, 24.0),
    "milk": ((0.0011, 0.0024, 0.014), (2.55, 3.21, 3.77), 0.5, 24.0),
}
PHANTOM = """
[slab]
thickness_mm = "inf"
eta = 1.5
[[medium]]
name = "stone"
sigma_a_per_mm = [%g, %g, %g]
sigma_s_per_mm = [%g, %g, %g]
[pattern]
type = "homogeneous"
[grid]
points = [4, 4]
pitch_mm = %g
core = 121
"""


def dataset_edge(name, x_mm):
    """E at places x_mm, a column a channel, from the slice that the simulator writes."""
    absorption, scattering, pitch_mm, _ = SAMPLES[name]
    phantom, dataset, psf = (support.path(name + end) for end in (".toml", ".rd.exr", ".psf"))
    with open(phantom, "w", encoding="utf-8") as file:
        file.write(PHANTOM % (*absorption, *scattering, pitch_mm))
    support.nacre("simulate", phantom, "--solver", "fast", "--out", dataset, "--quiet")
    support.nacre("export", dataset, "--to", "psf", "--out", psf, "--quiet")
    width, height, core, _ = np.fromfile(psf, "<i4", 4)
    windows = np.fromfile(psf, "<f4", offset=16)
    window = windows.reshape(height, width, core, core, 3)[0, 0].astype(np.float64)
    lines = window.sum(axis=0)
    lines /= lines.sum(axis=0)
    borders = (np.arange(core + 1) - core / 2) * pitch_mm
    # Light that entered left of the edge and leaves at x came from farther than x to the left.
    within = np.vstack([np.zeros(3), np.cumsum(lines, axis=0)])
    return np.stack([1 - np.interp(x_mm, borders, within[:, c]) for c in range(3)], axis=1)


def cycles_edge(name, method):
    maps = support.path(name)
    support.nacre("export", support.path(name + ".rd.exr"), "--to", "cycles", "--out", maps,
                  "--quiet")
    scene = support.empty_scene()
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 400
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 4
    scene.render.resolution_x, scene.render.resolution_y = PIXELS, 4
    # One unit is 10 mm.
    bpy.ops.mesh.primitive_plane_add(size=40)
    plane = bpy.context.object
    plane.data.materials.append(
        cycles_material.build_from_folder(maps, 10.0, method))
    group = plane.data.materials[0].node_tree.nodes["Group"]
    group.inputs["Gloss"].default_value = 0
    bpy.ops.mesh.primitive_plane_add(size=40, location=(20, 0, 0.02))
    blocker = bpy.context.object
    blocker.visible_camera = False
    blocker.visible_diffuse = False
    black = bpy.data.materials.new("black")
    black.diffuse_color = (0, 0, 0, 1)
    blocker.data.materials.append(black)
    sun = support.add_lamp("SUN", (0, 1e-4, 10), (0, 0, 0), 3.0)
    sun.data.angle = 0
    camera = support.add_camera((0, 0, 5), (0, 0, 0), 30, up=(0, 1, 0))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = SAMPLES[name][3] / 10
    picture = support.render("cycles-" + name + method)
    rows = picture.mean(axis=0)
    # Far to the left all light is there.
    camera.location.x = -10
    lit = support.render("lit-" + name + method).mean(axis=(0, 1))
    return rows / lit


support.install()
from nacre_blender import cycles_material  # noqa: E402

for name, method in (("marble", "BURLEY"), ("skin", "BURLEY"), ("milk", "BURLEY"),
                     ("marble", "RANDOM_WALK")):
    x_mm = ((np.arange(PIXELS) + 0.5) / PIXELS - 0.5) * SAMPLES[name][3]
    truth = dataset_edge(name, x_mm)
    edge = cycles_edge(name, method)
    worst = np.abs(edge - truth).max(axis=0)
    rms = np.sqrt(np.mean((edge - truth) ** 2, axis=0))
    print("%s, %s: largest deviation R %.4f G %.4f B %.4f, rms %.4f %.4f %.4f"
          % (name, method, *worst, *rms))
    check(worst.max() < 0.05,
          "%s, %s: Cycles' knife-edge is the dataset's to %.1f %%"
          % (name, method, 100 * worst.max()))

# The conventions of later versions, by the lists of methods that they have.
four_pi = 4 * np.pi
later = ["BURLEY", "RANDOM_WALK", "RANDOM_WALK_SKIN"]
latest = ["BURLEY", "RANDOM_WALK", "RANDOM_WALK_LEGACY"]
check(cycles_material.radius_factor("BURLEY", latest) == (four_pi, False), "Burley: 4 pi d")
check(cycles_material.radius_factor("RANDOM_WALK", later) == (four_pi, True), "4.x: 4 pi s d")
check(cycles_material.radius_factor("RANDOM_WALK", latest) == (1.0, True), "2026: s d")
check(cycles_material.radius_factor("RANDOM_WALK_LEGACY", latest) == (four_pi, True), "legacy")

# The operator, on a preset.
scene = support.empty_scene()
ball = support.add_ball(support.translucent("SVD"))
ball.active_material.nacre.preset = "leaf"
check(bpy.ops.nacre.add_cycles_material() == {"FINISHED"}, "the operator makes a material")
made = ball.active_material
check(made.name.endswith("(Cycles)"), "in the object's slot: " + made.name)
textures = [node.image for node in made.node_tree.nodes["Group"].node_tree.nodes
            if node.type == "TEX_IMAGE"]
check(all(image.has_data or image.size[0] > 1 for image in textures) and len(textures) == 2,
      "both maps are read")
check(all(image.colorspace_settings.name == "Non-Color" for image in textures), "as numbers")
check(os.path.isfile(bpy.path.abspath(textures[0].filepath)), "from the preset")
support.done()
