#pragma once

#include <Eigen/Core>

#include <cstddef>

namespace nacre::factor::internal {

/// Maps f_j(x_i) that all channels share: a row a map, a column a point of the grid and
/// of the margin around it, row by row.
using SharedMaps =
    Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Gives the points of a margin the value of the grid's nearest point. `width` and
/// `height` count the margins.
void ExtendMaps(int width, int height, int margin, SharedMaps& maps);

/// Σ a · b, added up in the order of points.
double Dot(const SharedMaps& a, const SharedMaps& b);

/// to += a · b for n values.
void AddScaled(float* __restrict to, const float* __restrict a, float b, std::size_t n);

/// to += a · b, value by value, for n of them.
void AddProduct(float* __restrict to,
                const float* __restrict a,
                const float* __restrict b,
                std::size_t n);

}  // namespace nacre::factor::internal
