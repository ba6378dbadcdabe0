#include "factor/internal/material_channel.h"

#include "core/error.h"
#include "factor/material_file.h"

#include <algorithm>
#include <cstdint>

namespace nacre::factor {
namespace internal {
namespace {

std::vector<int> MapsOf(const Material& m, int channel) {
  std::vector<int> maps;
  for (int n = 0; n < m.MapCount(); ++n) {
    const int coefficient = n - m.terms;  // tucker's: [channel][power], then the shift
    if (m.form != Form::kTucker || coefficient < 0 || n == m.MapCount() - 1 ||
        coefficient / (m.order + 1) == channel) {
      maps.push_back(n);
    }
  }
  return maps;
}

}  // namespace

Material ChannelHeader(Material m, int channel) {
  const auto c = static_cast<std::size_t>(channel);
  Expect(channel >= 0 && c < m.channels.size(), "a channel of the material");
  if (!m.steps.empty()) {
    std::vector<float> steps;
    const int set = m.MapSets() == 1 ? 0 : channel;
    for (const int n : MapsOf(m, channel)) {
      steps.push_back(
          m.steps.f[static_cast<std::size_t>(std::int64_t{set} * m.MapCount() + n)]);
    }
    m.steps.f = std::move(steps);
    m.steps.h = {m.steps.h[m.KernelSets() == 1 ? 0 : c]};
  }
  m.channels = {m.channels[c]};
  m.a = {m.a[c]};
  m.b = {m.b[c]};
  m.is_grey = false;
  return m;
}

std::vector<float> ChannelMaps(const Material& m, int channel, const float* maps) {
  std::vector<float> taken;
  for (const int n : MapsOf(m, channel)) {
    taken.insert(taken.end(), maps + n * m.MapSize(), maps + (n + 1) * m.MapSize());
  }
  return taken;
}

}  // namespace internal

Material ChannelOf(const Material& m, int channel) {
  Material one = internal::ChannelHeader(m, channel);
  const auto plane = [&](const std::vector<float>& planes) {
    const auto first = planes.begin() + channel * m.PointCount();
    return std::vector<float>(first, first + m.PointCount());
  };
  one.f = internal::ChannelMaps(m, channel, m.FactorMap(channel, 0));
  const float* kernels = m.Kernel(channel, 0, 0);
  one.h.assign(kernels, kernels + std::ssize(m.h) / m.KernelSets());
  one.row_scale = plane(m.row_scale);
  one.albedo = plane(m.albedo);
  return one;
}

}  // namespace nacre::factor
