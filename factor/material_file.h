#pragma once

#include "factor/material.h"

#include <cstdint>
#include <filesystem>
#include <memory>

namespace nacre::factor {

/// One channel of a material as a material of its own, with what the channels share:
/// Evaluate(0, …) of it is Evaluate(channel, …) of the whole, to the bit.
Material ChannelOf(const Material& material, int channel);

/// A `*.nacre.exr` whose channels are read one at a time, each when it is first asked
/// for, and kept. Safe to ask from many threads.
class MaterialFile {
 public:
  /// Reads and checks the attributes alone.
  explicit MaterialFile(const std::filesystem::path& path);
  ~MaterialFile();
  MaterialFile(const MaterialFile&) = delete;
  MaterialFile& operator=(const MaterialFile&) = delete;

  /// All but maps, kernels, clusters, scales and albedo, which are empty.
  const Material& header() const;

  /// As ChannelOf(ReadMaterial(path), channel). Throws BadData where what the channel
  /// needs doesn't match its checksums or makes no sense. Files before version 6 are
  /// read whole for the first channel that is asked for.
  const Material& Channel(int channel) const;

  /// How many channels have been read, and the values of all parts read for them.
  int channels_read() const;
  std::int64_t values_read() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace nacre::factor
