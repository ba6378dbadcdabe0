#pragma once

#include "rigs/transport/diffusion/mesh.h"

#include <cstddef>
#include <vector>

namespace nacre::rigs::diffusion {

/// What a mesh's columns are made of, the same at every depth. Row-major, y slow, both
/// in the order of the axes' edges.
struct LateralField {
  std::vector<double> sigma_a_per_mm;      ///< nx · ny, mean of each column
  std::vector<double> diffusion_mm;        ///< nx · ny, for fluxes along z
  std::vector<double> east_diffusion_mm;   ///< nx · ny, face to the next column in x
  std::vector<double> north_diffusion_mm;  ///< nx · ny, face to the next column in y
  std::vector<double> side_decay_per_mm;   ///< nx · ny, used at the mesh's sides only
};

/// What happens at the faces of the slab.
struct FaceConditions {
  /// φ = 2 A D ∂φ/∂n; 0 makes φ = 0 there, infinity lets nothing out.
  double top_factor = 1;
  double bottom_factor = 1;
};

/// −∇·(D∇φ) + σ_a φ integrated over the cells, a symmetric M-matrix: conductances
/// between neighbouring cells, from the cells to the outside, and absorption. Side
/// faces of the mesh let out what falls as exp(−side_decay · distance).
///
/// Depth-invariant media factor: a conductance is a column's number times a layer's.
struct SlabOperator {
  int nx = 0;
  int ny = 0;
  int nz = 0;
  std::vector<double> layer_mm;  ///< nz: thickness
  std::vector<double>
      inverse_mm;  ///< nz: 1 / distance to the next layer's centre; last 0
  std::vector<double> area_mm2;    ///< a column each, as all below
  std::vector<double> absorption;  ///< σ_a · area: times layer_mm
  std::vector<double> east;        ///< times layer_mm; 0 in the last column
  std::vector<double> north;
  std::vector<double> side;      ///< to beyond the mesh's sides: times layer_mm
  std::vector<double> vertical;  ///< D · area: times inverse_mm
  std::vector<double> top;       ///< from the first layer's centre to the outside
  std::vector<double> bottom;

  std::size_t ColumnCount() const { return area_mm2.size(); }
  double Diagonal(std::size_t column, int layer) const;
};

SlabOperator Assemble(const Mesh& mesh,
                      const LateralField& field,
                      const FaceConditions& faces);

/// The operator on columns twice as wide and deep, the layers as they are: conductances
/// in parallel add, in series halve.
SlabOperator Coarsen(const SlabOperator& fine);

}  // namespace nacre::rigs::diffusion
