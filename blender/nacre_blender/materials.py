"""Materials: shader nodes to reflection models, and the Nacre panel's translucency."""

import os

import bpy
from mathutils import Matrix

from . import images, log, presets, xml

GREY = (0.5, 0.5, 0.5)


class Unsupported(Exception):
    """A node that has no equal here; the message names it."""


def _source(socket):
    """The node that feeds a socket, past reroutes."""
    while socket.is_linked:
        node = socket.links[0].from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None


def _input(node, *names):
    """The first of the sockets that this version has."""
    for name in names:
        socket = node.inputs.get(name)
        if socket is not None:
            return socket
    return None


def _value(node, default, *names):
    socket = _input(node, *names)
    if socket is None:
        return default
    if socket.is_linked:
        log.warn("%s: what is linked to '%s' of %s isn't translated; its own value is used"
                 % (node.id_data.name, socket.name, node.bl_label))
    return socket.default_value


def _uv_transform(node):
    """What a Mapping node does to a texture's coordinates: scaled, turned, moved."""
    mapping = _source(node.inputs["Vector"]) if "Vector" in node.inputs else None
    if mapping is None or mapping.type != "MAPPING":
        return []
    if mapping.vector_type != "POINT":
        log.warn("%s: a Mapping node of type %s isn't translated"
                 % (node.id_data.name, mapping.vector_type.lower()))
        return []
    turn = mapping.inputs["Rotation"].default_value
    if abs(turn[0]) > 1e-6 or abs(turn[1]) > 1e-6:
        log.warn("%s: texture coordinates turned about x or y aren't translated"
                 % node.id_data.name)
    scale = mapping.inputs["Scale"].default_value
    offset = mapping.inputs["Location"].default_value
    matrix = Matrix.Rotation(turn[2], 4, "Z") @ Matrix.Diagonal((scale[0], scale[1], 1, 1))
    matrix.translation = (offset[0], offset[1], 0)
    return [xml.transform("toUV", matrix)]


def color(parameter, node, folder, *names):
    """A colour, constant or textured, as the XML parameter of that name."""
    socket = _input(node, *names)
    if socket is None:
        return xml.rgb(parameter, GREY)
    texture = _source(socket)
    if texture is None:
        return xml.rgb(parameter, socket.default_value)
    if texture.type == "TEX_IMAGE" and texture.image is not None:
        try:
            path = images.file_of(texture.image, folder)
        except (ValueError, OSError, RuntimeError) as error:
            log.warn("%s: %s; grey is used" % (node.id_data.name, error))
            return xml.rgb(parameter, GREY)
        children = [xml.string("filename", path)] + _uv_transform(texture)
        space = texture.image.colorspace_settings.name
        if path.endswith(".png") and space in ("Non-Color", "Raw", "Linear", "Linear Rec.709"):
            children.append(xml.number("gamma", 1))
        return xml.element("texture", children, type="bitmap", name=parameter)
    if texture.type == "TEX_CHECKER":
        # One period holds two cells.
        scale = 0.5 * texture.inputs["Scale"].default_value
        return xml.element("texture", [
            xml.rgb("color0", texture.inputs["Color1"].default_value),
            xml.rgb("color1", texture.inputs["Color2"].default_value),
            xml.number("uscale", scale), xml.number("vscale", scale), *_uv_transform(texture),
        ], type="checkerboard", name=parameter)
    if texture.type == "RGB":
        return xml.rgb(parameter, texture.outputs[0].default_value)
    log.warn("%s: texture node '%s' isn't translated; the socket's own colour is used"
             % (node.id_data.name, texture.bl_label))
    return xml.rgb(parameter, socket.default_value)


def _alpha(roughness):
    return xml.number("alpha", max(1e-3, float(roughness) ** 2))


def _coat(diffuse, roughness, ior):
    kind = "plastic" if roughness < 0.02 else "roughplastic"
    children = [diffuse, xml.number("intIOR", max(1.001, ior)), xml.number("extIOR", 1)]
    if kind == "roughplastic":
        children += [xml.string("distribution", "ggx"), _alpha(roughness)]
    return xml.element("bsdf", children, type=kind)


def _metal(specular, roughness):
    kind = "conductor" if roughness < 0.02 else "roughconductor"
    children = [xml.string("material", "none"), specular]
    if kind == "roughconductor":
        children += [xml.string("distribution", "ggx"), _alpha(roughness)]
    return xml.element("bsdf", children, type=kind)


def _twosided(bsdf):
    return xml.element("bsdf", [bsdf], type="twosided")


def _principled(node, folder):
    roughness = _value(node, 0.5, "Roughness")
    if _value(node, 0.0, "Transmission", "Transmission Weight") > 0.5:
        return _glass(node)
    if _value(node, 0.0, "Subsurface", "Subsurface Weight") > 0:
        log.warn("%s: Principled's subsurface isn't translated: choose a model in the Nacre "
                 "panel" % node.id_data.name)
    if _value(node, 0.0, "Metallic") > 0.5:
        return _twosided(_metal(color("specularReflectance", node, folder, "Base Color"), roughness))
    diffuse = color("diffuseReflectance", node, folder, "Base Color")
    specular = _value(node, 0.5, "Specular", "Specular IOR Level")
    if specular <= 0:
        return _twosided(xml.element("bsdf", [diffuse], type="diffuse"))
    if node.inputs.get("Specular") is not None:  # up to 3.6: 0.08 Specular at normal incidence
        root = (0.08 * specular) ** 0.5
        return _twosided(_coat(diffuse, roughness, (1 + root) / (1 - root)))
    return _twosided(_coat(diffuse, roughness, _value(node, 1.5, "IOR")))


