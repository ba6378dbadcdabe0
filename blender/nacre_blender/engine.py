"""The render engine: F12 and the viewport."""

import os
import shutil
import tempfile
import threading
import time

import bpy

from . import exr, log, preferences, scene
from .process import Rendering

SNAPSHOT_S = 2
POLL_S = 0.1


def _folder(settings):
    """Where the files go, and whether they are removed afterwards."""
    if settings.keep_files:
        folder = bpy.path.abspath(settings.keep_files)
        os.makedirs(folder, exist_ok=True)
        return folder, False
    return tempfile.mkdtemp(prefix="nacre-blender-"), True


class NacreEngine(bpy.types.RenderEngine):
    bl_idname = "NACRE"
    bl_label = "Nacre"
    bl_use_preview = False
    bl_use_shading_nodes_custom = False

    # Of the viewport. Class defaults: constructors of engines differ between versions.
    _view = None

    def render(self, depsgraph):
        settings = depsgraph.scene_eval.nacre
        width = self.resolution_x
        height = self.resolution_y
        folder = None
        remove = False
        result = None
        try:
            command = preferences.command()
            folder, remove = _folder(settings)
            self.update_stats("", "Nacre: exporting")
            xml = scene.export_render(depsgraph, folder, width, height)
            options = ["--snapshot", str(SNAPSHOT_S), "--seed", str(settings.seed)]
            if settings.time_limit > 0:
                options += ["--time-limit", "%g" % settings.time_limit]
            rendering = Rendering(command, xml, os.path.join(folder, "picture.exr"), options)
            result = self.begin_result(0, 0, width, height)
            stopped = self._follow(rendering, result)
            self.end_result(result, cancel=stopped)
            result = None
            for warning in log.warnings():
                self.report({"WARNING"}, warning)
        except Exception as error:  # an uncaught one would crash Blender
            log.warn(str(error))
            if result is None:
                result = self.begin_result(0, 0, width, height)
            self.end_result(result, cancel=True)
            self.report({"ERROR"}, "Nacre: %s" % error)
            self.error_set("Nacre: %s" % error)
        finally:
            if folder is not None and remove:
                shutil.rmtree(folder, ignore_errors=True)

    def _follow(self, rendering, result):
        """Shows what is there until the end. True if it was stopped."""
        shown = None
        try:
            while rendering.running():
                if self.test_break():
                    return True
                self.update_progress(rendering.progress)
                self.update_stats("", "Nacre: " + rendering.stage)
                if os.path.isfile(rendering.picture):
                    written = os.path.getmtime(rendering.picture)
                    if written != shown:
                        shown = written
                        self._show(rendering.picture, result)
                time.sleep(POLL_S)
        finally:
            rendering.stop()
        for line in rendering.finish():
            print("nacre: " + line)
        result.layers[0].load_from_file(rendering.picture)
        return False

    def _show(self, picture, result):
        """What is there before the end."""
        result.layers[0].load_from_file(picture)
        self.update_result(result)

    def view_update(self, context, depsgraph):
        if self._view is not None:
            self._view.scene_changed()

    def view_draw(self, context, depsgraph):
        if self._view is None:
            self._view = View(self)
        try:
            self._view.draw(context, depsgraph)
        except Exception as error:
            log.warn(str(error))
            self.update_stats("Nacre", str(error))

    def __del__(self):
        if getattr(self, "_view", None) is not None:
            self._view.close()


class View:
    """A viewport: one rendering at a time, started again when the scene or the view changes."""

    def __init__(self, engine):
        self._engine = engine
        self._folder = tempfile.mkdtemp(prefix="nacre-view-")
        self._rendering = None
        self._seen = None
        self._changed = True
        self._texture = None
        self._done = False

    def scene_changed(self):
        self._changed = True
        self._engine.tag_redraw()

    def _start(self, context, depsgraph):
        if self._rendering is not None:
            self._rendering.stop()
        region = context.region
        xml = scene.export_view(
            depsgraph, self._folder, context.region_data, region.width, region.height)
        picture = os.path.join(self._folder, "view.exr")
        if os.path.isfile(picture):
            os.remove(picture)
        self._rendering = Rendering(preferences.command(), xml, picture)
        self._done = False
        threading.Thread(target=self._wait, args=(self._rendering,), daemon=True).start()

    def _wait(self, rendering):
        while rendering.running():
            time.sleep(POLL_S)
        if rendering is self._rendering:
            self._engine.tag_redraw()

    def draw(self, context, depsgraph):
        import gpu
        from gpu_extras.presets import draw_texture_2d

        region = context.region
        view = (region.width, region.height,
                tuple(tuple(row) for row in context.region_data.perspective_matrix))
        if self._changed or view != self._seen:
            self._changed, self._seen = False, view
            self._start(context, depsgraph)
            self._engine.update_stats("Nacre", "rendering")
        elif not self._done and not self._rendering.running():
            self._done = True
            self._rendering.finish()
            pixels = exr.read(self._rendering.picture)
            height, width = pixels.shape[:2]
            self._texture = gpu.types.GPUTexture(
                (width, height), format="RGBA16F",
                data=gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel()))
            self._engine.update_stats("Nacre", "%d samples" % context.scene.nacre.preview_samples)
        if self._texture is not None:
            gpu.state.blend_set("ALPHA_PREMULT")
            self._engine.bind_display_space_shader(context.scene)
            draw_texture_2d(self._texture, (0, 0), region.width, region.height)
            self._engine.unbind_display_space_shader()
            gpu.state.blend_set("NONE")

    def close(self):
        if self._rendering is not None:
            self._rendering.stop()
        shutil.rmtree(self._folder, ignore_errors=True)


def register():
    bpy.utils.register_class(NacreEngine)


def unregister():
    bpy.utils.unregister_class(NacreEngine)
