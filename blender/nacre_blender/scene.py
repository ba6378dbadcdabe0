"""An evaluated scene to a folder with scene.xml and binary PLY files."""

import os

from . import lights, log, materials, meshes, xml

MESH_LIKE = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
# Emitters that no path can hit.
DELTA = {"point", "spot", "directional", "projector"}


class Exporter:
    """Writes each mesh once, however many instances show it."""

    def __init__(self, depsgraph, folder):
        self.depsgraph = depsgraph
        self.folder = folder
        self.scene = depsgraph.scene_eval
        self.written = {}
        self.shapes = []
        self.emitters = []
        self.soft_lamps = False
        self.shining_meshes = False
        self.media = False
        self.behind_glass = False

    def _files(self, obj):
        key = (obj.type, obj.data.as_pointer() if obj.type == "MESH" else obj.name_full)
        if key not in self.written:
            stem = "mesh%04d" % len(self.written)
            mesh = obj.data if obj.type == "MESH" else obj.to_mesh()
            self.written[key] = meshes.export(mesh, self.folder, stem) if mesh else []
            if obj.type != "MESH":
                obj.to_mesh_clear()
        return self.written[key]

    def _material(self, obj, slot):
        slots = obj.material_slots
        return slots[min(slot, len(slots) - 1)].material if len(slots) else None

    def _mesh(self, obj, matrix):
        if abs(matrix.determinant()) < 1e-20:
            log.warn("%s: scaled to nothing, left out" % obj.name)
            return
        for name, slot, with_uv in self._files(obj):
            material = self._material(obj, slot)
            if not with_uv and material is not None and material.nacre.model == "SVD":
                log.warn("%s: no UV map: all of it shows one point of the measured sample"
                         % obj.name)
            inside = materials.translate(material, self.folder)
            tags = {tag for tag, _, _ in inside}
            self.shining_meshes |= "emitter" in tags
            self.media |= "medium" in tags
            self.behind_glass |= {"medium", "bsdf"} <= tags
            self.shapes.append(xml.element(
                "shape", [xml.string("filename", name), xml.to_world(matrix), *inside], type="ply"))

    def _lamp(self, obj, matrix):
        element = lights.lamp(obj.data, matrix)
        if element is None:
            return
        self.soft_lamps |= element[0] == "shape"
        (self.shapes if element[0] == "shape" else self.emitters).append(element)

    def add_objects(self):
        for instance in self.depsgraph.object_instances:
            obj = instance.object
            if not instance.show_self:
                continue
            if obj.type == "LIGHT":
                self._lamp(obj, instance.matrix_world.copy())
            elif obj.type in MESH_LIKE:
                self._mesh(obj, instance.matrix_world.copy())
            elif obj.type in {"VOLUME", "CURVES", "POINTCLOUD", "GPENCIL", "GREASEPENCIL", "HAIR"}:
                log.warn("%s: objects of type %s aren't translated" % (obj.name, obj.type.lower()))

    def _integrator(self):
        hide = self.scene.render.film_transparent and not self.shining_meshes
        if self.scene.render.film_transparent and self.shining_meshes:
            log.warn("surroundings are seen through the transparent film, as some mesh shines too")
        # In a medium, a path's edges are counted by hundreds: it ends by chance alone.
        depth = -1 if self.media else self.scene.nacre.max_depth
        return xml.element("integrator", [
            xml.integer("maxDepth", depth), xml.boolean("hideEmitters", hide),
        ], type="volpath" if self.media else "path")

    def write(self, sensor):
        """Writes scene.xml and returns its path."""
        self.add_objects()
        surroundings = lights.world(self.scene.world, self.folder)
        if surroundings is not None:
            self.emitters.append(surroundings)
        if self.behind_glass and any(e[1]["type"] in DELTA for e in self.emitters):
            log.warn("lamps without a size light a medium through its boundary by chance: "
                     "give them a radius, or the medium an IOR of 1")
        if not self.emitters and not self.soft_lamps and not self.shining_meshes:
            log.warn("there is no light in the scene")
        root = xml.element(
            "scene", [self._integrator(), sensor, *self.emitters, *self.shapes], version="0.6.0")
        path = os.path.join(self.folder, "scene.xml")
        with open(path, "w", encoding="utf-8") as file:
            file.write('<?xml version="1.0" encoding="utf-8"?>\n' + xml.text(root))
        return path


def export_render(depsgraph, folder, width, height):
    """The scene as its camera sees it. Raises RuntimeError without a camera."""
    log.clear()
    scene = depsgraph.scene_eval
    if scene.camera is None:
        raise RuntimeError("the scene has no camera")
    camera = scene.camera.evaluated_get(depsgraph)
    projection = camera.calc_matrix_camera(
        depsgraph, x=width, y=height, scale_x=scene.render.pixel_aspect_x,
        scale_y=scene.render.pixel_aspect_y)
    if camera.data.dof.use_dof:
        log.warn("depth of field isn't translated")
    if scene.render.use_motion_blur:
        log.warn("motion blur isn't translated")
    if camera.data.type == "PANO":
        log.warn("a panoramic camera is drawn in perspective")
    sensor = lights.sensor(camera.matrix_world, projection, width, height,
                           scene.nacre.samples, scene.render.film_transparent)
    return Exporter(depsgraph, folder).write(sensor)


def export_view(depsgraph, folder, region_data, width, height):
    """The scene as a viewport sees it."""
    log.clear()
    sensor = lights.sensor(region_data.view_matrix.inverted(), region_data.window_matrix,
                           width, height, depsgraph.scene_eval.nacre.preview_samples, False)
    return Exporter(depsgraph, folder).write(sensor)
