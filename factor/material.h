#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace nacre::factor {

/// How a sum of terms becomes R_d.
enum class Transform {
  kLinear,  ///< R_d = Σ_j f_j h_j
  kSqrt,    ///< R_d = s |s|, s = Σ_j f_j h_j
  kLog,     ///< R_d = A (exp(Σ_j f_j h_j) − B), the thesis' ln(R'_d/A + B) undone
};

const char* Name(Transform transform);

/// The error of the first `terms` terms alone, on a sample of the slices.
struct TermsError {
  int terms = 0;
  double relative_l2 = 0;
  double log_rms = 0;
  friend bool operator==(const TermsError&, const TermsError&) = default;
};

/// How maps f and kernels h make R_d.
enum class Form {
  kSum,         ///< Σ_j f_j(x_i) h_j(d), maps and kernels a channel
  kBilinear,    ///< Σ_jk f_j(x_i) h_jk(d) f_k(x_o), maps shared by all channels
  kReciprocal,  ///< A exp of a symmetric polynomial of the maps at both ends and in
                ///< between, maps shared by all channels
  kTucker,      ///< a polynomial in Σ_t f_t(x_i) h_t(shifted d), coefficients a point
  kProfiles,    ///< √(P(x_i) P(x_o)), P a sum of Gaussians with maps as weights
};

const char* Name(Form form);

/// What values are whole multiples of, so that a file holds small whole numbers. Empty
/// (and 0): any float.
struct Steps {
  std::vector<float> f;  ///< a map, in the order of Material::f
  std::vector<float> h;  ///< a channel (kTucker: one for all)
  float row_scale = 0;
  bool empty() const { return f.empty(); }
  friend bool operator==(const Steps&, const Steps&) = default;
};

/// A factored dataset. R'_d(x_i, d) of channel c is, for the five forms,
///   row_scale_c(x_i) · max(0, T_c(Σ_j f_cj(x_i) h_ckj(d))),  k = cluster(x_i),
///   max(0, Σ_jk f_j(x_i) h_cjk(d) f_k(x_o)),  h_cjk(d) = h_ckj(−d),  x_o = x_i + d.
///   row_scale_c(x_i) row_scale_c(x_o) A_c exp(h_c0(d) + Σ_j Σ_t h_cjt(d) φ_t[f_j]
///     + Σ_{j ≤ k} h_cjk(d) (f_j(x_i) f_k(x_o) + f_k(x_i) f_j(x_o))
///     + Σ_k v_ck(d) u_k(p)),  h(−d) = h(d),  v(−d) = v(d),
///   row_scale_c(x_i) max(0, Σ_{p ≤ P} a_cp(x_i) (Σ_t f_t(x_i) h_t(d − shift(x_i)))^p),
///   √(P_c(x_i) P_c(x_o)),  P_c(x) = Σ_t f_ct(x) β_ct/2π exp(−β_ct |d|²/2),
/// with taps φ_0[f] = f(x_i) + f(x_o), φ_1[f] = 2 f(middle), φ_2[f] the sum of f at the
/// quarters of the way, φ_3[f] half of that at its odd eighths, the exponent being cut
/// at ln 3; p is the point of the pair from which the other lies in the first half of
/// the window's cells; d − shift goes around the window's edges. Bilinear, reciprocal
/// and profiles are reciprocal to the last bit: R'_d(x_i, d) = R'_d(x_o, −d);
/// reciprocal is positive. That of a point lit alone, which is what a dataset holds, is
/// R_d times exp(g_c(d) (q(x_i) − q(x_o))) if the material has sides. Indices, units
/// and orientation are those of reconstruct::RdHeader.
struct Material {
  int points_x = 0;
  int points_y = 0;
  int core = 0;
  double pitch_mm = 0;
  double eta = 1;
  std::vector<std::string> channels;
  std::string method;  ///< the option of that name, as "log-svd"
  Form form = Form::kSum;
  Transform transform = Transform::kLinear;  ///< kBilinear: linear
  int terms = 0;
  int cluster_count = 1;
  int margin = 0;  ///< shared maps go on for so many points beyond the grid
  int taps = 1;    ///< 1 to 4 (kReciprocal)
  int order = 0;   ///< P, 0 to 8 (kTucker)
  int rest = 0;    ///< maps and kernels of pairs, after those of terms (kReciprocal)
  int sides = 0;   ///< 1: map q and kernels g are there, after the others (kReciprocal)

  /// All channels are the same, and share maps and kernels (not kTucker).
  bool is_grey = false;

