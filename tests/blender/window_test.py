"""In a window: the panel is drawn, and the viewport's preview renders. Takes a picture of both."""

import os
import sys
import traceback

import bpy
import numpy as np
import support
from support import check

GIVE_UP_S = 240
TICK_S = 0.2

bpy.context.preferences.view.show_splash = False
support.install()
from nacre_blender import engine, panels  # noqa: E402

pictures = []  # that the viewport read: their mean colours
models = []  # that the panel was drawn for
read_picture, draw_panel = engine.exr.read, panels.NACRE_PT_material.draw


def watched_read(file):
    pixels = read_picture(file)
    pictures.append(pixels[:, :, :3].mean(axis=(0, 1)))
    return pixels


def watched_panel(self, context):
    draw_panel(self, context)
    models.append(context.material.nacre.model)


engine.exr.read = watched_read
panels.NACRE_PT_material.draw = watched_panel


def set_up():
    scene = support.empty_scene()
    scene.nacre.preview_samples = 2
    material = support.translucent("SVD")
    material.nacre.preset = "SVD_S10_Chess8x8"
    support.add_ball(material)
    support.add_lamp("POINT", (3, -3, 4), (0, 0, 0), 1500)
    support.add_camera((0, -5, 1), (0, 0, 0), 40)
    return material


def area(kind):
    return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)


def screenshot(name):
    window = bpy.context.window_manager.windows[0]
    file = support.path(name)
    with bpy.context.temp_override(window=window, screen=window.screen):
        bpy.ops.screen.screenshot(filepath=file)
    pixels = support.pixels_of(file)
    kept = os.environ.get("NACRE_TEST_PICTURES")  # to be looked at
    if kept:
        with open(file, "rb") as source, open(os.path.join(kept, name), "wb") as copy:
            copy.write(source.read())
    return pixels


def part(pixels, region):
    return pixels[region.y:region.y + region.height, region.x:region.x + region.width]


def colors(pixels):
    return len(np.unique((pixels * 255).astype(np.uint8).reshape(-1, 3), axis=0))


def until(condition, text):
    for _ in range(int(GIVE_UP_S / TICK_S)):
        yield
        if condition():
            break
    check(condition(), text)
    for _ in range(3):  # what was drawn is to be seen, too
        yield


def steps():
    """Each yields when Blender is to draw before it goes on."""
    material = set_up()
    yield
    # The viewport's right half becomes a properties editor wide enough for all of the panel.
    view = area("VIEW_3D")
    before = set(bpy.context.window_manager.windows[0].screen.areas)
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=view):
        bpy.ops.screen.area_split(direction="VERTICAL", factor=0.5)
    properties = (set(bpy.context.window_manager.windows[0].screen.areas) - before).pop()
    if properties.x < view.x:
        properties, view = view, properties
    properties.type = "PROPERTIES"
    yield
    properties.spaces.active.context = "MATERIAL"
    view.spaces.active.overlay.show_overlays = False
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    view.spaces.active.shading.type = "RENDERED"
    yield from until(lambda: pictures, "the viewport shows a rendered picture")
    picture = screenshot("panel-svd.png")
    panel = next(r for r in properties.regions if r.type == "WINDOW")
    check(models[-1] == "SVD", "the panel is drawn")
    check(colors(part(picture, panel)) > 200, "with labels and the preset's thumbnail")
    shown = part(picture, next(r for r in view.regions if r.type == "WINDOW"))
    high, wide = (n // 3 for n in shown.shape[:2])
    ball = shown[high:-high, wide:-wide]
    check(ball.mean() > 0.05 and ball.std() > 0.02, "the ball is lit")

    material.nacre.preset = "jade"
    yield from until(lambda: pictures[-1][1] > 1.1 * pictures[-1][0], "jade is rendered: green")
    shown = part(screenshot("panel-jade.png"), next(r for r in view.regions if r.type == "WINDOW"))
    red, green, _ = shown[high:-high, wide:-wide].mean(axis=(0, 1))
    check(green > 1.1 * red, "and shown: green %.2f to red %.2f" % (green, red))
    material.nacre.model = "MEDIUM"
    properties.tag_redraw()
    yield from until(lambda: models[-1] == "MEDIUM", "the panel follows")
    medium = part(screenshot("panel-medium.png"), panel)
    check(np.abs(medium - part(picture, panel)).mean() > 0.01, "with other fields")


running = steps()


def tick():
    try:
        next(running)
        return TICK_S
    except StopIteration:
        support.done()
    except Exception:  # a timer's error would leave the window open
        traceback.print_exc()
    sys.stdout.flush()
    bpy.ops.wm.quit_blender()
    return None


bpy.app.timers.register(tick, first_interval=TICK_S)
