#include "render/embree_scene.h"

#include "core/error.h"
#include "core/parallel.h"

#include <embree3/rtcore.h>

#include <cmath>
#include <fmt/format.h>
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
  ~Handles() {
    if (scene != nullptr) {
      rtcReleaseScene(scene);
    }
    if (device != nullptr) {
      rtcReleaseDevice(device);
    }
  }
};

EmbreeScene::EmbreeScene(const std::vector<Shape>& shapes, int thread_count)
    : shapes_(shapes), handles_(std::make_unique<Handles>()) {
  // Its "threads=" would limit all of oneTBB, and stay; an arena limits the build
  // alone.
  handles_->device = rtcNewDevice(nullptr);
  CheckEmbree(handles_->device, "to start");
  handles_->scene = rtcNewScene(handles_->device);
  rtcSetSceneFlags(handles_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(handles_->scene, RTC_BUILD_QUALITY_MEDIUM);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto* mesh = std::get_if<TriangleMesh>(&shapes[i].geometry);
    const RTCGeometry geometry =
        mesh != nullptr
            ? MeshGeometry(handles_->device, *mesh)
            : SphereGeometry(handles_->device, std::get<Sphere>(shapes[i].geometry));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(handles_->scene, geometry, static_cast<unsigned>(i));
    rtcReleaseGeometry(geometry);
  }
  tbb::task_arena arena(ThreadCount(thread_count));
  arena.execute([&] { rtcCommitScene(handles_->scene); });
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
  const Shape& shape = shapes_[query.hit.geomID];
  hit = std::holds_alternative<TriangleMesh>(shape.geometry)
            ? MeshPoint(shape, query.hit.primID, {query.hit.u, query.hit.v})
            : SpherePoint(shape, ray.origin + ray.direction * query.ray.tfar);
  hit.shape_index = query.hit.geomID;
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
