"""What the tests in Blender share: the add-on installed, scenes, pictures as arrays."""

import os
import subprocess
import sys

import bpy
import numpy as np
from mathutils import Matrix, Vector

FOLDER = os.environ["NACRE_TEST_FOLDER"]


def path(name):
    return os.path.join(FOLDER, name)


def nacre(*arguments):
    done = subprocess.run([os.environ["NACRE"], *arguments], capture_output=True, text=True,
                          check=False)
    if done.returncode != 0:
        raise AssertionError("nacre %s: %s" % (" ".join(arguments), done.stderr))
    return done.stdout


def install():
    bpy.ops.preferences.addon_install(filepath=os.environ["NACRE_TEST_ZIP"])
    bpy.ops.preferences.addon_enable(module="nacre_blender")
    bpy.context.scene.render.engine = "NACRE"


def empty_scene():
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.delete()
    scene = bpy.context.scene
    scene.render.engine = "NACRE"
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.render.resolution_percentage = 100
    scene.nacre.samples = 8
    scene.nacre.keep_files = ""
    scene.world = bpy.data.worlds.new("world")
    scene.world.color = (0, 0, 0)
    return scene


def looking(eye, target, up=(0, 0, 1)):
    """Blender's matrix of a camera or a lamp at `eye` that looks at `target`."""
    back = (Vector(eye) - Vector(target)).normalized()
    right = Vector(up).cross(back).normalized()
    matrix = Matrix((right, back.cross(right), back)).transposed().to_4x4()
    matrix.translation = eye
    return matrix


def add(name, data, matrix):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    thing.matrix_world = matrix
    return thing


def add_camera(eye, target, fov_deg, up=(0, 0, 1)):
    data = bpy.data.cameras.new("camera")
    data.angle = np.radians(fov_deg)
    bpy.context.scene.camera = add("camera", data, looking(eye, target, up))
    return bpy.context.scene.camera


def add_lamp(kind, eye, target, energy, color=(1, 1, 1)):
    data = bpy.data.lights.new(kind.lower(), kind)
    data.energy = energy
    data.color = color
    data.shadow_soft_size = 0
    return add(kind.lower(), data, looking(eye, target))


def add_ball(material, radius=1.0, place=(0, 0, 0)):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=radius, location=place)
    bpy.ops.object.shade_smooth()
    bpy.context.object.data.materials.append(material)
    return bpy.context.object


def translucent(model, mm_per_unit=20.0):
    material = bpy.data.materials.new(model.lower())
    material.nacre.model = model
    material.nacre.mm_per_unit = mm_per_unit
    return material


def pixels_of(file):
    image = bpy.data.images.load(file, check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    values = np.empty(width * height * image.channels, dtype=np.float32)
    image.pixels.foreach_get(values)
    bpy.data.images.remove(image)
    return values.reshape(height, width, -1)[:, :, :3]


def render(name):
    """Renders to an EXR file of floats and returns its pixels, the bottom row first."""
    settings = bpy.context.scene.render
    settings.image_settings.file_format = "OPEN_EXR"
    settings.image_settings.color_depth = "32"
    settings.filepath = path(name + ".exr")
    bpy.ops.render.render(write_still=True)
    return pixels_of(settings.filepath)


def relative_l2(picture, reference):
    return float(np.sqrt(np.sum((picture - reference) ** 2) / np.sum(reference ** 2)))


def check(condition, text):
    if not condition:
        raise AssertionError(text)
    print("ok: " + text)


def done():
    print("all passed")
    sys.stdout.flush()
