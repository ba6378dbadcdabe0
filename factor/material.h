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

/// A factored dataset: R'_d(x_i, d) of channel c is
///   row_scale_c(x_i) · max(0, T_c(Σ_j f_cj(x_i) h_ckj(d))),  k = cluster(x_i).
/// Indices, units and orientation are those of reconstruct::RdHeader.
struct Material {
  int points_x = 0;
  int points_y = 0;
  int core = 0;
  double pitch_mm = 0;
  double eta = 1;
  std::vector<std::string> channels;
  std::string method;  ///< "log-svd", "svd", …
  Transform transform = Transform::kLinear;
  int terms = 0;
  int cluster_count = 1;

  std::vector<double> a;              ///< A a channel (kLog)
  std::vector<double> b;              ///< B a channel (kLog)
  std::vector<float> f;               ///< [channel][term][j][i]
  std::vector<float> h;               ///< [channel][cluster][term][v][u]
  std::vector<std::uint8_t> cluster;  ///< [j][i], all 0 without clustering
  std::vector<float> row_scale;  ///< [channel][j][i]; makes each slice's total exact
  std::vector<float> albedo;  ///< [channel][j][i]: Σ_d R_d · pitch², dimensionless
  std::map<std::string, double>
      error;  ///< of the fit: "relative_l2", "rmse_over_mean", …
  std::vector<TermsError> error_curve;  ///< what fewer terms would have given
  std::string provenance;               ///< JSON text

  std::int64_t PointCount() const { return std::int64_t{points_x} * points_y; }
  std::int64_t WindowSize() const { return std::int64_t{core} * core; }
  const float* FactorMap(int channel, int term) const {
    return &f[static_cast<std::size_t>((std::int64_t{channel} * terms + term) *
                                       PointCount())];
  }
  const float* Kernel(int channel, int cluster_index, int term) const {
    return &h[static_cast<std::size_t>(
        ((std::int64_t{channel} * cluster_count + cluster_index) * terms + term) *
        WindowSize())];
  }

  /// R'_d in mm⁻² at grid point (i, j) and window cell (u, v). The simple version.
  float Evaluate(int channel, int i, int j, int u, int v) const;
  /// The whole window of one point and channel, core × core values, into `window`.
  void EvaluateWindow(int channel, int i, int j, float* window) const;
  /// The same with the first `term_count` terms only and without row_scale.
  void EvaluateTerms(int channel, int i, int j, int term_count, float* window) const;
  /// Bytes of f, h, cluster map and row_scale as they are held.
  std::int64_t StorageBytes() const;
};

/// Throws BadData naming `origin` and the field unless every size fits, every number is
/// finite and in its range.
void Validate(const Material& material, const std::string& origin);

/// `*.nacre.exr`: multi-part OpenEXR (factor maps, kernels, cluster, albedo, row scale,
/// with everything else in attributes). Atomic; reading checks every size and value.
void WriteMaterial(const std::filesystem::path& path, const Material& material);
Material ReadMaterial(const std::filesystem::path& path);

}  // namespace nacre::factor
