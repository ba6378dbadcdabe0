"""Nacre as a render engine of Blender: measured translucency from a list.

Blender 3.4 and later. The scene goes to the `nacre` command as XML and PLY files; see README.md.
"""

bl_info = {
    "name": "Nacre",
    "author": "the Nacre project",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render properties > Render Engine; Material properties > Nacre",
    "description": "Renders measured, spatially varying translucency",
    "category": "Render",
}

from . import engine, operators, panels, preferences, properties

MODULES = (preferences, properties, operators, panels, engine)


def register():
    for module in MODULES:
        module.register()


def unregister():
    for module in reversed(MODULES):
        module.unregister()
