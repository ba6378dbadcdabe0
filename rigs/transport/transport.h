#pragma once

#include "rigs/pattern.h"
#include "rigs/phantom.h"

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace nacre::rigs {

/// R_d(x_i, ·) around one x_i: channel after channel, each core × core, row by row from
/// the top (+y), as a dataset stores it. Means over pitch × pitch cells centred on
/// x_i + d, mm⁻², per unit flux that entered.
struct Window {
  std::vector<float> rd;
  std::vector<float> sigma;  ///< standard deviation; 0 where the solver has no noise
};

/// Where the light that entered one channel ends up, as fractions of it.
struct Totals {
  double reflected = 0;
  double transmitted = 0;
  double absorbed = 0;
};

/// A solver for one phantom. All of it is const and may be called from several threads.
class Transport {
 public:
  virtual ~Transport() = default;
  virtual const Phantom& phantom() const = 0;

  /// The window of the phantom's grid for its beam centred on `x_i`.
  virtual Window WindowAround(PointMm x_i) const = 0;

  /// Adds flux · R_d(x_i, x_o) to exitance[k] for every point x_o, for the phantom's
  /// beam centred on `x_i`: what a camera sees, with the flux's unit a mm².
  virtual void AddExitance(PointMm x_i,
                           std::size_t channel,
                           double flux,
                           const PointColumns& points,
                           float* exitance) const = 0;

  /// The distance beyond which less than 1e-4 of what entered leaves.
  virtual double ReachMm(std::size_t channel) const = 0;

  virtual Totals TotalsAt(PointMm x_i, std::size_t channel) const = 0;
};

/// The solvers of this build, by the names that `nacre simulate --solver` takes.
enum class Solver {
  kAuto,  ///< the best that exists for the phantom; here always kFast
  kFast,  ///< PathAveraged
};

/// Throws a usage Error that names the solvers there are.
Solver ParseSolver(const std::string& name);

/// Throws BadData if the phantom is outside what the solver can do.
std::unique_ptr<Transport> MakeTransport(const Phantom& phantom,
                                         Solver solver,
                                         int thread_count = 0);

}  // namespace nacre::rigs