def _boundary(ior, roughness):
    kind = "dielectric" if roughness < 0.02 else "roughdielectric"
    children = [xml.number("intIOR", max(1.001, ior)), xml.number("extIOR", 1)]
    if kind == "roughdielectric":
        children += [xml.string("distribution", "ggx"), _alpha(roughness)]
    return xml.element("bsdf", children, type=kind)


def _glass(node):
    return _boundary(_value(node, 1.45, "IOR"), _value(node, 0.0, "Roughness"))


def _surface(node, folder):
    if node.type == "BSDF_PRINCIPLED":
        return _principled(node, folder)
    if node.type == "BSDF_DIFFUSE":
        return _twosided(xml.element(
            "bsdf", [color("reflectance", node, folder, "Color")], type="diffuse"))
    if node.type in ("BSDF_GLOSSY", "BSDF_ANISOTROPIC"):
        specular = color("specularReflectance", node, folder, "Color")
        return _twosided(_metal(specular, _value(node, 0.5, "Roughness")))
    if node.type == "BSDF_GLASS":
        return _glass(node)
    raise Unsupported("shader '%s'" % node.bl_label)


def _emission(node):
    """Radiance that a shader emits, or None."""
    if node.type == "EMISSION":
        strength = _value(node, 1.0, "Strength")
        shade = _value(node, (1, 1, 1, 1), "Color")
    elif node.type == "BSDF_PRINCIPLED":
        strength = _value(node, 0.0, "Emission Strength")
        shade = _value(node, (0, 0, 0, 1), "Emission", "Emission Color")
    else:
        return None
    radiance = [strength * c for c in list(shade)[:3]]
    return radiance if max(radiance) > 0 else None


def _root(material):
    if not material.use_nodes or material.node_tree is None:
        return None
    output = material.node_tree.get_output_node("ALL") or material.node_tree.get_output_node("CYCLES")
    if output is None:
        return None
    if output.inputs["Displacement"].is_linked:
        log.warn("%s: displacement isn't translated" % material.name)
    if output.inputs["Volume"].is_linked:
        log.warn("%s: the volume isn't translated: choose participating media in the Nacre "
                 "panel" % material.name)
    return _source(output.inputs["Surface"])


def measured_file(settings):
    """The *.nacre.exr of a measured material. Raises ValueError if none is chosen."""
    if settings.source == "FILE":
        path = bpy.path.abspath(settings.file)
        if not os.path.isfile(path):
            raise ValueError("no such material file: '%s'" % path)
        return path
    preset = presets.all_presets().get(settings.preset)
    if preset is None:
        raise ValueError("no preset chosen, or '%s' isn't there any more" % settings.preset)
    return os.path.join(preset["folder"], preset["files"]["material"])


def _medium(settings):
    """A medium behind a boundary of glass; of index 1, without one."""
    inside = xml.element("medium", [
        xml.rgb("sigmaS", settings.sigma_s), xml.rgb("sigmaA", settings.sigma_a),
        xml.number("scale", settings.mm_per_unit),
        xml.element("phase", [xml.number("g", settings.anisotropy)], type="hg"),
    ], type="homogeneous", name="interior")
    if settings.ior < 1.001:
        return [inside]
    return [_boundary(settings.ior, settings.roughness), inside]


def _translucent(material):
    settings = material.nacre
    if settings.model == "MEDIUM":
        return _medium(settings)
    coat = _coat(xml.rgb("diffuseReflectance", (0, 0, 0)), settings.roughness, settings.ior)
    scale = xml.number("scale", settings.mm_per_unit)
    if settings.model == "DIPOLE":
        model = xml.element("subsurface", [
            xml.rgb("sigmaS", settings.sigma_s), xml.rgb("sigmaA", settings.sigma_a),
            xml.number("g", settings.anisotropy), xml.number("intIOR", settings.ior),
            xml.number("extIOR", 1), scale,
        ], type="dipole")
        return [coat, model]
    try:
        path = measured_file(settings)
    except ValueError as error:
        log.warn("%s: %s; drawn opaque" % (material.name, error))
        return [xml.element("bsdf", [xml.rgb("reflectance", GREY)], type="diffuse")]
    return [coat, xml.element(
        "subsurface", [xml.string("material", path), scale], type="svd")]


def translate(material, folder):
    """What goes inside a shape: its bsdf, emitter, subsurface or medium."""
    if material is None:
        return [_twosided(xml.element("bsdf", [xml.rgb("reflectance", (0.8, 0.8, 0.8))],
                                      type="diffuse"))]
    if material.nacre.model != "OPAQUE":
        return _translucent(material)
    node = _root(material)
    if node is None:
        shade = material.diffuse_color
        return [_twosided(xml.element("bsdf", [xml.rgb("reflectance", shade)], type="diffuse"))]
    children = []
    radiance = _emission(node)
    if radiance is not None:
        children.append(xml.element("emitter", [xml.rgb("radiance", radiance)], type="area"))
    if node.type != "EMISSION":
        try:
            children.append(_surface(node, folder))
        except Unsupported as what:
            log.warn("%s: %s isn't translated; grey is used" % (material.name, what))
            children.append(_twosided(xml.element(
                "bsdf", [xml.rgb("reflectance", GREY)], type="diffuse")))
    elif radiance is None:
        children.append(xml.element("bsdf", [xml.rgb("reflectance", (0, 0, 0))], type="diffuse"))
    return children