  std::vector<double> a;  ///< A a channel (kLog, kReciprocal)
  std::vector<double> b;  ///< B a channel (kLog)
  /// [channel][term][j][i]; shared: [term][j][i], with margin on all sides; kTucker:
  /// f_t, then a_cp [channel][power], then the number of the cell that rows begin at.
  std::vector<float> f;
  /// [channel][cluster][term][v][u]; kBilinear: [channel][pair][v][u], pairs being
  /// (0, 0), (0, 1), …, (1, 1), (1, 2), …; kReciprocal: [channel][kernel][v][u], the
  /// constant, then [tap][term], then pairs, then v, of rows up to the middle one;
  /// kTucker: [term][v][u]; kProfiles: [channel][term], ln β, β in mm⁻².
  std::vector<float> h;
  std::vector<std::uint8_t> cluster;  ///< [j][i], all 0 without clustering
  std::vector<float> row_scale;  ///< [channel][j][i]; makes each slice's total exact
                                 ///< (kBilinear, kProfiles: 1 everywhere)
  std::vector<float> albedo;  ///< [channel][j][i]: Σ_d R_d · pitch², dimensionless
  Steps steps;
  std::map<std::string, double>
      error;  ///< of the fit: "relative_l2", "rmse_over_mean", …
  std::vector<TermsError> error_curve;  ///< what fewer terms would have given
  std::string provenance;               ///< JSON text

  std::int64_t PointCount() const { return std::int64_t{points_x} * points_y; }
  std::int64_t WindowSize() const { return std::int64_t{core} * core; }
  int MapWidth() const { return points_x + 2 * margin; }
  int MapHeight() const { return points_y + 2 * margin; }
  std::int64_t MapSize() const { return std::int64_t{MapWidth()} * MapHeight(); }
  /// Sets of factor maps: one a channel, or one for all.
  int MapSets() const { return SharesMaps() ? 1 : static_cast<int>(channels.size()); }
  bool SharesMaps() const {
    return is_grey || (form != Form::kSum && form != Form::kProfiles);
  }
  /// Maps of a set: one a term, but for kTucker.
  int MapCount() const {
    return form == Form::kTucker
               ? terms + static_cast<int>(channels.size()) * (order + 1) + 1
               : terms + rest + sides;
  }
  /// Sets of kernels: one a channel, or one for all.
  int KernelSets() const {
    return SharesKernels() ? 1 : static_cast<int>(channels.size());
  }
  bool SharesKernels() const { return is_grey || form == Form::kTucker; }
  /// Whether row_scale makes the totals of slices exact.
  bool KeepsTotals() const { return form == Form::kSum || form == Form::kTucker; }
  /// Kernels of a channel and cluster.
  int KernelCount() const;
  /// Values of a kernel: those of a window, or of its rows up to the middle one.
  std::int64_t KernelSize() const {
    return std::int64_t{KernelWidth()} *
           (form == Form::kReciprocal ? (core + 1) / 2 : KernelWidth());
  }
  int KernelWidth() const { return form == Form::kProfiles ? 1 : core; }
  const float* FactorMap(int channel, int term) const {
    const int set = MapSets() == 1 ? 0 : channel;
    return &f[static_cast<std::size_t>((std::int64_t{set} * MapCount() + term) *
                                       MapSize())];
  }
  const float* Kernel(int channel, int cluster_index, int n) const {
    const int set = KernelSets() == 1 ? 0 : channel;
    return &h[static_cast<std::size_t>(
        ((std::int64_t{set} * cluster_count + cluster_index) * KernelCount() + n) *
        KernelSize())];
  }

  /// R'_d in mm⁻² at grid point (i, j) and window cell (u, v). The simple version.
  float Evaluate(int channel, int i, int j, int u, int v) const;
  /// The whole window of one point and channel, core × core values, into `window`.
  void EvaluateWindow(int channel, int i, int j, float* window) const;
  /// The same without row_scale and, of a kSum, with the first `term_count` terms only.
  void EvaluateTerms(int channel, int i, int j, int term_count, float* window) const;
  /// Bytes of f, h, cluster map and row_scale as they are held in memory.
  std::int64_t StorageBytes() const;
};

/// A reciprocal material without its sides: R_d is the same number both ways.
Material WithoutSides(Material material);

/// Throws BadData naming `origin` and the field unless every size fits, every number is
/// finite and in its range.
void Validate(const Material& material, const std::string& origin);

/// `*.nacre.exr`: multi-part OpenEXR (factor maps, kernels, cluster, albedo, row scale,
/// with everything else in attributes). Atomic; reading checks every size and value.
void WriteMaterial(const std::filesystem::path& path, const Material& material);
Material ReadMaterial(const std::filesystem::path& path);

/// The size of the file that WriteMaterial would write.
std::int64_t FileBytes(const Material& material);

}  // namespace nacre::factor
