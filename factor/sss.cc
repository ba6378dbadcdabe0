// .sss, little endian: uint32 W, H, n, k; W · H records of n · 3 doubles, weights with
// the colours innermost, the lowest row of points first; then n · 3 doubles β,
// pixel⁻². A profile is Σ_h w_h (β_h/2π) exp(−β_h r²/2) [Song09, sec. 4].

#include "factor/sss.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/little_endian.h"
#include "core/provenance.h"
#include "reconstruct/rd_dataset.h"

#include <array>
#include <bit>
#include <cmath>
#include <fmt/format.h>
#include <string>

namespace nacre::factor {
namespace {

constexpr int kColours = 3;
constexpr std::size_t kHeaderBytes = 16;
constexpr std::uint32_t kMostGaussians = 64;

struct SssLayout {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t gaussians = 0;
  std::uint32_t core = 0;

  std::size_t RecordValues() const { return std::size_t{gaussians} * kColours; }
  std::size_t Points() const { return std::size_t{width} * height; }
  // In double: sizes of a hostile file overflow anything else.
  double FileBytes() const {
    return kHeaderBytes + 8.0 * kColours * static_cast<double>(gaussians) *
                              (static_cast<double>(width) * height + 1);
  }
};

class SssFile {
 public:
  explicit SssFile(const std::filesystem::path& path)
      : origin_(path.string()), bytes_(ReadFile(path)) {
    if (bytes_.size() < kHeaderBytes) {
      throw BadData(
          fmt::format("{}: not an sss file: {} bytes, shorter than its header of 16",
                      origin_,
                      bytes_.size()));
    }
    layout_ = {Word(0), Word(1), Word(2), Word(3)};
    CheckSizes();
  }

  const SssLayout& layout() const { return layout_; }
  const std::string& origin() const { return origin_; }

  // Value n after the header.
  double Value(std::size_t n) const {
    return std::bit_cast<double>(LoadLittle64(At(kHeaderBytes + 8 * n)));
  }

 private:
  const unsigned char* At(std::size_t byte) const {
    return static_cast<const unsigned char*>(
        static_cast<const void*>(bytes_.data() + byte));
  }
  std::uint32_t Word(std::size_t n) const { return LoadLittle32(At(4 * n)); }

  void CheckSizes() const {
    const auto require = [&](bool good, const char* name, std::uint32_t value) {
      if (!good) {
        throw BadData(
            fmt::format("{}: not an sss file: {} is {}", origin_, name, value));
      }
    };
    constexpr std::uint32_t kMost = 1000000;
    require(layout_.width >= 1 && layout_.width <= kMost, "W", layout_.width);
    require(layout_.height >= 1 && layout_.height <= kMost, "H", layout_.height);
    require(layout_.gaussians >= 1 && layout_.gaussians <= kMostGaussians,
            "the number of Gaussians (1 to 64)",
            layout_.gaussians);
    require(layout_.core % 2 == 1 && layout_.core <= 511,
            "the window's size (odd, up to 511)",
            layout_.core);
    if (layout_.FileBytes() != static_cast<double>(bytes_.size())) {
      throw BadData(fmt::format(
          "{}: {}: W x H = {} x {} and {} Gaussians need {:.0f} bytes, found {}",
          origin_,
          static_cast<double>(bytes_.size()) < layout_.FileBytes() ? "truncated"
                                                                   : "too long",
          layout_.width,
          layout_.height,
          layout_.gaussians,
          layout_.FileBytes(),
          bytes_.size()));
    }
  }

