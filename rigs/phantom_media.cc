#include "rigs/phantom_media.h"

#include "rigs/media.h"
#include "rigs/media_skin.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>
#include <set>

namespace nacre::rigs {
namespace {

constexpr double kPerMmMax = 1e6;
constexpr double kMostForward = 0.999;
constexpr std::array kRgb = {"R", "G", "B"};

// As the file names them, else R, G, B for three and c1, c2, … for other counts, which
// is that of the longest list. Named media and skin have R, G, B.
std::vector<std::string> ReadChannels(const TomlTable& root,
                                      const std::vector<TomlTable>& media) {
  std::vector<std::string> channels = root.Texts("channels", {});
  if (root.Has("channels")) {
    const std::set<std::string> distinct(channels.begin(), channels.end());
    if (channels.empty() || distinct.size() != channels.size() ||
        distinct.contains("")) {
      throw root.At("channels", "expected different, non-empty names");
    }
    return channels;
  }
  std::size_t count = media.empty() ? kRgb.size() : 1;
  for (const TomlTable& medium : media) {
    if (medium.Has("preset")) {
      count = std::max(count, kRgb.size());
    }
    for (const char* key :
         {"sigma_a_per_mm", "sigma_s_per_mm", "reduced_sigma_s_per_mm"}) {
      if (medium.Has(key)) {
        count = std::max(count, medium.Numbers(key).size());
      }
    }
  }
  if (count == kRgb.size()) {
    return {kRgb.begin(), kRgb.end()};
  }
  for (std::size_t c = 0; c < count; ++c) {
    channels.push_back(fmt::format("c{}", c + 1));
  }
  return channels;
}

// σ_s for a medium whose σ_s' and g are known.
void SetReducedScattering(std::vector<double> reduced, Medium& medium) {
  medium.sigma_s_per_mm = std::move(reduced);
  for (std::size_t c = 0; c < medium.sigma_s_per_mm.size(); ++c) {
    medium.sigma_s_per_mm[c] /= 1 - medium.g[c];
  }
}

Medium FromPreset(const TomlTable& table,
                  const std::string& key,
                  const NamedMedium& preset,
                  const std::vector<std::string>& channels,
                  std::vector<double> g) {
  Medium medium{.name = std::string(preset.name),
                .sigma_a_per_mm = {},
                .sigma_s_per_mm = {},
                .g = std::move(g)};
  std::vector<double> reduced;
  for (const std::string& channel : channels) {
    const auto at = std::find(kRgb.begin(), kRgb.end(), channel);
    if (at == kRgb.end()) {
      throw table.At(key,
                     fmt::format("'{}' was measured in R, G and B, but the phantom has "
                                 "a channel '{}'",
                                 preset.name,
                                 channel));
    }
    const auto index = static_cast<std::size_t>(at - kRgb.begin());
    medium.sigma_a_per_mm.push_back(preset.sigma_a_per_mm[index]);
    reduced.push_back(preset.reduced_sigma_s_per_mm[index]);
  }
  SetReducedScattering(std::move(reduced), medium);
  return medium;
}

const NamedMedium& FindPreset(const TomlTable& table,
                              const std::string& key,
                              const std::string& name) {
  const NamedMedium* const preset = FindNamedMedium(name);
  if (preset == nullptr) {
    throw table.At(
        key, fmt::format("'{}' is not known; known are: {}", name, NamedMediaList()));
  }
  return *preset;
}

Medium ReadMedium(const TomlTable& table,
                  const std::vector<std::string>& channels,
                  std::vector<double>& etas) {
  const Range coefficient{0, kPerMmMax};
  const auto per_channel = [&](const std::string& key, std::vector<double> values) {
    return PerChannel(table, key, std::move(values), channels.size());
  };
  std::vector<double> g =
      per_channel("g", table.Numbers("g", {0.0}, Range{-kMostForward, kMostForward}));
  Medium medium;
  if (table.Has("preset")) {
    const NamedMedium& preset = FindPreset(table, "preset", table.Text("preset"));
    medium = FromPreset(table, "preset", preset, channels, std::move(g));
    medium.name = table.Text("name", medium.name);
    etas.push_back(preset.eta);
    table.RejectUnknownKeys();
    return medium;
  }
  medium.name = table.Text("name", "");
  medium.g = std::move(g);
  medium.sigma_a_per_mm =
      per_channel("sigma_a_per_mm", table.Numbers("sigma_a_per_mm", coefficient));
  if (table.Has("reduced_sigma_s_per_mm")) {
    if (table.Has("sigma_s_per_mm")) {
      throw table.At("reduced_sigma_s_per_mm",
                     "given beside sigma_s_per_mm; one of them is enough, the other "
                     "follows from g");
    }
    SetReducedScattering(
        per_channel("reduced_sigma_s_per_mm",
                    table.Numbers("reduced_sigma_s_per_mm", coefficient)),
        medium);
  } else {
    medium.sigma_s_per_mm =
        per_channel("sigma_s_per_mm", table.Numbers("sigma_s_per_mm", coefficient));
  }
  table.RejectUnknownKeys();
  return medium;
}

// Typical lines of red, green and blue lasers or filters.
std::vector<double> SkinWavelengths(const TomlTable& table,
                                    const std::vector<std::string>& channels) {
  const std::vector<double> rgb = {640, 540, 460};
  const std::string key = "wavelengths_nm";
  if (!table.Has(key) &&
      !std::equal(channels.begin(), channels.end(), kRgb.begin(), kRgb.end())) {
    throw table.At(key, "missing: the wavelength of each channel");
  }
  std::vector<double> wavelengths = table.Numbers(key, rgb, kSkinWavelengthsNm);
  if (wavelengths.size() != channels.size()) {
    throw table.At(
        key,
        fmt::format("{} values for {} channels", wavelengths.size(), channels.size()));
  }
  return wavelengths;
}

void ReadSkin(const TomlTable& table, PhantomMedia& result) {
  SkinModel skin;
  SkinModel::Visit(skin,
                   [&](const char* name, double& value, Range range, const char*) {
                     value = table.Number(name, value, range);
                   });
  const std::vector<double> wavelengths = SkinWavelengths(table, result.channels);
  table.RejectUnknownKeys();
  const std::vector<double> g(result.channels.size(), skin.g);
  Medium epidermis{
      .name = "epidermis", .sigma_a_per_mm = {}, .sigma_s_per_mm = {}, .g = g};
  Medium dermis{.name = "dermis", .sigma_a_per_mm = {}, .sigma_s_per_mm = {}, .g = g};
  std::vector<double> epidermis_scattering;
  std::vector<double> dermis_scattering;
  for (const double wavelength_nm : wavelengths) {
    epidermis.sigma_a_per_mm.push_back(EpidermisAbsorption(skin, wavelength_nm));
    dermis.sigma_a_per_mm.push_back(DermisAbsorption(skin, wavelength_nm));
    epidermis_scattering.push_back(EpidermisReducedScattering(wavelength_nm));
    dermis_scattering.push_back(DermisReducedScattering(wavelength_nm));
  }
  SetReducedScattering(epidermis_scattering, epidermis);
  SetReducedScattering(dermis_scattering, dermis);
  result.media = {epidermis, dermis};
  result.layers = {
      {.thickness_mm = skin.epidermis_mm, .eta = skin.epidermis_eta, .medium = 0},
      {.thickness_mm = std::numeric_limits<double>::infinity(),
       .eta = skin.dermis_eta,
       .medium = 1}};
}

// medium = "marble" or medium = ["marble", "skin2"].
void ReadNamedMedia(const TomlTable& root, PhantomMedia& result) {
  constexpr std::size_t kMostMedia = 4096;
  std::vector<double> etas;
  const std::vector<std::string> names = root.Texts("medium", {});
  if (names.empty() || names.size() > kMostMedia) {
    throw root.At("medium", "missing: what the slab is made of, [[medium]]");
  }
  for (const std::string& name : names) {
    const NamedMedium& preset = FindPreset(root, "medium", name);
    result.media.push_back(FromPreset(root,
                                      "medium",
                                      preset,
                                      result.channels,
                                      std::vector<double>(result.channels.size(), 0)));
    etas.push_back(preset.eta);
  }
  if (std::equal(etas.begin() + 1, etas.end(), etas.begin())) {
    result.eta = etas.front();
  }
}

}  // namespace

std::vector<double> PerChannel(const TomlTable& table,
                               const std::string& key,
                               std::vector<double> values,
                               std::size_t channels) {
  if (values.size() == 1) {
    values.resize(channels, values.front());
  }
  if (values.size() != channels) {
    throw table.At(key,
                   fmt::format("{} values for {} channels", values.size(), channels));
  }
  return values;
}

PhantomMedia ReadPhantomMedia(const TomlTable& root) {
  PhantomMedia result;
  if (const auto skin = root.FindTable("skin")) {
    if (root.Has("medium")) {
      throw root.At("medium", "given beside [skin], which has media of its own");
    }
    result.channels = ReadChannels(root, {});
    ReadSkin(*skin, result);
    return result;
  }
  if (!root.Has("medium")) {
    throw root.At("medium", "missing: what the slab is made of, [[medium]]");
  }
  if (!root.HasTables("medium")) {
    result.channels = ReadChannels(root, {});
    ReadNamedMedia(root, result);
    return result;
  }
  const std::vector<TomlTable> media = root.Tables("medium");
  result.channels = ReadChannels(root, media);
  std::vector<double> etas;
  for (const TomlTable& medium : media) {
    result.media.push_back(ReadMedium(medium, result.channels, etas));
  }
  if (etas.size() == result.media.size() &&
      std::equal(etas.begin() + 1, etas.end(), etas.begin())) {
    result.eta = etas.front();
  }
  return result;
}

}  // namespace nacre::rigs
