"""The zip installs, shows itself, goes away without a trace, and comes back."""

import bpy
import support
from support import check

support.install()
check(bpy.context.scene.render.engine == "NACRE", "the engine can be chosen")
check(hasattr(bpy.types, "NACRE_PT_material"), "the material's panel is there")
models = [item.identifier for item in
          bpy.context.object.active_material.nacre.bl_rna.properties["model"].enum_items]
check(models == ["OPAQUE", "MEDIUM", "DIPOLE", "SVD"], "the menu is the thesis'")
check("NACRE" in bpy.types.MATERIAL_PT_custom_props.COMPAT_ENGINES, "Blender's panels stay")

from nacre_blender import presets  # noqa: E402  (only there once it is installed)

names = sorted(presets.all_presets())
check(len(names) >= 6, "%d presets are found" % len(names))
check("SVD_S10_Chess8x8" in names, "the thesis' names are among them")
settings = bpy.context.object.active_material.nacre
settings.model = "SVD"
settings.preset = "leaf"
check(settings.preset == "leaf", "a preset can be picked")

bpy.ops.wm.save_userpref()
bpy.ops.preferences.addon_disable(module="nacre_blender")
check(not hasattr(bpy.types, "NACRE_PT_material"), "disabled, it is gone")
check(not hasattr(bpy.types.Material, "nacre"), "and its properties with it")
check("NACRE" not in bpy.types.MATERIAL_PT_custom_props.COMPAT_ENGINES, "and its name")
bpy.ops.preferences.addon_enable(module="nacre_blender")
check(bpy.context.object.active_material.nacre.model == "SVD", "enabled again, settings are kept")
support.done()
