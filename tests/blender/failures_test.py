"""Everything that can go wrong: an error that says what, or a warning and a picture; never a
crash, never a picture that pretends."""

import os

import bpy
import numpy as np
import support
from support import check

support.install()
from nacre_blender import engine, log, process  # noqa: E402

COMMAND = os.environ["NACRE"]
support.empty_scene()


def refuses(name, words):
    file = support.path(name + ".exr")
    try:
        support.render(name)
    except RuntimeError as error:
        said = str(error)
    else:
        said = ""
    check(words in said, "%s: '%s' is said%s" % (name, words, "" if words in said else ": " + said))
    check(not os.path.exists(file), name + ": no picture is written")


def warns(name, words):
    result = support.render(name)
    said = " | ".join(log.warnings())
    check(words in said, "%s: '%s' is said%s" % (name, words, "" if words in said else ": " + said))
    check(np.isfinite(result).all(), name + ": a picture is there")
    return result


refuses("no-camera", "camera")
support.add_camera((0, -6, 1), (0, 0, 0), 25)
warns("no-light", "no light")
sun = support.add_lamp("SUN", (-4, -2, 3), (0, 0, 0), 3.0)
check(support.render("nothing").max() == 0, "an empty scene is black")

ball = support.add_ball(None)
check(support.render("no-material")[20:28, 20:28].min() > 0, "a ball without material is there")


def shaded(name, kind, *sockets):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new(kind)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    for socket, texture in sockets:
        node = tree.nodes.new(texture)
        tree.links.new(node.outputs[0], shader.inputs[socket])
    ball.data.materials.clear()
    ball.data.materials.append(material)
    return material


shaded("velvet", "ShaderNodeBsdfVelvet" if hasattr(bpy.types, "ShaderNodeBsdfVelvet")
       else "ShaderNodeBsdfSheen")
warns("unknown-shader", "grey is used")
shaded("noise", "ShaderNodeBsdfDiffuse", ("Color", "ShaderNodeTexNoise"))
warns("unknown-texture", "Noise Texture")
material = shaded("picture", "ShaderNodeBsdfDiffuse", ("Color", "ShaderNodeTexImage"))
image = bpy.data.images.new("lost", 4, 4)
image.source = "FILE"
image.filepath = "/no/such/picture.png"
material.node_tree.nodes["Image Texture"].image = image
warns("lost-picture", "no pixels")
image = bpy.data.images.new("drawn", 4, 4, float_buffer=False)
image.pixels = [0.0, 1.0, 0.0, 1.0] * 16
material.node_tree.nodes["Image Texture"].image = image
drawn = support.render("drawn-picture")[20:28, 14:22]
check(drawn[:, :, 1].min() > 0 and drawn[:, :, 0].max() < 1e-3, "a painted picture is green")

measured = support.translucent("SVD")
measured.nacre.source = "FILE"
measured.nacre.file = "/no/such.nacre.exr"
ball.data.materials.clear()
ball.data.materials.append(measured)
warns("lost-material", "no such material file")
with open(support.path("bad.nacre.exr"), "wb") as file:
    file.write(b"no material")
measured.nacre.file = support.path("bad.nacre.exr")
refuses("bad-material", "bad.nacre.exr")

measured.nacre.source = "PRESET"
measured.nacre.preset = "leaf"
ball.data.uv_layers.remove(ball.data.uv_layers[0])
warns("no-uv", "no UV map")
ball.data.materials.clear()

# Mirrored, flattened, instanced, modified, of no faces, of other kinds.
ball.scale = (-1, 1, 1)
mirrored = support.render("mirrored")
check(mirrored[20:28, 14:22].min() > 0, "a mirrored ball is lit from outside")
ball.scale = (1, 1, 0)
warns("flat", "scaled to nothing")
ball.scale = (1, 1, 1)
ball.modifiers.new("", "ARRAY").count = 2
check(support.render("array")[24, 44:48].mean() > 0, "modifiers are applied")
ball.modifiers.clear()
bpy.context.scene.collection.objects.link(
    bpy.data.objects.new("edges", bpy.data.meshes.new("edges")))
volume = bpy.data.objects.new("smoke", bpy.data.volumes.new("smoke"))
bpy.context.scene.collection.objects.link(volume)
warns("volume", "smoke: objects of type volume")
bpy.data.objects.remove(volume)
group = bpy.data.collections.new("group")
group.objects.link(ball)
instance = bpy.data.objects.new("instance", None)
instance.instance_type = "COLLECTION"
instance.instance_collection = group
instance.location = (1.1, 0, 0)
bpy.context.scene.collection.objects.link(instance)
check(support.render("instance")[24, 44:48].mean() > 0, "instances are drawn")
bpy.data.objects.remove(instance)

# The command: not there, failing, killed, stopped.
os.environ["NACRE"] = "/no/such/nacre"
refuses("no-command", "isn't there")
os.environ["NACRE"] = "/bin/false"
refuses("failing-command", "ended with code 1")
os.environ["NACRE"] = COMMAND
rendering = process.Rendering("/bin/sh", support.path("nowhere.xml"), support.path("x.exr"))
rendering.stop()
check(not rendering.running(), "a stopped render ends")
slow = support.path("slow")
with open(slow, "w", encoding="utf-8") as file:
    file.write("#!/bin/sh\ntrap '' INT\necho 'render        40 %  4/10  0:01, 0:02 left' >&2\n"
               "while :; do sleep 0.1; done\n")
os.chmod(slow, 0o755)
rendering = process.Rendering(slow, "scene.xml", support.path("x.exr"))
while rendering.progress == 0 and rendering.running():
    pass
check(abs(rendering.progress - 0.52) < 1e-9, "progress is read")
rendering.stop()
check(not rendering.running(), "one that won't stop is made to")

kept = support.path("kept")
bpy.context.scene.nacre.keep_files = kept
support.render("kept-files")
check(os.path.isfile(os.path.join(kept, "scene.xml")), "files are kept where told")

# A picture that isn't finished is shown: this command waits until it was.
painter, seen = support.path("painter"), support.path("seen")
with open(painter, "w", encoding="utf-8") as file:
    file.write("#!/bin/sh\ncp '%s' \"$4.part\" && mv \"$4.part\" \"$4\"\n"
               "for wait in $(seq 1200); do [ -e '%s' ] && exit 0; sleep 0.05; done; exit 1\n"
               % (os.path.join(kept, "picture.exr"), seen))
os.chmod(painter, 0o755)


show = engine.NacreEngine._show


def watched(self, picture, result):
    show(self, picture, result)
    with open(seen, "w", encoding="utf-8"):
        pass


bpy.context.scene.nacre.keep_files = ""
os.environ["NACRE"] = painter
engine.NacreEngine._show = watched
support.render("painted")
check(os.path.exists(seen), "an unfinished picture is shown")
leftovers = [name for name in os.listdir(support.FOLDER) if name.startswith("nacre-blender-")]
check(not leftovers, "no temporary files stay")
support.done()
