"""What the panels show. Lengths are millimetres of the material."""

import bpy

from . import presets

MODELS = (
    ("OPAQUE", "None", "Not translucent: the material's own shader, translated"),
    ("MEDIUM", "Participating media", "A homogeneous medium, path traced: slow and exact"),
    ("DIPOLE", "Dipole", "The dipole model of a homogeneous medium"),
    ("SVD", "Measured (svd)", "A factored, measured material: a preset or a file"),
)


def _changed(settings, _context):
    """The evaluated copy, which is what gets rendered, isn't made again by itself."""
    settings.id_data.update_tag()


class NacreMaterial(bpy.types.PropertyGroup):
    model: bpy.props.EnumProperty(
        update=_changed, name="Subsurface", description="How light spreads under the surface",
        items=MODELS,
    )
    source: bpy.props.EnumProperty(
        update=_changed, name="From",
        items=(("PRESET", "Preset", "One of the list"), ("FILE", "File", "A *.nacre.exr")),
    )
    preset: bpy.props.EnumProperty(update=_changed, name="Preset", items=presets.enum_items)
    file: bpy.props.StringProperty(update=_changed, name="File", subtype="FILE_PATH")
    mm_per_unit: bpy.props.FloatProperty(
        update=_changed, name="Millimetres per unit",
        description="Physical scale: millimetres of the material that one Blender unit is",
        default=1000.0,
        min=1e-6,
        soft_max=10000.0,
    )
    sigma_a: bpy.props.FloatVectorProperty(
        update=_changed, name="Absorption", description="per mm", size=3,
        default=(0.0021, 0.0041, 0.0071), min=0.0, precision=4,
    )
    sigma_s: bpy.props.FloatVectorProperty(
        update=_changed, name="Scattering", description="per mm", size=3,
        default=(2.19, 2.62, 3.0), min=0.0, precision=3,
    )
    anisotropy: bpy.props.FloatProperty(
        update=_changed, name="Anisotropy", description="Mean cosine of scattering", default=0.0,
        min=-0.95, max=0.95,
    )
    ior: bpy.props.FloatProperty(
        update=_changed, name="IOR", default=1.5, min=1.0, max=4.0,
        description="Index of refraction; a medium of index 1 has no boundary",
    )
    roughness: bpy.props.FloatProperty(
        update=_changed, name="Coat roughness", default=0.2, min=0.01, max=1.0,
        description="Of the surface: of its reflection, and of the boundary of a medium",
    )


class NacreScene(bpy.types.PropertyGroup):
    samples: bpy.props.IntProperty(
        update=_changed, name="Samples", description="a pixel", default=64, min=1, max=65536)
    preview_samples: bpy.props.IntProperty(
        update=_changed, name="Viewport samples", description="a pixel", default=4, min=1,
        max=4096)
    max_depth: bpy.props.IntProperty(
        update=_changed, name="Path depth", default=6, min=1, max=1024,
        description="Edges of a path, at most; not counted where there are participating media")
    seed: bpy.props.IntProperty(update=_changed, name="Seed", default=1, min=0)
    time_limit: bpy.props.FloatProperty(
        update=_changed, name="Time limit", description="Seconds; 0: none", default=0.0, min=0.0)
    keep_files: bpy.props.StringProperty(
        update=_changed, name="Keep files in", subtype="DIR_PATH",
        description="Folder for scene.xml and what belongs to it; empty: they are removed",
    )


CLASSES = (NacreMaterial, NacreScene)


def register():
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Material.nacre = bpy.props.PointerProperty(type=NacreMaterial)
    bpy.types.Scene.nacre = bpy.props.PointerProperty(type=NacreScene)


def unregister():
    presets.close()
    del bpy.types.Scene.nacre
    del bpy.types.Material.nacre
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