  std::string origin_;
  std::string bytes_;
  SssLayout layout_;
};

[[noreturn]] void Refuse(const SssFile& file,
                         const std::string& what,
                         std::size_t n,
                         const char* expected) {
  throw BadData(fmt::format("{}: {}, Gaussian {}, channel {} (byte {}) is {}, {}",
                            file.origin(),
                            what,
                            n / kColours % file.layout().gaussians,
                            "RGB"[n % kColours],
                            kHeaderBytes + 8 * n,
                            file.Value(n),
                            expected));
}

Material EmptyProfiles(const SssLayout& layout, const SssOptions& options) {
  Material m;
  m.points_x = static_cast<int>(layout.width);
  m.points_y = static_cast<int>(layout.height);
  m.core = static_cast<int>(layout.core);
  m.pitch_mm = options.pitch_mm;
  m.eta = options.eta;
  m.channels = {"R", "G", "B"};
  m.method = "profiles";
  m.form = Form::kProfiles;
  m.terms = static_cast<int>(layout.gaussians);
  m.a.assign(kColours, 1);
  m.b.assign(kColours, 1);
  m.cluster.assign(layout.Points(), 0);
  m.row_scale.assign(kColours * layout.Points(), 1.0F);
  m.albedo.assign(kColours * layout.Points(), 0.0F);
  m.f.assign(layout.RecordValues() * layout.Points(), 0.0F);
  return m;
}

// Of weight `n` of a record, its place in a map set, given the record's place.
std::size_t MapIndex(const Material& m, std::size_t n, std::size_t i, std::size_t row) {
  const std::size_t gaussian = n / kColours;
  const std::size_t set = m.SharesMaps() ? 0 : n % kColours;
  const auto y = static_cast<std::size_t>(m.points_y) - 1 - row;  // lowest row first
  const auto width = static_cast<std::size_t>(m.MapWidth());
  const auto margin = static_cast<std::size_t>(m.margin);
  return (set * static_cast<std::size_t>(m.terms) + gaussian) *
             static_cast<std::size_t>(m.MapSize()) +
         (y + margin) * width + i + margin;
}

void SetAlbedo(Material& m) {
  std::vector<float> window(static_cast<std::size_t>(m.WindowSize()));
  for (int c = 0; c < kColours; ++c) {
    for (std::int64_t point = 0; point < m.PointCount(); ++point) {
      m.EvaluateWindow(c,
                       static_cast<int>(point % m.points_x),
                       static_cast<int>(point / m.points_x),
                       window.data());
      double total = 0;
      for (const float value : window) {
        total += static_cast<double>(value);
      }
      m.albedo[static_cast<std::size_t>(c * m.PointCount() + point)] =
          static_cast<float>(total * m.pitch_mm * m.pitch_mm);
    }
  }
}

// Cells of a window that lie on the grid are valid; returns how many don't.
std::int64_t MarkInside(const reconstruct::RdHeader& header,
                        int i,
                        int j,
                        std::uint8_t* valid) {
  std::int64_t invalid = 0;
  const int radius = header.Radius();
  for (int v = -radius; v <= radius; ++v) {
    for (int u = -radius; u <= radius; ++u) {
      const bool known = i + u >= 0 && i + u < header.points_x && j + v >= 0 &&
                         j + v < header.points_y;
      *valid++ = known ? 1 : 0;
      invalid += known ? 0 : 1;
    }
  }
  return invalid;
}

}  // namespace

Material ReadSss(const std::filesystem::path& path, const SssOptions& options) {
  if (!(options.pitch_mm > 0) || !(options.eta >= 1) || !(options.scale > 0)) {
    throw UsageError(fmt::format(
        "{}: pitch_mm {}, eta {} and scale {} must be positive, eta 1 or more",
        path.string(),
        options.pitch_mm,
        options.eta,
        options.scale));
  }
  const SssFile file(path);
  const SssLayout& layout = file.layout();
  Material m = EmptyProfiles(layout, options);
  const std::size_t record = layout.RecordValues();
  for (std::size_t point = 0; point < layout.Points(); ++point) {
    const std::size_t i = point % layout.width;
    const std::size_t row = point / layout.width;
    for (std::size_t n = 0; n < record; ++n) {
      const double weight = file.Value(point * record + n) * options.scale;
      if (!(weight >= 0 && weight <= 1e30)) {
        Refuse(file,
               fmt::format("the weight of x = {}, y = {}", i, row),
               point * record + n,
               "no finite number from 0 on");
      }
      m.f[MapIndex(m, n, i, row)] = static_cast<float>(weight);
    }
  }
  m.h.resize(record);
  for (std::size_t n = 0; n < record; ++n) {
    const std::size_t at = layout.Points() * record + n;
    const double beta = file.Value(at);
    if (!(beta >= 1e-12 && beta <= 1e12)) {
      Refuse(file, "beta", at, "not within 1e-12 and 1e12 per square pixel");
    }
    m.h[n % kColours * layout.gaussians + n / kColours] =
        static_cast<float>(std::log(beta / (options.pitch_mm * options.pitch_mm)));
  }
  SetAlbedo(m);
  Provenance provenance{.command = "import", .options = {}};
  provenance.options["from"] = "sss";
  provenance.options["pitch_mm"] = options.pitch_mm;
  provenance.options["eta"] = options.eta;
  provenance.options["scale"] = options.scale;
  provenance.AddInput(path);
  m.provenance = provenance.ToString();
  Validate(m, path.string());
  return m;
}

std::int64_t WriteSss(const std::filesystem::path& path, const Material& m) {
  Validate(m, path.string());
  if (m.form != Form::kProfiles || m.channels.size() != kColours) {
    throw UsageError(fmt::format(
        "{}: sss holds Gaussian profiles of three channels, this material is '{}' of "
        "{}; 'nacre factor --method profiles' makes them",
        path.string(),
        Name(m.form),
        m.channels.size()));
  }
  const SssLayout layout{static_cast<std::uint32_t>(m.points_x),
                         static_cast<std::uint32_t>(m.points_y),
                         static_cast<std::uint32_t>(m.terms),
                         static_cast<std::uint32_t>(m.core)};
  const std::size_t record = layout.RecordValues();
  std::string bytes(static_cast<std::size_t>(layout.FileBytes()), '\0');
  auto* out = static_cast<unsigned char*>(static_cast<void*>(bytes.data()));
  const std::array<std::uint32_t, 4> head{
      layout.width, layout.height, layout.gaussians, layout.core};
  for (std::size_t n = 0; n < head.size(); ++n) {
    StoreLittle32(head[n], out + 4 * n);
  }
  out += kHeaderBytes;
  const auto put = [&](double value) {
    StoreLittle64(std::bit_cast<std::uint64_t>(value), out);
    out += 8;
  };
  for (std::size_t point = 0; point < layout.Points(); ++point) {
    for (std::size_t n = 0; n < record; ++n) {
      put(static_cast<double>(
          m.f[MapIndex(m, n, point % layout.width, point / layout.width)]));
    }
  }
  for (std::size_t n = 0; n < record; ++n) {
    const std::size_t set = m.SharesKernels() ? 0 : n % kColours;
    const float log_beta = m.h[set * layout.gaussians + n / kColours];
    put(std::exp(static_cast<double>(log_beta)) * m.pitch_mm * m.pitch_mm);
  }
  WriteFile(path, bytes);
  return static_cast<std::int64_t>(bytes.size());
}

std::int64_t WriteSlices(const std::filesystem::path& path,
                         const Material& m,
                         const ProgressFunction& progress) {
  reconstruct::RdHeader header;
  header.points_x = m.points_x;
  header.points_y = m.points_y;
  header.core = m.core;
  header.pitch_mm = m.pitch_mm;
  header.eta = m.eta;
  header.channels = m.channels;
  header.provenance = m.provenance;
  reconstruct::Validate(header, path.string());
  reconstruct::RdWriter writer(path, header);
  reconstruct::RdSlice slice = reconstruct::MakeSlice(header);
  std::int64_t invalid = 0;
  for (int j = 0; j < header.points_y; ++j) {
    Report(progress, {"slices", j, header.points_y, ""});
    for (int i = 0; i < header.points_x; ++i) {
      std::size_t at = 0;
      for (int c = 0; c < static_cast<int>(m.channels.size()); ++c) {
        m.EvaluateWindow(c, i, j, &slice.rd[at]);
        invalid += MarkInside(header, i, j, &slice.valid[at]);
        at += static_cast<std::size_t>(header.WindowSize());
      }
      writer.WriteSlice(i, j, slice);
    }
  }
  writer.Finish();
  Report(progress, {"slices", header.points_y, header.points_y, ""});
  return invalid;
}

}  // namespace nacre::factor
