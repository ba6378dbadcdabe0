#include "render/embree_scene.h"

#include "core/error.h"
#include "core/parallel.h"

#include <embree3/rtcore.h>

#include <array>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <tbb/task_arena.h>

namespace nacre::render {
namespace {

// Embree remembers the first error of its device; queries can't fail.
void CheckEmbree(RTCDevice device, const char* doing) {
  const RTCError code = rtcGetDeviceError(device);
  if (code != RTC_ERROR_NONE) {
    throw Error(fmt::format("Embree failed {}: {}",
                            doing,
                            code == RTC_ERROR_OUT_OF_MEMORY
                                ? "out of memory; use smaller meshes"
                                : fmt::format("code {}", static_cast<int>(code))));
  }
}

// Embree may read 16 bytes from the last vertex on, so it gets a buffer of its own.
template <class T>
T* NewBuffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, size_t count) {
  return static_cast<T*>(
      rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), count));
}

RTCGeometry MeshGeometry(RTCDevice device, const TriangleMesh& mesh) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = NewBuffer<Vec3>(
      geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.positions.size());
  std::copy(mesh.positions.begin(), mesh.positions.end(), vertices);
  using Triangle = std::array<std::uint32_t, 3>;
  auto* triangles = NewBuffer<Triangle>(
      geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles.size());
  std::copy(mesh.triangles.begin(), mesh.triangles.end(), triangles);
  return geometry;
}

RTCGeometry SphereGeometry(RTCDevice device, const Sphere& sphere) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  struct CenterAndRadius {
    Vec3 center;
    float radius;
  };
  auto* points = NewBuffer<CenterAndRadius>(
      geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, 1);
  points[0] = {sphere.center, sphere.radius};
  return geometry;
}

RTCRay ToEmbree(const Ray& ray) {
  RTCRay r;
  r.org_x = ray.origin.x;
  r.org_y = ray.origin.y;
  r.org_z = ray.origin.z;
  r.tnear = ray.t_min;
  r.dir_x = ray.direction.x;
  r.dir_y = ray.direction.y;
  r.dir_z = ray.direction.z;
  r.time = 0;
  r.tfar = ray.t_max;
  r.mask = ~0u;
  r.id = 0;
  r.flags = 0;
  return r;
}

}  // namespace

struct EmbreeScene::Handles {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::map<std::size_t, RTCScene> groups;  ///< by the first of their shapes
  ~Handles() {
    if (scene != nullptr) {
      rtcReleaseScene(scene);
    }
    for (const auto& group : groups) {
      rtcReleaseScene(group.second);
    }
    if (device != nullptr) {
      rtcReleaseDevice(device);
    }
  }

  RTCScene NewScene() const {
    const RTCScene made = rtcNewScene(device);
    rtcSetSceneFlags(made, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(made, RTC_BUILD_QUALITY_MEDIUM);
    return made;
  }

  void Attach(RTCScene to, RTCGeometry geometry, std::size_t id) const {
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(to, geometry, static_cast<unsigned>(id));
    rtcReleaseGeometry(geometry);
  }

  void Attach(RTCScene to, const Shape& shape, std::size_t id) const {
    const auto* mesh = std::get_if<TriangleMesh>(&shape.geometry);
    Attach(to,
           mesh != nullptr ? MeshGeometry(device, *mesh)
                           : SphereGeometry(device, std::get<Sphere>(shape.geometry)),
           id);
  }

  // An instance's geometry has the number of all shapes and the instances before it.
  void Attach(const std::vector<Shape>& shapes,
              const ShapeInstance& instance,
              std::size_t id) {
    RTCScene& group = groups[instance.first];
    if (group == nullptr) {
      group = NewScene();
      for (std::size_t i = 0; i < instance.count; ++i) {
        Attach(group, shapes[instance.first + i], i);
      }
      rtcCommitScene(group);
    }
    const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(geometry, group);
    std::array<float, 12> columns{};
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const auto row = static_cast<int>(k % 3);
      columns[k] = static_cast<float>(instance.to_world(row, static_cast<int>(k / 3)));
    }
    rtcSetGeometryTransform(
        geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns.data());
    Attach(scene, geometry, id);
  }
};

EmbreeScene::EmbreeScene(const std::vector<Shape>& shapes,
                         std::vector<ShapeInstance> instances,
                         int thread_count)
    : shapes_(shapes),
      instances_(std::move(instances)),
      handles_(std::make_unique<Handles>()) {
  // Its "threads=" would limit all of oneTBB, and stay; an arena limits the build
  // alone.
  handles_->device = rtcNewDevice(nullptr);
  CheckEmbree(handles_->device, "to start");
  handles_->scene = handles_->NewScene();
  tbb::task_arena arena(ThreadCount(thread_count));
  arena.execute([&] {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (!shapes[i].instanced) {
        handles_->Attach(handles_->scene, shapes[i], i);
      }
    }
    for (std::size_t k = 0; k < instances_.size(); ++k) {
      handles_->Attach(shapes, instances_[k], shapes.size() + k);
    }
    rtcCommitScene(handles_->scene);
  });
  CheckEmbree(handles_->device, "to build the scene");
  if (shapes.empty()) {
    return;
  }
  RTCBounds bounds;
  rtcGetSceneBounds(handles_->scene, &bounds);
  const Vec3 low{bounds.lower_x, bounds.lower_y, bounds.lower_z};
  const Vec3 high{bounds.upper_x, bounds.upper_y, bounds.upper_z};
  center_ = (low + high) * 0.5F;
  radius_ = 0.5F * Length(high - low);
}

EmbreeScene::~EmbreeScene() = default;

bool EmbreeScene::Intersect(const Ray& ray, SurfaceHit& hit) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query;
  query.ray = ToEmbree(ray);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(handles_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) {
    return false;
  }
  const bool instanced = query.hit.instID[0] != RTC_INVALID_GEOMETRY_ID;
  const ShapeInstance* const instance =
      instanced ? &instances_[query.hit.instID[0] - shapes_.size()] : nullptr;
  const auto index =
      static_cast<std::uint32_t>(query.hit.geomID + (instanced ? instance->first : 0));
  const Shape& shape = shapes_[index];
  if (std::holds_alternative<TriangleMesh>(shape.geometry)) {
    hit = MeshPoint(shape, query.hit.primID, {query.hit.u, query.hit.v});
  } else if (!instanced) {
    hit = SpherePoint(shape, ray.origin + ray.direction * query.ray.tfar);
  } else {
    // Embree's normal is that of the group's own space.
    const Sphere& sphere = std::get<Sphere>(shape.geometry);
    const Vec3 outward =
        Normalized(Vec3{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z});
    hit = SpherePoint(shape, sphere.center + outward * sphere.radius);
  }
  if (instanced) {
    hit = Moved(hit, instance->to_world);
  }
  hit.shape_index = index;
  hit.distance = query.ray.tfar;
  return true;
}

bool EmbreeScene::Occluded(const Ray& ray) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay query = ToEmbree(ray);
  rtcOccluded1(handles_->scene, &context, &query);
  return query.tfar < 0;
}

Vec3 OffsetOrigin(const SurfaceHit& hit, Vec3 direction) {
  const bool below = Dot(hit.face_normal, direction) < 0;
  return hit.position + hit.face_normal * (below ? -hit.offset : hit.offset);
}

}  // namespace nacre::render
