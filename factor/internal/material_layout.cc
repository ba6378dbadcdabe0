#include "factor/internal/material_layout.h"

#include "core/hash.h"

namespace nacre::factor::internal {

const std::vector<std::string>& SharedChannel() {
  static const std::vector<std::string> shared{"Y"};
  return shared;
}

const std::vector<std::string>& MapChannels(const Material& m) {
  return m.SharesMaps() ? SharedChannel() : m.channels;
}

const std::vector<std::string>& KernelChannels(const Material& m) {
  return m.SharesKernels() ? SharedChannel() : m.channels;
}

Layout LayoutOf(const Material& m) {
  const std::size_t n = m.channels.size();
  return {{m.points_x, m.points_y, 1, 1, n},
          {m.MapWidth(),
           m.MapHeight(),
           m.MapCount(),
           1,
           static_cast<std::size_t>(m.MapSets())},
          {m.KernelWidth(),
           static_cast<int>(m.KernelSize() / m.KernelWidth()),
           m.KernelCount(),
           m.cluster_count,
           static_cast<std::size_t>(m.KernelSets())},
          {m.points_x, m.points_y, 1, 1, 1}};
}

std::string Checksum(const ExrAttributes& attributes,
                     const std::vector<ExrPart>& parts) {
  std::string text;
  for (const auto& [key, value] : attributes) {
    if (key.starts_with("nacre.") && key != "nacre.checksum") {
      text += key + '=' + value + '\n';
    }
  }
  for (const ExrPart& part : parts) {
    text += part.name + ':' +
            HashHex(part.values.data(), part.values.size() * sizeof(float)) + '\n';
  }
  return HashHex(text.data(), text.size());
}

}  // namespace nacre::factor::internal
