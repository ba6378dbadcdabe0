#include "factor/internal/material_layout.h"

#include "core/hash.h"

#include <fmt/format.h>

namespace nacre::factor::internal {
namespace {

std::string AttributesText(const ExrAttributes& attributes) {
  std::string text;
  for (const auto& [key, value] : attributes) {
    if (key.starts_with("nacre.") && key != "nacre.checksum") {
      text.append(key).append(1, '=').append(value).append(1, '\n');
    }
  }
  return text;
}

// One plan, or one a channel.
void AddPlans(const PartPlan& all,
              bool is_shared,
              const Material& m,
              std::vector<PartPlan>& plans) {
  if (is_shared) {
    plans.push_back(all);
    return;
  }
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    PartPlan one = all;
    one.name += '.' + m.channels[c];
    one.channels = {m.channels[c]};
    one.sheet.channels = 1;
    one.channel = static_cast<int>(c);
    plans.push_back(one);
  }
}

}  // namespace

std::vector<PartPlan> PlanParts(const Material& m, bool is_whole) {
  const std::vector<std::string> shared{"Y"};
  const auto& map_channels = m.SharesMaps() ? shared : m.channels;
  const auto& kernel_channels = m.SharesKernels() ? shared : m.channels;
  const auto& point_channels = m.is_grey && !is_whole ? shared : m.channels;
  const Sheet points{m.points_x, m.points_y, 1, 1, point_channels.size()};
  const Sheet maps{m.MapWidth(), m.MapHeight(), m.MapCount(), 1, map_channels.size()};
  const Sheet kernels{m.KernelWidth(),
                      static_cast<int>(m.KernelSize() / m.KernelWidth()),
                      m.KernelCount(),
                      m.cluster_count,
                      kernel_channels.size()};
  std::vector<PartPlan> plans{
      {PartKind::kAlbedo, "albedo", points, point_channels},
      {PartKind::kRowScale, "row_scale", points, point_channels}};
  AddPlans({PartKind::kFactors, "factors", maps, map_channels},
           is_whole || m.SharesMaps(),
           m,
           plans);
  AddPlans({PartKind::kKernels, "kernels", kernels, kernel_channels},
           is_whole || m.SharesKernels(),
           m,
           plans);
  plans.push_back(
      {PartKind::kCluster, "cluster", {m.points_x, m.points_y, 1, 1, 1}, shared});
  return plans;
}

std::string AttributesChecksum(const ExrAttributes& attributes) {
  const std::string text = AttributesText(attributes);
  return HashHex(text.data(), text.size());
}

std::string PartChecksum(const ExrPart& part) {
  return fmt::format("{:016x}",
                     Hash64(part.values.data(), part.values.size() * sizeof(float)));
}

std::string WholeChecksum(const ExrAttributes& attributes,
                          const std::vector<ExrPart>& parts) {
  std::string text = AttributesText(attributes);
  for (const ExrPart& part : parts) {
    text += part.name + ':' +
            HashHex(part.values.data(), part.values.size() * sizeof(float)) + '\n';
  }
  return HashHex(text.data(), text.size());
}

}  // namespace nacre::factor::internal
