// A flat captured slab under a new light, rendered, against the photograph of the rig
// that it was captured with:
//
//   relight RENDERED.exr PHOTO.exr [--eta E] [--scale S]
//
// RENDERED is seen along the normal, so that its radiance is M F_t(η, 0) / (π c(η));
// PHOTO has the exitance M (`nacre simulate --photo`). Prints the relative L2
// difference of each channel and of all. --scale multiplies the rendered picture.

#include "core/error.h"
#include "core/exr.h"
#include "core/fresnel.h"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "bench/render/scene_tool.h"

namespace nacre {
namespace {

void Run(const std::string& rendered,
         const std::string& photo,
         double eta,
         double scale) {
  const ExrPart a = ReadExr(rendered).front();
  const ExrPart b = ReadExr(photo).front();
  if (a.width != b.width || a.height != b.height || a.channels != b.channels) {
    throw BadData(rendered + " and " + photo + " are of different size or channels");
  }
  scale *= std::numbers::pi * ExitNormalization(eta) / FresnelTransmittance(1, eta);
  double all_difference2 = 0;
  double all_sum2 = 0;
  for (std::size_t c = 0; c < a.channels.size(); ++c) {
    double difference2 = 0;
    double sum2 = 0;
    for (std::size_t i = 0; i < a.PixelCount(); ++i) {
      const double truth = static_cast<double>(b.Channel(c)[i]);
      const double difference = scale * static_cast<double>(a.Channel(c)[i]) - truth;
      difference2 += difference * difference;
      sum2 += truth * truth;
    }
    std::printf(
        "%s %.2f %%\n", a.channels[c].c_str(), 100 * std::sqrt(difference2 / sum2));
    all_difference2 += difference2;
    all_sum2 += sum2;
  }
  std::printf("all %.2f %%\n", 100 * std::sqrt(all_difference2 / all_sum2));
}

}  // namespace
}  // namespace nacre

int main(int argc, char** argv) {
  std::string rendered;
  std::string photo;
  double eta = 1.5;
  double scale = 1;
  CLI::App app("a rendered slab against its photograph");
  app.add_option("rendered", rendered)->required();
  app.add_option("photo", photo)->required();
  app.add_option("--eta", eta);
  app.add_option("--scale", scale);
  return nacre::render::RunTool(
      app, argc, argv, [&] { nacre::Run(rendered, photo, eta, scale); });
}
