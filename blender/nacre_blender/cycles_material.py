"""A measured material as a Cycles material: a node group made of its albedo and radius maps.

Stands alone: `nacre export --to cycles` writes this file beside the maps, as does the
add-on by its operator. Run it in Blender, or import it and call `build`.

The maps hold, for each texel and channel, A and d (mm) of Burley's profile
R(r) = A (exp(-r/d) + exp(-r/3d)) / (8 pi d r).
"""

import json
import math
import os

import bpy

GROUP = "Nacre measured translucency"


def radius_factor(method, methods):
    """What Cycles wants in Radius x Scale, as a multiple of d (and of s(A) d, if the second
    value is true). `methods` are the names that this Blender's node offers: they, not the
    version, tell the conventions apart.

    BURLEY is 4 pi d in all versions. Random walks: 4 pi s(A) d up to 5.1, where they are
    called RANDOM_WALK_FIXED_RADIUS (3.x) or RANDOM_WALK; with RANDOM_WALK_LEGACY in the
    list, that one keeps 4 pi and RANDOM_WALK is s(A) d itself.
    """
    if method == "BURLEY":
        return 4 * math.pi, False
    if method == "RANDOM_WALK" and "RANDOM_WALK_LEGACY" in methods:
        return 1.0, True
    return 4 * math.pi, True


def burley_scaling(albedo):
    """s(A): mean free path over d."""
    return 1.9 - albedo + 3.5 * (albedo - 0.8) ** 2


def falloffs():
    """Methods of this Blender's subsurface node."""
    node = bpy.types.ShaderNodeSubsurfaceScattering.bl_rna
    return [item.identifier for item in node.properties["falloff"].enum_items]


def random_walk_name(methods):
    """The random walk whose radius doesn't change with the albedo."""
    return "RANDOM_WALK_FIXED_RADIUS" if "RANDOM_WALK_FIXED_RADIUS" in methods else "RANDOM_WALK"


def load_map(path):
    image = bpy.data.images.load(path, check_existing=True)
    # Numbers, not colours: nothing may manage them.
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "NONE"
    return image


def _interface(group):
    """Declares the group's sockets; 4.0 moved them."""
    sockets = [
        ("NodeSocketFloat", "Millimetres per Unit", 1000.0),
        ("NodeSocketFloat", "Roughness", 0.2),
        ("NodeSocketFloat", "IOR", 1.5),
        ("NodeSocketFloat", "Gloss", 1.0),
    ]
    for kind, name, value in sockets:
        if hasattr(group, "interface"):
            socket = group.interface.new_socket(name=name, in_out="INPUT", socket_type=kind)
        else:
            socket = group.inputs.new(kind, name)
        socket.default_value = value
        socket.min_value = 0.0
    if hasattr(group, "interface"):
        group.interface.new_socket(name="Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    else:
        group.outputs.new("NodeSocketShader", "Shader")


def _vector_math(nodes, links, operation, first, second):
    node = nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    for socket, value in zip(node.inputs, (first, second)):
        if isinstance(value, tuple):
            socket.default_value = value
        else:
            links.new(value, socket)
    return node.outputs[0]


def build_group(name, albedo_file, radius_file, method="BURLEY"):
    """The node group of one material. Texture coordinates: u, v from 0 to 1 are the sample."""
    methods = falloffs()
    if method != "BURLEY":
        method = random_walk_name(methods)
    factor, scaled = radius_factor(method, methods)
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    _interface(group)
    nodes, links = group.nodes, group.links
    inputs = nodes.new("NodeGroupInput")
    outputs = nodes.new("NodeGroupOutput")
    coordinates = nodes.new("ShaderNodeTexCoord")
    maps = []
    for path in (albedo_file, radius_file):
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = load_map(path)
        links.new(coordinates.outputs["UV"], texture.inputs["Vector"])
        maps.append(texture.outputs["Color"])
    albedo, radius = maps
    if scaled:  # s(A) d = (1.9 - A + 3.5 (A - 0.8)^2) d
        off = _vector_math(nodes, links, "ADD", albedo, (-0.8, -0.8, -0.8))
        bent = _vector_math(nodes, links, "MULTIPLY", off, off)
        bent = _vector_math(nodes, links, "MULTIPLY", bent, (3.5, 3.5, 3.5))
        level = _vector_math(nodes, links, "SUBTRACT", (1.9, 1.9, 1.9), albedo)
        radius = _vector_math(
            nodes, links, "MULTIPLY", radius, _vector_math(nodes, links, "ADD", level, bent))
    scale = nodes.new("ShaderNodeMath")
    scale.operation = "DIVIDE"
    scale.inputs[0].default_value = factor
    links.new(inputs.outputs["Millimetres per Unit"], scale.inputs[1])
    inside = nodes.new("ShaderNodeSubsurfaceScattering")
    inside.falloff = method
    links.new(albedo, inside.inputs["Color"])
    links.new(radius, inside.inputs["Radius"])
    links.new(scale.outputs[0], inside.inputs["Scale"])
    _coat(nodes, links, inputs, inside, outputs)
    return group


def _coat(nodes, links, inputs, inside, outputs):
    """A mirror of strength Gloss over it, by Fresnel."""
    fresnel = nodes.new("ShaderNodeFresnel")
    links.new(inputs.outputs["IOR"], fresnel.inputs["IOR"])
    strength = nodes.new("ShaderNodeMath")
    strength.operation = "MULTIPLY"
    links.new(fresnel.outputs[0], strength.inputs[0])
    links.new(inputs.outputs["Gloss"], strength.inputs[1])
    glossy = nodes.new("ShaderNodeBsdfGlossy")
    links.new(inputs.outputs["Roughness"], glossy.inputs["Roughness"])
    mix = nodes.new("ShaderNodeMixShader")
    links.new(strength.outputs[0], mix.inputs[0])
    links.new(inside.outputs[0], mix.inputs[1])
    links.new(glossy.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], outputs.inputs[0])


def build(name, albedo_file, radius_file, mm_per_unit=1000.0, eta=1.5, method="BURLEY"):
    """A material with the group in it. One Blender unit is `mm_per_unit` millimetres."""
    group = build_group(GROUP + ": " + name, albedo_file, radius_file, method)
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Millimetres per Unit"].default_value = mm_per_unit
    node.inputs["IOR"].default_value = eta
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material


def build_from_folder(folder, mm_per_unit=1000.0, method="BURLEY"):
    """The material of a folder that `nacre export --to cycles` wrote."""
    with open(os.path.join(folder, "export.json"), encoding="utf-8") as file:
        export = json.load(file)
    return build(
        os.path.splitext(os.path.basename(export["source"]))[0],
        os.path.join(folder, "albedo.exr"),
        os.path.join(folder, "radius.exr"),
        mm_per_unit,
        export["eta"],
        method,
    )


if __name__ == "__main__":
    build_from_folder(
        os.path.dirname(os.path.abspath(__file__)),
        1000.0 * bpy.context.scene.unit_settings.scale_length,
    )
