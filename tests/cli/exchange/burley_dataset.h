#pragma once

#include "cli/exchange/burley.h"
#include "reconstruct/rd_dataset.h"

#include <cstddef>

namespace nacre::testing {

/// Each point's window is Burley's profile with the albedo and length that
/// `parameters(channel, i, j)` gives, {A, d_mm}.
template <class Parameters>
reconstruct::RdDataset BurleyDataset(int points, int core, Parameters&& parameters) {
  reconstruct::RdDataset data;
  data.header = {.points_x = points,
                 .points_y = points,
                 .core = core,
                 .pitch_mm = 0.5,
                 .eta = 1.4,
                 .channels = {"R", "G", "B"},
                 .provenance = "{}"};
  for (int j = 0; j < points; ++j) {
    for (int i = 0; i < points; ++i) {
      for (int c = 0; c < 3; ++c) {
        const auto [albedo, d_mm] = parameters(c, i, j);
        for (const double share : exchange::BurleyWindow(core, 0.5, d_mm)) {
          data.rd.push_back(static_cast<float>(albedo * share / (0.5 * 0.5)));
        }
      }
    }
  }
  data.sigma.assign(data.rd.size(), 0);
  data.valid.assign(data.rd.size(), 1);
  return data;
}

}  // namespace nacre::testing
