"""Lamps, world and camera. Powers are Blender's: P watts of a point are P / 4 pi W/sr."""

import math

from mathutils import Matrix

from . import images, log, xml

# A lamp or a camera looks along -z; the renderer's along +z, with x to the left.
TURN = Matrix.Diagonal((-1.0, 1.0, -1.0, 1.0))
# The middle of Blender's pictures of surroundings is +x, their top +z; here +z and +y.
SURROUNDINGS = Matrix(((0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))


def _rigid(matrix):
    location, rotation, _ = matrix.decompose()
    return Matrix.Translation(location) @ rotation.to_matrix().to_4x4()


def _scaled(color, factor):
    return [factor * c for c in color]


def _shining(shape, matrix, radiance, extra=()):
    return xml.element("shape", [
        xml.to_world(matrix), *extra,
        xml.element("emitter", [
            xml.rgb("radiance", radiance), xml.boolean("hidden", True)], type="area"),
    ], type=shape)


def _point(lamp, matrix):
    intensity = _scaled(lamp.color, lamp.energy / (4 * math.pi))
    radius = lamp.shadow_soft_size
    place = matrix.to_translation()
    if radius <= 1e-6:
        return xml.element("emitter", [
            xml.element("point", name="position", x="%.9g" % place.x, y="%.9g" % place.y,
                        z="%.9g" % place.z),
            xml.rgb("intensity", intensity),
        ], type="point")
    radiance = _scaled(intensity, 1 / (math.pi * radius * radius))
    return _shining("sphere", Matrix.Translation(place) @ Matrix.Scale(radius, 4), radiance)


def _spot(lamp, matrix):
    half = 0.5 * lamp.spot_size
    # Blender's edge is smooth in the cosine, over this share of it.
    beam = math.acos(min(1.0, math.cos(half) + (1 - math.cos(half)) * lamp.spot_blend))
    if lamp.shadow_soft_size > 1e-3:
        log.warn("%s: a spot's shadows are sharp here" % lamp.name)
    return xml.element("emitter", [
        xml.to_world(_rigid(matrix) @ TURN),
        xml.rgb("intensity", _scaled(lamp.color, lamp.energy / (4 * math.pi))),
        xml.number("cutoffAngle", math.degrees(half)), xml.number("beamWidth", math.degrees(beam)),
    ], type="spot")


def _sun(lamp, matrix):
    if lamp.angle > math.radians(1):
        log.warn("%s: a sun's shadows are sharp here" % lamp.name)
    return xml.element("emitter", [
        xml.to_world(_rigid(matrix) @ TURN),
        xml.rgb("irradiance", _scaled(lamp.color, lamp.energy)),
    ], type="directional")


def _area(lamp, matrix):
    round_one = lamp.shape in ("DISK", "ELLIPSE")
    size_x = lamp.size
    size_y = lamp.size_y if lamp.shape in ("RECTANGLE", "ELLIPSE") else lamp.size
    scale = matrix.to_scale()
    half_x, half_y = 0.5 * size_x * abs(scale.x), 0.5 * size_y * abs(scale.y)
    area = (math.pi if round_one else 4) * half_x * half_y
    if area <= 0:
        log.warn("%s: an area lamp without area is left out" % lamp.name)
        return None
    if getattr(lamp, "spread", math.pi) < math.pi - 1e-3:
        log.warn("%s: the spread of an area lamp isn't translated" % lamp.name)
    size = Matrix.Diagonal((half_x, half_y, 1.0, 1.0))
    return _shining("disk" if round_one else "rectangle", _rigid(matrix) @ TURN @ size,
                    _scaled(lamp.color, lamp.energy / (math.pi * area)))


def lamp(data, matrix):
    """A lamp's element, or None if it can't be had."""
    if data.use_nodes:
        log.warn("%s: a lamp's nodes aren't translated" % data.name)
    makers = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
    return makers[data.type](data, matrix)


def _turn(texture):
    """The rotation by which a Mapping node turns directions before they are looked up."""
    socket = texture.inputs["Vector"]
    if not socket.is_linked:
        return Matrix()
    node = socket.links[0].from_node
    if node.type != "MAPPING":
        return Matrix()
    if any(abs(a) > 1e-6 for a in node.inputs["Location"].default_value) or any(
            abs(a - 1) > 1e-6 for a in node.inputs["Scale"].default_value):
        log.warn("surroundings that are moved or scaled aren't translated, only turned ones")
    return node.inputs["Rotation"].default_value.to_matrix().to_4x4()


def _picture(world, texture, strength, folder):
    """A picture of surroundings, or None if it can't be had."""
    if texture.image is None or texture.projection != "EQUIRECTANGULAR":
        log.warn("%s: only equirectangular pictures of surroundings are translated" % world.name)
        return None
    try:
        path = images.file_of(texture.image, folder)
    except (ValueError, OSError, RuntimeError) as error:
        log.warn("%s: %s" % (world.name, error))
        return None
    return xml.element("emitter", [
        xml.string("filename", path), xml.number("scale", strength),
        xml.transform("toWorld", _turn(texture).inverted() @ SURROUNDINGS),
    ], type="envmap")


def world(data, folder):
    """The surroundings' element, or None if they are black."""
    if data is None:
        return None
    if not data.use_nodes or data.node_tree is None:
        return _even(data.color, 1.0)
    node = next((n for n in data.node_tree.nodes if n.type == "BACKGROUND"), None)
    if node is None:
        return None
    color, strength = node.inputs["Color"], node.inputs["Strength"]
    if strength.is_linked:
        log.warn("%s: what is linked to its strength isn't translated" % data.name)
    if color.is_linked:
        texture = color.links[0].from_node
        if texture.type == "TEX_ENVIRONMENT":
            picture = _picture(data, texture, strength.default_value, folder)
            if picture is not None:
                return picture
        else:
            log.warn("%s: %s isn't translated; one colour is used" % (data.name, texture.bl_label))
    return _even(color.default_value, strength.default_value)


def _even(color, strength):
    radiance = [strength * c for c in list(color)[:3]]
    if max(radiance) <= 0:
        return None
    return xml.element("emitter", [xml.rgb("radiance", radiance)], type="constant")


def sensor(matrix, projection, width, height, samples, transparent):
    """Camera and film. `projection` is Blender's window matrix of the view."""
    if abs(projection[0][2]) > 1e-6 or abs(projection[1][2]) > 1e-6:
        log.warn("the camera's shift isn't translated")
    if abs(projection[3][3]) > 0.5:
        log.warn("an orthographic camera is drawn in perspective, from where it stands")
        fov = 40.0
    else:
        fov = 2 * math.degrees(math.atan(1 / projection[0][0]))
    return xml.element("sensor", [
        xml.string("fovAxis", "x"), xml.number("fov", fov),
        xml.to_world(_rigid(matrix) @ TURN),
        xml.element("sampler", [xml.integer("sampleCount", samples)], type="independent"),
        xml.element("film", [
            xml.integer("width", width), xml.integer("height", height),
            xml.string("pixelFormat", "rgba" if transparent else "rgb"),
            xml.boolean("banner", False), xml.element("rfilter", type="gaussian"),
        ], type="hdrfilm"),
    ], type="perspective")
