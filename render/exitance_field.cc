#include "render/exitance_field.h"

#include "render/warp.h"

#include <algorithm>
#include <cmath>

namespace nacre::render {
namespace {

// 1.2 GB of values; beyond it every hit asks the model.
constexpr std::int64_t kMaxGrid = 100'000'000;

float LongestSide(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Vec3 a = mesh.positions[t[0]];
  const Vec3 b = mesh.positions[t[1]];
  const Vec3 c = mesh.positions[t[2]];
  return std::max(Length(b - a), std::max(Length(c - b), Length(a - c)));
}

// Slot of node (i, j), i + j ≤ n, of a triangular grid with n divisions a side.
std::int64_t NodeSlot(int i, int j, int n) {
  return std::int64_t{j} * (n + 1) - std::int64_t{j} * (j - 1) / 2 + i;
}

// For what is blurred, points of the grid that many apart will do.
constexpr int kCoarse = 4;
// And of vertices, one within so many patches.
constexpr float kBlurredPatches = 8;

// A cell of a lattice, and the side to which a normal mostly points. No object reaches
// over the 2²⁰ cells after which numbers repeat: GatherPatches sees to that.
std::uint64_t CellOf(const SurfacePoint& point, float per_mm) {
  std::uint64_t cell = 0;
  int side = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto along =
        static_cast<std::int64_t>(std::floor(point.position_mm[axis] * per_mm));
    cell = (cell << 20) | (static_cast<std::uint64_t>(along) & 0xFFFFFu);
    if (std::abs(point.normal[axis]) > std::abs(point.normal[side])) {
      side = axis;
    }
  }
  return (cell << 3) |
         static_cast<std::uint64_t>(2 * side + (point.normal[side] < 0 ? 1 : 0));
}

// A point a vertex, with the normal and the tangents of the triangles around it.
std::vector<SurfacePoint> VertexPoints(const Shape& shape, float mm_per_unit) {
  const auto& mesh = std::get<TriangleMesh>(shape.geometry);
  const std::size_t count = mesh.positions.size();
  std::vector<Vec3> along_u(count);
  std::vector<Vec3> along_v(count);
  std::vector<Vec3> normals(count);
  std::vector<Vec3> stretch(count);
  std::vector<float> areas(count);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const SurfaceHit hit =
        MeshPoint(shape, static_cast<std::uint32_t>(i), {1.0F / 3, 1.0F / 3});
    const SurfacePoint point = ToSurfacePoint(hit, mm_per_unit);
    const float area = mesh.TriangleArea(i);
    for (const std::uint32_t vertex : mesh.triangles[i]) {
      along_u[vertex] += point.tangent_u * area;
      along_v[vertex] += point.tangent_v * area;
      stretch[vertex] += point.stretch_mm * area;
      areas[vertex] += area;
      normals[vertex] += hit.face_normal * area;
    }
  }
  std::vector<SurfacePoint> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    SurfacePoint& point = points[i];
    const Vec3 sum = mesh.normals.empty() ? normals[i] : mesh.normals[i];
    point.position_mm = mesh.positions[i] * mm_per_unit;
    point.normal = Length(sum) > 0 ? Normalized(sum) : Vec3{0, 0, 1};
    point.uv = mesh.uvs.empty() ? Vec2{} : mesh.uvs[i];
    SetTangents(point, along_u[i], along_v[i]);
    point.stretch_mm = areas[i] > 0 ? stretch[i] / areas[i] : Vec3{};
  }
  return points;
}

}  // namespace

ExitanceField::ExitanceField(const Shape& shape,
                             std::unique_ptr<const Subsurface> subsurface,
                             float spacing_mm,
                             float patch_mm)
    : shape_(shape),
      subsurface_(std::move(subsurface)),
      mm_per_unit_(shape.translucency->mm_per_unit),
      patch_mm_(patch_mm) {
  if (!(spacing_mm > 0)) {
    return;
  }
  const float spacing = spacing_mm / mm_per_unit_;
  if (const auto* mesh = std::get_if<TriangleMesh>(&shape.geometry)) {
    PlanMesh(*mesh, spacing);
  } else {
    PlanSphere(std::get<Sphere>(shape.geometry), spacing);
  }
}

void ExitanceField::PlanMesh(const TriangleMesh& mesh, float spacing) {
  auto next = static_cast<std::int64_t>(mesh.positions.size());
  divisions_.reserve(mesh.triangles.size());
  first_slot_.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    const float longest = LongestSide(mesh, triangle);
    const float wanted =
        longest * mm_per_unit_ <= 2 * patch_mm_ ? 1 : std::ceil(longest / spacing);
    if (!(wanted < 30000)) {
      return;
    }
    const int n = std::max(1, static_cast<int>(wanted));
    divisions_.push_back(n);
    first_slot_.push_back(next);
    next += n > 1 ? std::int64_t{n + 1} * (n + 2) / 2 : 0;
    if (next > kMaxGrid) {
      return;
    }
  }
  vertices_ = VertexPoints(shape_, mm_per_unit_);
  ChooseForBlurred();
  Allocate(next);
}

