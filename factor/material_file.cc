// Reads *.nacre.exr (internal/material_layout.h), whole or a channel at a time, and
// checks all that it reads.

#include "factor/material_file.h"

#include "core/error.h"
#include "core/exr_reader.h"
#include "factor/internal/material_attributes.h"
#include "factor/internal/material_channel.h"
#include "factor/internal/material_checks.h"
#include "factor/internal/material_codes.h"
#include "factor/internal/material_layout.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <mutex>

namespace nacre::factor {
namespace {

using internal::PartKind;
using internal::PartPlan;

constexpr std::size_t kMostBytes = std::size_t{4} << 30;

// The parts of a file.
class PartReader {
 public:
  explicit PartReader(const std::filesystem::path& path)
      : path_(path.string()),
        exr_(path, kMostBytes),
        header_(internal::ReadMaterialHeader(exr_.parts().front().attributes, path_)),
        plans_(internal::PlanParts(header_.material, header_.is_whole)) {
    internal::ValidateFields(header_.material, path_);
    std::erase_if(plans_, [&](const PartPlan& plan) { return MayMiss(plan); });
    for (const PartPlan& plan : plans_) {
      Check(plan, exr_.parts()[Find(plan)]);
    }
    if (!header_.is_whole) {
      RequireChecksum(internal::AttributesChecksum(exr_.parts().front().attributes) ==
                      header_.checksum);
      return;
    }
    // One checksum of all: all is read.
    for (std::size_t n = 0; n < exr_.parts().size(); ++n) {
      whole_.push_back(exr_.Read(n));
    }
  }

  const internal::MaterialHeader& header() const { return header_; }
  const std::vector<PartPlan>& plans() const { return plans_; }
  const std::string& path() const { return path_; }
  std::int64_t values_read() const { return values_read_; }

  // The values of a part in the order of a material's; empty if there is no such part.
  std::vector<float> Read(PartKind kind, int channel) {
    std::vector<float> values;
    for (const PartPlan& plan : plans_) {
      if (plan.kind == kind &&
          (channel < 0 || plan.channel < 0 || plan.channel == channel)) {
        const std::vector<float> more =
            channel >= 0 && plan.channel < 0 ? Shared(plan) : Values(plan);
        values.insert(values.end(), more.begin(), more.end());
      }
    }
    return values;
  }

  // Where there is one checksum of all.
  void CheckWhole() const {
    RequireChecksum(!header_.is_whole ||
                    internal::WholeChecksum(exr_.parts().front().attributes, whole_) ==
                        header_.checksum);
  }

 private:
  bool MayMiss(const PartPlan& plan) const {
    return !header_.is_whole && !header_.parts.contains(plan.name) &&
           (plan.kind == PartKind::kRowScale ||
            (plan.kind == PartKind::kCluster && header_.material.cluster_count == 1));
  }

  void RequireChecksum(bool matches) const {
    if (!matches) {
      throw BadData(path_ +
                    ": its checksum doesn't match: the file was damaged after it was "
                    "written; make it again with 'nacre factor'");
    }
  }

  std::size_t Find(const PartPlan& plan) const {
    const std::vector<ExrPart>& parts = exr_.parts();
    const ExrPart& part = FindPart(parts, plan.name, path_);
    return static_cast<std::size_t>(&part - parts.data());
  }

  void Check(const PartPlan& plan, const ExrPart& part) const {
    const std::int64_t width = std::int64_t{plan.sheet.width} * plan.sheet.columns;
    const std::int64_t height = std::int64_t{plan.sheet.height} * plan.sheet.rows;
    if (part.width != width || part.height != height ||
        part.channels.size() != plan.channels.size()) {
      throw BadData(
          fmt::format("{}: part '{}' is {} x {} pixels of {} channels where "
                      "{} x {} of {} are expected",
                      path_,
                      plan.name,
                      part.width,
                      part.height,
                      part.channels.size(),
                      width,
                      height,
                      plan.channels.size()));
    }
    for (const std::string& channel : plan.channels) {
      if (part.FindChannel(channel) < 0) {
        throw BadData(fmt::format(
            "{}: part '{}' has no channel '{}'", path_, plan.name, channel));
      }
    }
  }

  // Read for one channel, kept for the others.
  const std::vector<float>& Shared(const PartPlan& plan) {
    const auto known = shared_.find(plan.name);
    return known != shared_.end()
               ? known->second
               : shared_.emplace(plan.name, Values(plan)).first->second;
  }

  std::vector<float> Values(const PartPlan& plan) {
    const std::size_t index = Find(plan);
    ExrPart part = header_.is_whole ? whole_[index] : exr_.Read(index);
    if (!header_.is_whole) {
      const auto found = header_.parts.find(plan.name);
      RequireChecksum(found != header_.parts.end() &&
                      found->second == internal::PartChecksum(part));
      if (!header_.material.steps.empty() && plan.kind != PartKind::kAlbedo &&
          plan.kind != PartKind::kCluster) {
        internal::Unfold(plan.sheet, part);
      }
    }
    values_read_ += std::ssize(part.values);
    std::vector<const float*> planes;
    for (const std::string& channel : plan.channels) {
      planes.push_back(
          part.Channel(static_cast<std::size_t>(part.FindChannel(channel))));
    }
    std::vector<float> values(plan.sheet.Size());
    const std::size_t plane_size = part.PixelCount();
    plan.sheet.ForEach([&](std::size_t in_sheet, std::size_t in_material) {
      values[in_material] = planes[in_sheet / plane_size][in_sheet % plane_size];
    });
    return values;
  }

