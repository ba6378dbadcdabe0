"""The list of presets, as `nacre preset list` knows it, with thumbnails."""

import json
import os
import subprocess

import bpy
import bpy.utils.previews

from . import log, preferences

_found = None
_previews = None
_items = []  # Blender keeps no reference to an enum's strings: somebody must


def reload():
    """Asks the command again."""
    global _found
    _found = {}
    try:
        call = [preferences.command(), "preset", "list", "--json"]
        if preferences.preset_folder():
            call += ["--presets", preferences.preset_folder()]
        answer = subprocess.run(call, capture_output=True, text=True, check=True, timeout=60)
        for preset in json.loads(answer.stdout)["presets"]:
            _found[preset["name"]] = preset
    except (OSError, ValueError, KeyError, subprocess.SubprocessError) as error:
        log.warn("no presets: %s" % error)


def all_presets():
    if _found is None:
        reload()
    return _found


def thumbnail(name):
    """The number of a preset's picture, for `icon_value`; 0 if it has none."""
    global _previews
    preset = all_presets().get(name)
    if preset is None:
        return 0
    if _previews is None:
        _previews = bpy.utils.previews.new()
    if name not in _previews:
        path = os.path.join(preset["folder"], preset["files"]["thumbnail"])
        if not os.path.isfile(path):
            return 0
        _previews.load(name, path, "IMAGE")
    return _previews[name].icon_id


def enum_items(self, context):
    _items.clear()
    for number, (name, preset) in enumerate(sorted(all_presets().items())):
        _items.append((name, preset["title"], name, thumbnail(name), number))
    if not _items:
        _items.append(("NONE", "No presets", "Install nacre's presets, or set its path", 0, 0))
    return _items


def close():
    global _previews, _found
    if _previews is not None:
        bpy.utils.previews.remove(_previews)
        _previews = None
    _found = None
