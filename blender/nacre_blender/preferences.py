"""Where the `nacre` command is, and more folders of presets."""

import os
import shutil

import bpy


class NacrePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    command: bpy.props.StringProperty(
        name="Command",
        description="The nacre program; empty: environment variable NACRE, then the search path",
        subtype="FILE_PATH",
    )
    presets: bpy.props.StringProperty(
        name="Presets", description="A folder of presets of your own", subtype="DIR_PATH"
    )

    def draw(self, context):
        self.layout.prop(self, "command")
        self.layout.prop(self, "presets")


def _preferences():
    addon = bpy.context.preferences.addons.get(__package__)
    return addon.preferences if addon else None


def command():
    """The nacre program. Raises FileNotFoundError saying where to set it."""
    preferences = _preferences()
    chosen = bpy.path.abspath(preferences.command) if preferences else ""
    chosen = chosen or os.environ.get("NACRE", "") or shutil.which("nacre") or ""
    if not chosen or not os.path.isfile(chosen):
        raise FileNotFoundError(
            "the nacre command isn't there (%s): install nacre, or set its path in "
            "Preferences > Add-ons > Nacre" % (chosen or "not on the search path")
        )
    return chosen


def preset_folder():
    preferences = _preferences()
    return bpy.path.abspath(preferences.presets) if preferences else ""


def register():
    bpy.utils.register_class(NacrePreferences)


def unregister():
    bpy.utils.unregister_class(NacrePreferences)