// One vertex for all in a cell that face the same way: the nearest to their middle.
void ExitanceField::ChooseForBlurred() {
  struct Member {
    std::uint64_t cell;
    std::uint32_t vertex;
    bool operator<(const Member& b) const {
      return cell != b.cell ? cell < b.cell : vertex < b.vertex;
    }
  };
  const float per_mm = 1 / (kBlurredPatches * patch_mm_);
  std::vector<Member> members;
  members.reserve(vertices_.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    members.push_back({CellOf(vertices_[i], per_mm), static_cast<std::uint32_t>(i)});
  }
  std::sort(members.begin(), members.end());
  for_blurred_.resize(vertices_.size());
  for (auto begin = members.begin(); begin != members.end();) {
    const auto end = std::find_if(
        begin, members.end(), [&](const Member& m) { return m.cell != begin->cell; });
    Vec3 sum;
    for (auto m = begin; m != end; ++m) {
      sum += vertices_[m->vertex].position_mm;
    }
    const Vec3 middle = sum / static_cast<float>(end - begin);
    const auto distance2 = [&](const Member& m) {
      const Vec3 d = vertices_[m.vertex].position_mm - middle;
      return Dot(d, d);
    };
    const auto chosen =
        std::min_element(begin, end, [&](const Member& a, const Member& b) {
          return distance2(a) < distance2(b);
        });
    for (; begin != end; ++begin) {
      for_blurred_[begin->vertex] = chosen->vertex;
    }
  }
}

void ExitanceField::PlanSphere(const Sphere& sphere, float spacing) {
  const double rows = std::ceil(static_cast<double>(kPi * sphere.radius / spacing));
  if (!(2 * rows * rows < static_cast<double>(kMaxGrid))) {
    return;
  }
  rows_ = std::max(4, static_cast<int>(rows));
  columns_ = 2 * rows_;
  Allocate(std::int64_t{columns_} * (rows_ + 1));
}

void ExitanceField::Allocate(std::int64_t count) {
  grid_size_ = count;
  values_ = std::make_unique<Value[]>(static_cast<std::size_t>(count));
  for (std::int64_t i = 0; i < count; ++i) {
    values_[static_cast<std::size_t>(i)].r.store(
        std::numeric_limits<float>::quiet_NaN(), std::memory_order_relaxed);
  }
}

Color ExitanceField::At(const SurfaceHit& hit, PathCounters& counters) const {
  if (grid_size_ == 0) {
    ++counters.evaluations;
    return subsurface_->Gather(ToSurfacePoint(hit, mm_per_unit_), counters.pairs);
  }
  return columns_ == 0 ? AtMesh(hit, counters) : AtSphere(hit, counters);
}

template <class MakePoint>
Color ExitanceField::Lookup(std::int64_t slot,
                            PathCounters& counters,
                            const MakePoint& make_point) const {
  Value& value = values_[static_cast<std::size_t>(slot)];
  const float r = value.r.load(std::memory_order_acquire);
  if (!std::isnan(r)) {
    return {r,
            value.g.load(std::memory_order_relaxed),
            value.b.load(std::memory_order_relaxed)};
  }
  // Two threads may do this at once; they store the same.
  ++counters.evaluations;
  const Color exitance = subsurface_->Gather(make_point(), counters.pairs);
  value.g.store(exitance.y, std::memory_order_relaxed);
  value.b.store(exitance.z, std::memory_order_relaxed);
  value.r.store(exitance.x, std::memory_order_release);
  return exitance;
}

Color ExitanceField::AtVertex(std::uint32_t vertex, PathCounters& counters) const {
  return Lookup(vertex, counters, [&] { return vertices_[vertex]; });
}

Color ExitanceField::AtNode(const SurfaceHit& hit,
                            int i,
                            int j,
                            PathCounters& counters) const {
  const int n = divisions_[hit.triangle];
  const std::int64_t slot = first_slot_[hit.triangle] + NodeSlot(i, j, n);
  return Lookup(slot, counters, [&] {
    const float step = 1.0F / static_cast<float>(n);
    const Vec2 barycentric{static_cast<float>(i) * step, static_cast<float>(j) * step};
    return ToSurfacePoint(MeshPoint(shape_, hit.triangle, barycentric), mm_per_unit_);
  });
}