  std::string path_;
  ExrReader exr_;
  internal::MaterialHeader header_;
  std::vector<PartPlan> plans_;
  std::vector<ExrPart> whole_;  // of a file of one checksum
  std::map<std::string, std::vector<float>> shared_;
  std::int64_t values_read_ = 0;
};

std::vector<std::uint8_t> Clusters(PartReader& parts, int channel) {
  const std::vector<float> values = parts.Read(PartKind::kCluster, channel);
  std::vector<std::uint8_t> clusters;
  for (const float value : values) {
    if (!(value >= 0 && value <= 255 && value == std::floor(value))) {
      throw BadData(
          fmt::format("{}: part 'cluster' holds {}, not a number of a cluster",
                      parts.path(),
                      value));
    }
    clusters.push_back(static_cast<std::uint8_t>(value));
  }
  if (clusters.empty()) {
    clusters.resize(static_cast<std::size_t>(parts.header().material.PointCount()), 0);
  }
  return clusters;
}

// The plane of a channel, or all of them (-1); a plane of Y stands for all.
std::vector<float> Planes(const Material& m, std::vector<float> planes, int channel) {
  const auto points = static_cast<std::size_t>(m.PointCount());
  const std::vector<float> once(planes.begin(),
                                planes.begin() + static_cast<std::ptrdiff_t>(points));
  if (channel >= 0) {
    const std::size_t stored = planes.size() / points;
    const auto first =
        planes.begin() +
        static_cast<std::ptrdiff_t>(
            points * (stored == 1 ? 0 : static_cast<std::size_t>(channel)));
    return {first, first + static_cast<std::ptrdiff_t>(points)};
  }
  while (planes.size() < points * m.channels.size()) {
    planes.insert(planes.end(), once.begin(), once.end());
  }
  return planes;
}

// All of it (-1), or one channel of a file that has parts for it.
Material ReadParts(PartReader& parts, int channel) {
  const internal::MaterialHeader& header = parts.header();
  const Material& all = header.material;
  Material m = channel < 0 ? all : internal::ChannelHeader(all, channel);
  m.albedo = Planes(all, parts.Read(PartKind::kAlbedo, channel), channel);
  m.row_scale = parts.Read(PartKind::kRowScale, channel);
  const bool is_scaled = !m.row_scale.empty();
  if (is_scaled) {
    m.row_scale = Planes(all, std::move(m.row_scale), channel);
  }
  m.f = parts.Read(PartKind::kFactors, channel);
  if (channel >= 0) {
    m.f = internal::ChannelMaps(all, channel, m.f.data());
  }
  m.h = parts.Read(PartKind::kKernels, channel);
  m.cluster = Clusters(parts, channel);
  if (!m.steps.empty()) {
    internal::Decode(header.f_least, header.h_least, m);
  }
  if (!is_scaled) {
    m.row_scale.assign(m.albedo.size(), 1.0F);
  }
  Validate(m, parts.path());
  return m;
}

Material ReadWhole(PartReader& parts) {
  Material m = ReadParts(parts, -1);
  parts.CheckWhole();
  return m;
}

}  // namespace

struct MaterialFile::State {
  explicit State(const std::filesystem::path& path)
      : parts(path),
        slots(parts.header().material.channels.size()),
        channels(slots.size()) {}

  // For good: a channel's material stays where it is.
  const Material& Keep(std::size_t c, Material material) {
    channels[c] = std::make_unique<const Material>(std::move(material));
    slots[c].store(channels[c].get(), std::memory_order_release);
    ++read;
    return *channels[c];
  }

  std::mutex reading;
  PartReader parts;
  std::vector<std::atomic<const Material*>> slots;
  std::vector<std::unique_ptr<const Material>> channels;
  std::atomic<int> read = 0;
};

MaterialFile::MaterialFile(const std::filesystem::path& path)
    : state_(std::make_unique<State>(path)) {}

MaterialFile::~MaterialFile() = default;

const Material& MaterialFile::header() const {
  return state_->parts.header().material;
}

const Material& MaterialFile::Channel(int channel) const {
  Expect(channel >= 0 && channel < std::ssize(state_->slots),
         "a channel of the material");
  const auto c = static_cast<std::size_t>(channel);
  if (const Material* known = state_->slots[c].load(std::memory_order_acquire)) {
    return *known;
  }
  const std::lock_guard lock(state_->reading);
  if (const Material* known = state_->slots[c].load(std::memory_order_acquire)) {
    return *known;
  }
  if (!state_->parts.header().is_whole) {
    return state_->Keep(c, ReadParts(state_->parts, channel));
  }
  const Material whole = ReadWhole(state_->parts);
  for (std::size_t n = 0; n < state_->slots.size(); ++n) {
    state_->Keep(n, ChannelOf(whole, static_cast<int>(n)));
  }
  return *state_->channels[c];
}

int MaterialFile::channels_read() const {
  return state_->read.load();
}

std::int64_t MaterialFile::values_read() const {
  const std::lock_guard lock(state_->reading);
  return state_->parts.values_read();
}

Material ReadMaterial(const std::filesystem::path& path) {
  PartReader parts(path);
  return ReadWhole(parts);
}

}  // namespace nacre::factor
