"""Surroundings and turned textures against Cycles, which reads the same nodes by its own code."""

import bpy
import numpy as np
import support
from mathutils import Euler
from support import check

support.install()
scene = support.empty_scene()
support.add_camera((0, -6, 1), (0, 0, 0), 25)
scene.nacre.samples = 64
scene.cycles.samples = 64
scene.render.film_transparent = True  # what is lit is compared, not the sky itself
scene.cycles.max_bounces = 1
scene.cycles.use_denoising = False


def both(name):
    pictures = []
    for engine in ("NACRE", "CYCLES"):
        scene.render.engine = engine
        pictures.append(support.render(name + engine))
    return pictures


def halves(picture):
    """Means of left, right, lower and upper half of the middle of the picture."""
    picture = picture[12:36, 12:36]
    middle = picture.shape[0] // 2
    return np.array([picture[:, :middle].mean(), picture[:, middle:].mean(),
                     picture[:middle].mean(), picture[middle:].mean()])


def agree(name, tolerance):
    ours, theirs = (halves(picture) for picture in both(name))
    check(theirs.min() > 1e-3 and np.ptp(theirs) > 0.15 * theirs.mean(),
          "%s: lit everywhere, but unevenly: %s" % (name, np.round(theirs, 4)))
    check(np.max(np.abs(ours / theirs - 1)) < tolerance,
          "%s: ours are within %g of Cycles': %s" % (name, tolerance, np.round(ours, 4)))


# A ball under an uneven sky of floats: bright where u = 0.15 to 0.4, brighter above.
plain = bpy.data.materials.new("plain")
plain.use_nodes = True
nodes = plain.node_tree.nodes
nodes.clear()
diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
diffuse.inputs["Color"].default_value = (0.6, 0.5, 0.4, 1)
plain.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
ball = support.add_ball(plain)
painted = bpy.data.images.new("painted", 64, 32, float_buffer=True)
painted.colorspace_settings.name = "Non-Color"  # else the file's numbers are sRGB's
values = np.full((32, 64, 4), 0.2, dtype=np.float32)  # the bottom row first
values[:, 10:26, :3] = (6, 5, 4)
values[20:, :, :3] *= 2
painted.pixels.foreach_set(values.ravel())
painted.filepath_raw = support.path("sky.exr")
painted.file_format = "OPEN_EXR"
painted.save()
sky = bpy.data.images.load(painted.filepath_raw)
scene.world.use_nodes = True
tree = scene.world.node_tree
environment = tree.nodes.new("ShaderNodeTexEnvironment")
environment.image = sky
tree.links.new(environment.outputs["Color"], tree.nodes["Background"].inputs["Color"])
tree.nodes["Background"].inputs["Strength"].default_value = 0.7
agree("sky", 0.01)
turn = tree.nodes.new("ShaderNodeMapping")
coordinates = tree.nodes.new("ShaderNodeTexCoord")
turn.inputs["Rotation"].default_value = Euler((0.3, 0, 1.9))
tree.links.new(coordinates.outputs["Generated"], turn.inputs["Vector"])
tree.links.new(turn.outputs["Vector"], environment.inputs["Vector"])
sky.pack()  # its file isn't the renderer's to read now
agree("turned sky", 0.01)

# A picture on a plane, by a Mapping node that scales, turns and moves it.
bpy.data.objects.remove(ball)
tree.links.remove(tree.nodes["Background"].inputs["Color"].links[0])
tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
bpy.ops.mesh.primitive_plane_add(size=2.6, rotation=(1.4, 0, 0))
bpy.context.object.data.materials.append(plain)
picture = bpy.data.images.new("picture", 32, 32)
picture.colorspace_settings.name = "Non-Color"
spots = np.full((32, 32, 4), 0.1, dtype=np.float32)
spots[4:12, 16:30] = 0.9
picture.pixels.foreach_set(spots.ravel())
picture.update()
texture, mapping = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeMapping")
uv = nodes.new("ShaderNodeTexCoord")
texture.image = picture
mapping.inputs["Scale"].default_value = (0.8, 0.9, 1)
mapping.inputs["Rotation"].default_value = Euler((0, 0, 0.5))
mapping.inputs["Location"].default_value = (0.2, -0.1, 0)
links = plain.node_tree.links
links.new(uv.outputs["UV"], mapping.inputs["Vector"])
links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
links.new(texture.outputs["Color"], diffuse.inputs["Color"])
agree("turned picture", 0.01)
support.done()
