#include "rigs/photo.h"

#include "core/error.h"
#include "core/fresnel.h"
#include "rigs/transport/monte_carlo/monte_carlo_transport.h"
#include "rigs/transport/solve_units.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fmt/format.h>
#include <memory>
#include <span>
#include <utility>

namespace nacre::rigs {
namespace {

// The phantom with a grid point in each pixel and a window that reaches as far as light
// does, but no farther than the picture.
Phantom WithPixelGrid(Phantom phantom, const ExrPart& image) {
  const acquire::GridDescription grid = phantom.grid;
  if (grid.points_x == 0) {
    throw BadData("the phantom has no [grid], so the picture's area isn't known");
  }
  const double pixel_mm = grid.points_x * grid.pitch_mm / image.width;
  const double height_mm = grid.points_y * grid.pitch_mm / image.height;
  if (std::abs(pixel_mm - height_mm) > 1e-6 * pixel_mm) {
    throw BadData(fmt::format(
        "{} × {} pixels over {:g} × {:g} mm aren't square: use the grid's aspect ratio",
        image.width,
        image.height,
        grid.points_x * grid.pitch_mm,
        grid.points_y * grid.pitch_mm));
  }
  phantom.grid = {};
  phantom.grid.pitch_mm = pixel_mm;
  phantom.grid.points_x = image.width;
  phantom.grid.points_y = image.height;
  return phantom;
}

int CoreFor(const Phantom& phantom, Solver solver, const SolverOptions& options) {
  Phantom without_grid = phantom;
  without_grid.grid = {};
  const auto transport = MakeTransport(without_grid, solver, options);
  double reach_mm = 0;
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    reach_mm = std::max(reach_mm, transport->ReachMm(c));
  }
  const int radius =
      std::min(static_cast<int>(std::ceil(reach_mm / phantom.grid.pitch_mm)),
               std::max(phantom.grid.points_x, phantom.grid.points_y) - 1);
  return 2 * radius + 1;
}

struct Scene {
  const Transport* transport;
  const ExrPart* image;
  std::vector<std::size_t> image_channel;  // of each of the phantom's
};

// The rows of a picture that the light on one row can leave by.
struct Band {
  int first = 0;
  int count = 0;
  Band(const acquire::GridDescription& grid, int row)
      : first(std::max(0, row - grid.core / 2)),
        count(std::min(grid.points_y - 1, row + grid.core / 2) - first + 1) {}
  std::size_t Pixels(const acquire::GridDescription& grid) const {
    return static_cast<std::size_t>(count) * static_cast<std::size_t>(grid.points_x);
  }
};

// Adds what leaves because of the light that falls on one pixel to its row's band,
// channel after channel.
void AddPixel(const Scene& scene, int column, int row, std::vector<float>& exitance) {
  const Phantom& phantom = scene.transport->phantom();
  const acquire::GridDescription& grid = phantom.grid;
  const Band band(grid, row);
  const auto at = static_cast<std::size_t>(std::int64_t{row} * grid.points_x + column);
  const auto light = [&](std::size_t c) {
    return scene.image->Channel(scene.image_channel[c])[at];
  };
  bool is_dark = true;
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    is_dark = is_dark && light(c) == 0.0F;
  }
  if (is_dark) {
    return;
  }
  const Window window = scene.transport->WindowAround(grid.Point(column, row));
  const int radius = grid.core / 2;
  const auto entering = static_cast<float>(FresnelTransmittance(1, phantom.slab.eta) *
                                           grid.pitch_mm * grid.pitch_mm);
  const int first_column = std::max(0, column - radius);
  const int last_column = std::min(grid.points_x - 1, column + radius);
  for (std::size_t c = 0; c < phantom.channels.size(); ++c) {
    const float flux = entering * light(c);
    for (int y = band.first; y < band.first + band.count; ++y) {
      const std::size_t from = (c * static_cast<std::size_t>(grid.core) +
                                static_cast<std::size_t>(y - row + radius)) *
                                   static_cast<std::size_t>(grid.core) +
                               static_cast<std::size_t>(first_column - column + radius);
      const std::size_t to =
          c * band.Pixels(grid) +
          static_cast<std::size_t>((y - band.first) * grid.points_x + first_column);
      const auto count =
          static_cast<std::size_t>(std::int64_t{last_column} - first_column + 1);
      for (std::size_t k = 0; k < count; ++k) {
        exitance[to + k] += flux * window.rd[from + k];
      }
    }
  }
}

std::vector<std::size_t> ImageChannels(const Phantom& phantom,
                                       const ExrPart& illumination) {
  std::vector<std::size_t> channels;
  for (const std::string& channel : phantom.channels) {
    const int index = illumination.FindChannel(channel);
    if (index < 0) {
      throw BadData("the illumination has no channel " + channel +
                    ", which the phantom has");
    }
    channels.push_back(static_cast<std::size_t>(index));
  }
  for (const float e : illumination.values) {
    if (!(e >= 0) || !std::isfinite(e)) {
      throw BadData(fmt::format(
          "the illumination has a pixel of {}; light can't be negative, nor infinite",
          e));
    }
  }
  return channels;
}

ExrPart BlackPicture(const Phantom& phantom, const ExrPart& illumination) {
  ExrPart picture;
  picture.width = illumination.width;
  picture.height = illumination.height;
  picture.channels = phantom.channels;
  picture.values.assign(phantom.channels.size() * illumination.PixelCount(), 0.0F);
  return picture;
}

