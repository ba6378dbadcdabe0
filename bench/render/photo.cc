// The photograph of a slab under a picture of light, out of its windows for each grid
// point:
//
//   photo WINDOWS.rd.exr LIGHT.exr PHOTO.exr
//
// M(x_o) = Σ F_t(η, 0) E(x_i) a² R_d(x_i, x_o) over the grid points x_i, of cells of
// side a. The windows are those of light all over a cell (`nacre simulate --out` of a
// phantom with a square beam of that width), and reach over the whole sample. That is
// what `nacre simulate --photo` says, which simulates each pixel instead of each place
// of the pattern that differs, as a dataset's simulation does.

#include "core/error.h"
#include "core/exr.h"
#include "core/fresnel.h"
#include "reconstruct/rd_dataset.h"

#include <algorithm>

#include "bench/render/scene_tool.h"

namespace nacre {
namespace {

// Adds what leaves because of the light on one cell.
void AddCell(const reconstruct::RdHeader& header,
             const reconstruct::RdSlice& slice,
             std::size_t channel,
             int i,
             int j,
             float flux,
             float* photo) {
  const int radius = header.core / 2;
  const float* window =
      &slice.rd[channel * static_cast<std::size_t>(header.WindowSize())];
  for (int v = std::max(0, radius - j);
       v < std::min(header.core, header.points_y + radius - j);
       ++v) {
    for (int u = std::max(0, radius - i);
         u < std::min(header.core, header.points_x + radius - i);
         ++u) {
      photo[(j + v - radius) * header.points_x + i + u - radius] +=
          flux * window[v * header.core + u];
    }
  }
}

void Run(const std::string& windows,
         const std::string& light_file,
         const std::string& out) {
  reconstruct::RdReader reader(windows);
  const reconstruct::RdHeader& header = reader.header();
  const ExrPart light = ReadExr(light_file).front();
  if (light.width != header.points_x || light.height != header.points_y ||
      light.channels != header.channels) {
    throw BadData(windows + " and " + light_file +
                  " are of different size or channels");
  }
  ExrPart photo = light;
  std::fill(photo.values.begin(), photo.values.end(), 0.0F);
  const auto entering = static_cast<float>(FresnelTransmittance(1, header.eta) *
                                           header.pitch_mm * header.pitch_mm);
  for (int j = 0; j < header.points_y; ++j) {
    for (int i = 0; i < header.points_x; ++i) {
      const reconstruct::RdSlice slice = reader.ReadSlice(i, j);
      for (std::size_t c = 0; c < header.channels.size(); ++c) {
        const float flux = entering * light.Channel(c)[j * header.points_x + i];
        AddCell(header, slice, c, i, j, flux, &photo.values[c * photo.PixelCount()]);
      }
    }
  }
  WriteExr(out, {photo});
}

}  // namespace
}  // namespace nacre

int main(int argc, char** argv) {
  std::string windows;
  std::string light;
  std::string out;
  CLI::App app("a slab's photograph out of its windows");
  app.add_option("windows", windows)->required();
  app.add_option("light", light)->required();
  app.add_option("photo", out)->required();
  return nacre::render::RunTool(
      app, argc, argv, [&] { nacre::Run(windows, light, out); });
}
