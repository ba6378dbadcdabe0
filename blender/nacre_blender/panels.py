"""Panels: the material's translucency, and the render settings."""

import bpy

from . import log, presets


class NacrePanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = {"NACRE"}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES


class NACRE_PT_material(NacrePanel, bpy.types.Panel):
    bl_label = "Nacre Translucency"
    bl_context = "material"

    @classmethod
    def poll(cls, context):
        # In Cycles too, for the button that makes a Cycles material.
        return context.material is not None and context.engine in {"NACRE", "CYCLES"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        settings = context.material.nacre
        layout.prop(settings, "model")
        if settings.model == "OPAQUE":
            return
        if settings.model == "SVD":
            self.draw_measured(layout, settings)
        else:
            layout.prop(settings, "sigma_s")
            layout.prop(settings, "sigma_a")
            layout.prop(settings, "anisotropy")
            layout.prop(settings, "ior")
        layout.prop(settings, "mm_per_unit")
        layout.prop(settings, "roughness")
        if settings.model == "SVD":
            layout.operator("nacre.add_cycles_material")

    def draw_measured(self, layout, settings):
        layout.row().prop(settings, "source", expand=True)
        if settings.source == "FILE":
            layout.prop(settings, "file")
            layout.prop(settings, "ior")
            return
        layout.template_icon_view(settings, "preset", show_labels=True, scale=6.0, scale_popup=5.0)
        row = layout.row(align=True)
        row.prop(settings, "preset")
        row.operator("nacre.reload_presets", text="", icon="FILE_REFRESH")
        preset = presets.all_presets().get(settings.preset)
        if preset is not None:
            width, height = preset["size_mm"]
            layout.label(text="Sample %.0f x %.0f mm, repeats beyond" % (width, height))
            units = width / settings.mm_per_unit
            layout.label(text="One UV unit should be %.3g Blender units wide" % units)


class NACRE_PT_render(NacrePanel, bpy.types.Panel):
    bl_label = "Nacre"
    bl_context = "render"

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        for name in ("samples", "preview_samples", "max_depth", "seed", "time_limit", "keep_files"):
            layout.prop(context.scene.nacre, name)


class NACRE_PT_warnings(NacrePanel, bpy.types.Panel):
    bl_label = "What Wasn't Translated"
    bl_context = "render"

    def draw(self, context):
        texts = log.warnings()
        for text in texts:
            self.layout.label(text=text, icon="ERROR")
        if not texts:
            self.layout.label(text="Nothing, in the last picture")


CLASSES = (NACRE_PT_material, NACRE_PT_render, NACRE_PT_warnings)

# Panels of Blender's own that make sense here, beside those of every engine.
BORROWED = (
    "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "DATA_PT_light",
    "DATA_PT_EEVEE_light", "EEVEE_WORLD_PT_surface", "DATA_PT_spot",
)


def _panels():
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is not None and (
                "BLENDER_RENDER" in engines or panel.__name__ in BORROWED):
            yield panel


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for panel in _panels():
        panel.COMPAT_ENGINES.add("NACRE")


def unregister():
    for panel in _panels():
        panel.COMPAT_ENGINES.discard("NACRE")
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