// Photons of one channel of the whole picture.
monte_carlo::Result FollowPhotons(const monte_carlo::MonteCarloTransport& transport,
                                  std::size_t channel,
                                  std::span<const double> flux,
                                  const ProgressFunction& progress) {
  const acquire::GridDescription& grid = transport.phantom().grid;
  std::vector<PointMm> centres;
  for (int row = 0; row < grid.points_y; ++row) {
    for (int column = 0; column < grid.points_x; ++column) {
      centres.push_back(grid.Point(column, row));
    }
  }
  monte_carlo::Source source = transport.SourceAt({});
  source.footprint = std::make_shared<const monte_carlo::Footprint>(
      monte_carlo::MakeFootprint(centres, flux));
  // A window with the picture in its upper left corner.
  const int core = std::max(grid.points_x, grid.points_y) | 1;
  const auto window_centre = [&](int points) {
    return 0.5 * grid.pitch_mm * (core - points);
  };
  return transport.SimulateLight(
      source,
      channel,
      {.window_centre = {window_centre(grid.points_x), -window_centre(grid.points_y)},
       .window_core = core,
       .window_pitch_mm = grid.pitch_mm},
      progress);
}

Photo PhotographByPhotons(const Phantom& by_pixel,
                          const ExrPart& illumination,
                          const SolverOptions& options,
                          const ProgressFunction& progress) {
  const auto made = MakeTransport(by_pixel, Solver::kMonteCarlo, options, progress);
  const auto* transport =
      dynamic_cast<const monte_carlo::MonteCarloTransport*>(made.get());
  Expect(transport != nullptr, "Monte Carlo as asked for");
  const std::vector<std::size_t> channels = ImageChannels(by_pixel, illumination);
  const double pixel_mm2 = by_pixel.grid.pitch_mm * by_pixel.grid.pitch_mm;
  Photo photo{BlackPicture(by_pixel, illumination),
              BlackPicture(by_pixel, illumination)};
  for (std::size_t c = 0; c < channels.size(); ++c) {
    std::vector<double> flux;
    double sum = 0;
    for (std::size_t k = 0; k < illumination.PixelCount(); ++k) {
      flux.push_back(static_cast<double>(illumination.Channel(channels[c])[k]) *
                     pixel_mm2);
      sum += flux.back();
    }
    if (sum == 0) {
      continue;  // a dark channel is black
    }
    const monte_carlo::Result r =
        FollowPhotons(*transport,
                      c,
                      flux,
                      PartOf(progress,
                             static_cast<std::int64_t>(c),
                             static_cast<std::int64_t>(channels.size())));
    const double entered = (1 - r.specular) * sum;
    const auto core =
        static_cast<std::size_t>(std::max(illumination.width, illumination.height) | 1);
    const auto width = static_cast<std::size_t>(illumination.width);
    for (std::size_t k = 0; k < illumination.PixelCount(); ++k) {
      const monte_carlo::Estimate& cell =
          r.window_per_mm2[k / width * core + k % width];
      photo.exitance.Channel(c)[k] = static_cast<float>(entered * cell.mean);
      photo.standard_error.Channel(c)[k] = static_cast<float>(entered * cell.se);
    }
  }
  return photo;
}

}  // namespace

Photo PhotographUnder(const Phantom& phantom,
                      Solver solver,
                      const ExrPart& illumination,
                      const SolverOptions& options,
                      const ProgressFunction& progress) {
  Phantom by_pixel = WithPixelGrid(phantom, illumination);
  if (solver == Solver::kMonteCarlo) {
    return PhotographByPhotons(by_pixel, illumination, options, progress);
  }
  // What every rank does by itself: the solver is asked from many threads.
  SolverOptions alone = options;
  alone.ranks = nullptr;
  by_pixel.grid.core = CoreFor(by_pixel, solver, alone);
  const auto transport = MakeTransport(by_pixel, solver, alone);
  const Scene scene{
      transport.get(), &illumination, ImageChannels(phantom, illumination)};
  const acquire::GridDescription& grid = transport->phantom().grid;
  const std::size_t channels = phantom.channels.size();
  Photo photo{BlackPicture(phantom, illumination), {}};
  constexpr std::int64_t kAtOnce = 8;
  SolveUnits(
      {.ranks = options.ranks,
       .thread_count = options.thread_count,
       .at_once = kAtOnce},
      illumination.height,
      [&](std::int64_t unit) {
        const int row = static_cast<int>(unit);
        std::vector<float> exitance(channels * Band(grid, row).Pixels(grid), 0.0F);
        for (int column = 0; column < illumination.width; ++column) {
          AddPixel(scene, column, row, exitance);
        }
        return exitance;
      },
      [&](std::int64_t row, std::span<const float> exitance) {
        const Band band(grid, static_cast<int>(row));
        for (std::size_t c = 0; c < channels; ++c) {
          float* to = photo.exitance.Channel(c) +
                      static_cast<std::ptrdiff_t>(band.first) * grid.points_x;
          for (std::size_t k = 0; k < band.Pixels(grid); ++k) {
            to[k] += exitance[c * band.Pixels(grid) + k];
          }
        }
        Report(progress, {"photo", row + 1, illumination.height, ""});
      });
  return photo;
}

ExrPart PhotographUnder(const Phantom& phantom,
                        Solver solver,
                        const ExrPart& illumination,
                        int thread_count,
                        const ProgressFunction& progress) {
  return PhotographUnder(phantom,
                         solver,
                         illumination,
                         SolverOptions{.thread_count = thread_count},
                         progress)
      .exitance;
}

}  // namespace nacre::rigs
