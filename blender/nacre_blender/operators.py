"""Buttons."""

import os
import subprocess
import tempfile

import bpy

from . import cycles_material, materials, preferences, presets


class NACRE_OT_reload_presets(bpy.types.Operator):
    bl_idname = "nacre.reload_presets"
    bl_label = "Look for presets again"

    def execute(self, context):
        presets.close()
        presets.reload()
        self.report({"INFO"}, "%d presets" % len(presets.all_presets()))
        return {"FINISHED"}


class NACRE_OT_add_cycles_material(bpy.types.Operator):
    """Make a Cycles material of the measured one: albedo and radius maps fitted to the data, in
    a node group, in this object's active slot"""

    bl_idname = "nacre.add_cycles_material"
    bl_label = "Add as Cycles Material"
    bl_options = {"REGISTER", "UNDO"}

    method: bpy.props.EnumProperty(
        name="Method",
        items=(("BURLEY", "Burley", "The fitted profile itself"),
               ("RANDOM_WALK", "Random walk", "Slower; keeps to thin and curved parts better")),
    )

    @classmethod
    def poll(cls, context):
        material = getattr(context.object, "active_material", None)
        return material is not None and material.nacre.model == "SVD"

    def _maps(self, settings):
        """Name, index and the files of both maps, made by `nacre export` if need be."""
        preset = presets.all_presets().get(settings.preset)
        if settings.source == "PRESET" and preset is not None:
            folder = preset["folder"]
            return preset["title"], preset["eta"], [
                os.path.join(folder, preset["files"][role]) for role in ("albedo", "radius")]
        source = materials.measured_file(settings)
        folder = tempfile.mkdtemp(prefix="nacre-cycles-", dir=bpy.app.tempdir or None)
        subprocess.run(
            [preferences.command(), "export", source, "--to", "cycles", "--out", folder, "--quiet"],
            check=True, capture_output=True, text=True)
        return os.path.basename(source), settings.ior, [
            os.path.join(folder, name) for name in ("albedo.exr", "radius.exr")]

    def execute(self, context):
        active = context.object.active_material
        try:
            name, eta, maps = self._maps(active.nacre)
            made = cycles_material.build(
                name + " (Cycles)", *maps, active.nacre.mm_per_unit, eta, self.method)
        except subprocess.CalledProcessError as error:
            self.report({"ERROR"}, "Nacre: " + error.stderr.strip())
            return {"CANCELLED"}
        except (OSError, ValueError, RuntimeError) as error:
            self.report({"ERROR"}, "Nacre: %s" % error)
            return {"CANCELLED"}
        if active.nacre.source == "FILE":
            for node in made.node_tree.nodes[0].node_tree.nodes:
                if node.type == "TEX_IMAGE":
                    node.image.pack()  # its file is a temporary one
        context.object.active_material = made
        return {"FINISHED"}


CLASSES = (NACRE_OT_reload_presets, NACRE_OT_add_cycles_material)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister():
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
