#include "render/subsurface/window_source.h"

#include "core/error.h"
#include "reconstruct/rd_dataset.h"
#include "render/subsurface/material_windows.h"
#include "render/subsurface/models.h"
#include "tests/render/scene_text.h"
#include "tests/render/subsurface/handmade_material.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>

namespace nacre::render::testing {
namespace {

std::shared_ptr<const factor::Material> SmallMaterial() {
  return DipoleMaterial({DipoleProfile(0.05, 1, 0.6),
                         DipoleProfile(0.02, 2, 0.6),
                         DipoleProfile(0.01, 2, 0.6)},
                        {.points = 8, .core = 9, .pitch_mm = 0.5});
}

// The windows of a material as a dataset.
std::filesystem::path WriteWindows(const factor::Material& m,
                                   const std::filesystem::path& path) {
  reconstruct::RdHeader header;
  header.points_x = m.points_x;
  header.points_y = m.points_y;
  header.core = m.core;
  header.pitch_mm = m.pitch_mm;
  header.eta = m.eta;
  header.channels = m.channels;
  header.provenance = "{}";
  reconstruct::RdWriter writer(path, header);
  for (int j = 0; j < m.points_y; ++j) {
    for (int i = 0; i < m.points_x; ++i) {
      reconstruct::RdSlice slice = reconstruct::MakeSlice(header);
      for (int c = 0; c < 3; ++c) {
        m.EvaluateWindow(
            c, i, j, &slice.rd[static_cast<std::size_t>(c * header.WindowSize())]);
      }
      writer.WriteSlice(i, j, slice);
    }
  }
  writer.Finish();
  return path;
}

TEST(WindowSourceTest, ADatasetIsRenderedAsTheMaterialThatSaysTheSame) {
  const nacre::testing::TempFolder folder;
  const auto material = SmallMaterial();
  const auto path = WriteWindows(*material, folder.path() / "sample.rd.exr");
  const auto dataset = OpenDatasetSource(path);
  const auto factored = MakeMaterialSource(material);
  EXPECT_EQ(dataset->tiles_total(), 64);
  EXPECT_EQ(dataset->tiles_read(), 0);
  for (int c = 0; c < 3; ++c) {
    for (const int u : {0, 4, 8}) {
      EXPECT_EQ(dataset->Evaluate(c, 3, 5, u, 4), factored->Evaluate(c, 3, 5, u, 4));
    }
    EXPECT_NEAR(dataset->Albedo(c, 3, 5), factored->Albedo(c, 3, 5), 1e-6F);
  }
  EXPECT_EQ(dataset->tiles_read(), 1);

  const auto by_dataset = MakeMeasured(dataset);
  const auto by_material = MakeFactored(material);
  SurfacePoint x_i{};
  x_i.normal = {0, 0, 1};
  x_i.tangent_u = {1, 0, 0};
  x_i.tangent_v = {0, 1, 0};
  x_i.uv = {0.4F, 0.6F};
  SurfacePoint x_o = x_i;
  x_o.position_mm = {0.7F, 0.3F, 0};
  EXPECT_EQ(by_dataset->Rd(x_i, x_o), by_material->Rd(x_i, x_o));
  EXPECT_LT(by_dataset->Use().tiles, 8);
}

TEST(WindowSourceTest, AScenesMaterialMayBeADataset) {
  const nacre::testing::TempFolder folder;
  const auto path = WriteWindows(*SmallMaterial(), folder.path() / "sample.rd.exr");
  const Scene scene = Parse(SceneText(R"(
    <emitter type="directional"><vector name="direction" x="0" y="0" z="-1"/></emitter>
    <shape type="rectangle"><subsurface type="svd">
      <string name="material" value=")" +
                                      path.string() + R"("/></subsurface></shape>)"));
  RenderOptions options;
  options.spp = 4;
  const Rendering r = Render(scene, options);
  EXPECT_GT(ChannelStatistics(r.image, 1).mean, 0.05);
  EXPECT_GT(r.summary.use.tiles, 1);
  EXPECT_EQ(r.summary.use.tiles_total, 64);
  EXPECT_EQ(r.summary.use.channels, 3);
}

Scene UnderLight(const std::filesystem::path& material, const std::string& colour) {
  return Parse(SceneText(R"(<emitter type="directional">
      <vector name="direction" x="0" y="0" z="-1"/><rgb name="irradiance" value=")" +
                         colour + R"("/></emitter>
    <shape type="rectangle"><subsurface type="svd"><string name="material" value=")" +
                         material.string() + R"("/></subsurface></shape>)"));
}

TEST(WindowSourceTest, ChannelsAreReadWhenThereIsLightOfTheirColour) {
  const nacre::testing::TempFolder folder;
  factor::Material material = *SmallMaterial();
  const auto coloured = folder / "coloured.nacre.exr";
  factor::WriteMaterial(coloured, material);
  const RenderOptions options{.spp = 4, .thread_count = 1};
  const Rendering white = Render(UnderLight(coloured, "1"), options);
  EXPECT_EQ(white.summary.use.channels, 3);
  EXPECT_EQ(white.summary.use.terms, 3);
  const Rendering green = Render(UnderLight(coloured, "0 1 0"), options);
  EXPECT_EQ(green.summary.use.channels, 1);
  EXPECT_EQ(green.summary.use.terms, 1);
  EXPECT_EQ(green.summary.use.terms_total, 3);
  EXPECT_GT(green.summary.use.windows, 0);
  for (std::size_t i = 0; i < white.image.PixelCount(); ++i) {
    EXPECT_NEAR(green.image.Channel(1)[i], white.image.Channel(1)[i], 1e-4F);
    EXPECT_EQ(green.image.Channel(0)[i], 0);
  }

  // A grey sample has one channel to read, whatever the light.
  factor::Material grey = OneTermMaterial({8, 9, 0.5}, 1);
  std::fill(grey.h.begin(), grey.h.end(), 0.01F);
  SetAlbedo(grey);
  const auto one = folder / "grey.nacre.exr";
  factor::WriteMaterial(one, grey);
  const Rendering r = Render(UnderLight(one, "1 0.5 0.2"), options);
  EXPECT_EQ(r.summary.use.channels, 1);
  EXPECT_NEAR(ChannelStatistics(r.image, 1).mean,
              0.5 * ChannelStatistics(r.image, 0).mean,
              1e-5);
}

// Kernels of ever smaller size, in each of the ways that a sum becomes R_d.
TEST(WindowSourceTest, TermsThatBringLittleAreLeftOut) {
  const nacre::testing::TempFolder folder;
  constexpr int kTerms = 6;
  for (const auto transform : {factor::Transform::kLinear,
                               factor::Transform::kSqrt,
                               factor::Transform::kLog}) {
    factor::Material m = OneTermMaterial({4, 5, 1.0}, 1);
    m.transform = transform;
    m.terms = kTerms;
    m.b = {0.01};
    m.f.clear();
    m.h.clear();
    for (int t = 0; t < kTerms; ++t) {
      for (int n = 0; n < 16; ++n) {
        m.f.push_back(t == 0 ? 1 : std::cos(static_cast<float>(n * t)));
      }
      for (int n = 0; n < 25; ++n) {
        m.h.push_back(std::pow(0.1F, static_cast<float>(t)) *
                      (t == 0 ? 0.3F : std::sin(static_cast<float>(n * t + 1))));
      }
    }
    SetAlbedo(m);
    const auto path = folder / "terms.nacre.exr";
    factor::WriteMaterial(path, m);
    const auto all = OpenMaterialSource(path);
    double largest = 0;
    for (int n = 0; n < 16; ++n) {
      largest =
          std::max(largest, static_cast<double>(all->Evaluate(0, n % 4, n / 4, 2, 2)));
    }
    EXPECT_EQ(all->terms_used(), kTerms);
    int before = kTerms + 1;
    for (const double error : {1e-6, 1e-3, 0.3}) {
      const auto fewer = OpenMaterialSource(path, error);
      double worst = 0;
      for (int n = 0; n < 16 * 25; ++n) {
        const int i = n % 4;
        const int j = n / 4 % 4;
        const int u = n / 16 % 5;
        const int v = n / 80;
        worst = std::max(worst,
                         std::abs(static_cast<double>(fewer->Evaluate(0, i, j, u, v) -
                                                      all->Evaluate(0, i, j, u, v))));
      }
      EXPECT_LE(worst, error * largest * 1.0001) << factor::Name(transform) << error;
      EXPECT_LT(fewer->terms_used(), before);
      before = fewer->terms_used();
    }
    EXPECT_LT(before, 3);
  }
}

TEST(MakeFactored, TakesOneOrThreeChannels) {
  factor::Material grey = OneTermMaterial({2, 3, 1.0}, 1);
  std::fill(grey.h.begin(), grey.h.end(), 0.1F);
  SetAlbedo(grey);
  const MaterialWindows windows(
      MakeMaterialSource(std::make_shared<const factor::Material>(grey)), 1);
  const ColorLanes rd = windows.At(0, 1, 1, 0);
  EXPECT_GT(rd.v[0], 0);
  EXPECT_TRUE(rd.v[0] == rd.v[1] && rd.v[1] == rd.v[2]);

  factor::Material four = OneTermMaterial({2, 3, 1.0}, 4);
  SetAlbedo(four);
  EXPECT_THAT(
      [&] { MakeFactored(std::make_shared<const factor::Material>(four)); },
      ::testing::ThrowsMessage<Error>(::testing::HasSubstr("4 channels (R, G, B, R)")));
}

TEST(MakeFactored, ChannelsAreFoundByName) {
  factor::Material m = OneTermMaterial({2, 3, 1.0}, 3);
  m.channels = {"B", "G", "R"};
  for (std::size_t n = 0; n < m.h.size(); ++n) {
    m.h[n] = 0.01F * static_cast<float>(1 + n / 9);  // B 1, G 2, R 3
  }
  SetAlbedo(m);
  const MaterialWindows windows(
      MakeMaterialSource(std::make_shared<const factor::Material>(m)), 1);
  const Color c = windows.Albedo(0);
  EXPECT_NEAR(c.x / c.z, 3, 1e-4);
  EXPECT_NEAR(c.y / c.z, 2, 1e-4);
}

}  // namespace
}  // namespace nacre::render::testing
