#pragma once

#include "core/toml.h"
#include "rigs/phantom.h"

#include <optional>
#include <string>
#include <vector>

namespace nacre::rigs {

/// What a phantom file says of substances: [[medium]] tables, `medium = "name"` for
/// named ones, or [skin].
struct PhantomMedia {
  std::vector<std::string> channels;
  std::vector<Medium> media;
  std::optional<double> eta;      ///< of all media, if they are named ones that agree
  std::vector<SlabLayer> layers;  ///< of [skin]: epidermis and dermis; else empty
};

/// A list with a value a channel; one value stands for all channels. Throws BadData for
/// other numbers of values.
std::vector<double> PerChannel(const TomlTable& table,
                               const std::string& key,
                               std::vector<double> values,
                               std::size_t channels);

/// Reads them from a phantom's root table. The dermis is infinitely thick here.
PhantomMedia ReadPhantomMedia(const TomlTable& root);

}  // namespace nacre::rigs
