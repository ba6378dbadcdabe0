#pragma once

namespace nacre::calibrate::internal {

/// While one of these lives, OpenBLAS, through which OpenCV solves equations, uses one
/// thread: its sums are of other pieces with each number of threads, so that last bits
/// would depend on the machine's cores. Nothing is done where another BLAS is at work.
class OneThreadAlgebra {
 public:
  OneThreadAlgebra();
  ~OneThreadAlgebra();
  OneThreadAlgebra(const OneThreadAlgebra&) = delete;
  OneThreadAlgebra& operator=(const OneThreadAlgebra&) = delete;

 private:
  int threads_before_ = 0;  ///< 0: not known, nothing to restore
};

}  // namespace nacre::calibrate::internal