Color ExitanceField::At(const SurfaceHit& hit, const ExitanceQuery& query) const {
  if (query.sight == Sight::kSharp || grid_size_ == 0) {
    return At(hit, query.counters);
  }
  if (!divisions_.empty() && divisions_[hit.triangle] == 1) {
    return AtCorner(hit, query.sight, query.counters);
  }
  return query.sight == Sight::kBlurred ? AtCoarseNode(hit, query.counters)
                                        : At(hit, query.counters);
}

// The nearest corner, or what stands for it.
Color ExitanceField::AtCorner(const SurfaceHit& hit,
                              Sight sight,
                              PathCounters& counters) const {
  const float b1 = hit.barycentric.x;
  const float b2 = hit.barycentric.y;
  const float b0 = 1 - b1 - b2;
  const auto& t = std::get<TriangleMesh>(shape_.geometry).triangles[hit.triangle];
  const std::uint32_t corner = b0 >= b1 && b0 >= b2 ? t[0] : b1 >= b2 ? t[1] : t[2];
  return AtVertex(sight == Sight::kBlurred ? for_blurred_[corner] : corner, counters);
}

// The nearest node of every kCoarse-th.
Color ExitanceField::AtCoarseNode(const SurfaceHit& hit, PathCounters& counters) const {
  const auto nearest = [](float along, int last) {
    const int node = kCoarse * static_cast<int>(along / kCoarse + 0.5F);
    return std::clamp(node, 0, last);
  };
  if (columns_ > 0) {
    return AtLatitude(nearest(hit.uv.x * static_cast<float>(columns_), columns_),
                      nearest(hit.uv.y * static_cast<float>(rows_), rows_),
                      counters);
  }
  const int n = divisions_[hit.triangle];
  const int i = nearest(hit.barycentric.x * static_cast<float>(n), n);
  return AtNode(
      hit, i, nearest(hit.barycentric.y * static_cast<float>(n), n - i), counters);
}

Color ExitanceField::AtMesh(const SurfaceHit& hit, PathCounters& counters) const {
  const float b1 = std::clamp(hit.barycentric.x, 0.0F, 1.0F);
  const float b2 = std::clamp(hit.barycentric.y, 0.0F, 1.0F - b1);
  const int n = divisions_[hit.triangle];
  if (n == 1) {
    const auto& t = std::get<TriangleMesh>(shape_.geometry).triangles[hit.triangle];
    return AtVertex(t[0], counters) * (1 - b1 - b2) + AtVertex(t[1], counters) * b1 +
           AtVertex(t[2], counters) * b2;
  }
  const float x = b1 * static_cast<float>(n);
  const float y = b2 * static_cast<float>(n);
  const int i = std::min(static_cast<int>(x), n - 1);
  const int j = std::min(static_cast<int>(y), n - 1 - i);
  const float fx = x - static_cast<float>(i);
  const float fy = y - static_cast<float>(j);
  const Color right = AtNode(hit, i + 1, j, counters);
  const Color top = AtNode(hit, i, j + 1, counters);
  if (fx + fy <= 1 || i + j + 2 > n) {
    return AtNode(hit, i, j, counters) * (1 - fx - fy) + right * fx + top * fy;
  }
  return AtNode(hit, i + 1, j + 1, counters) * (fx + fy - 1) + right * (1 - fy) +
         top * (1 - fx);
}

Color ExitanceField::AtLatitude(int i, int j, PathCounters& counters) const {
  const int column = i % columns_;
  const std::int64_t slot = std::int64_t{j} * columns_ + column;
  return Lookup(slot, counters, [&] {
    const auto& sphere = std::get<Sphere>(shape_.geometry);
    const float phi =
        2 * kPi * static_cast<float>(column) / static_cast<float>(columns_);
    const float theta = kPi * (1 - static_cast<float>(j) / static_cast<float>(rows_));
    const Vec3 local{std::sin(theta) * std::cos(phi),
                     std::sin(theta) * std::sin(phi),
                     std::cos(theta)};
    const Vec3 point = sphere.center + sphere.axes.ToWorld(local) * sphere.radius;
    return ToSurfacePoint(SpherePoint(shape_, point), mm_per_unit_);
  });
}

Color ExitanceField::AtSphere(const SurfaceHit& hit, PathCounters& counters) const {
  const float x = hit.uv.x * static_cast<float>(columns_);
  const float y = hit.uv.y * static_cast<float>(rows_);
  const int i = std::clamp(static_cast<int>(x), 0, columns_ - 1);
  const int j = std::clamp(static_cast<int>(y), 0, rows_ - 1);
  const float fx = x - static_cast<float>(i);
  const float fy = y - static_cast<float>(j);
  return (AtLatitude(i, j, counters) * (1 - fx) + AtLatitude(i + 1, j, counters) * fx) *
             (1 - fy) +
         (AtLatitude(i, j + 1, counters) * (1 - fx) +
          AtLatitude(i + 1, j + 1, counters) * fx) *
             fy;
}

}  // namespace nacre::render
