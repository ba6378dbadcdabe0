#include "calibrate/internal/one_thread_algebra.h"

#include <dlfcn.h>
#include <initializer_list>

namespace nacre::calibrate::internal {
namespace {

struct OpenBlas {
  int (*threads)() = nullptr;
  void (*set_threads)(int) = nullptr;
};

// OpenCV brings it, we don't link it: looked for among what is loaded already, which
// works too where all of us was loaded by an interpreter.
const OpenBlas& LoadedOpenBlas() {
  static const OpenBlas found = [] {
    OpenBlas blas;
    for (const char* name : {"libopenblas.so.0", "libopenblas.so"}) {
      void* library = ::dlopen(name, RTLD_NOLOAD | RTLD_LAZY);
      if (library != nullptr) {
        blas.threads =
            reinterpret_cast<int (*)()>(::dlsym(library, "openblas_get_num_threads"));
        blas.set_threads = reinterpret_cast<void (*)(int)>(
            ::dlsym(library, "openblas_set_num_threads"));
        break;
      }
    }
    return blas;
  }();
  return found;
}

}  // namespace

OneThreadAlgebra::OneThreadAlgebra() {
  const OpenBlas& blas = LoadedOpenBlas();
  if (blas.threads != nullptr && blas.set_threads != nullptr) {
    threads_before_ = blas.threads();
    blas.set_threads(1);
  }
}

OneThreadAlgebra::~OneThreadAlgebra() {
  if (threads_before_ > 0) {
    LoadedOpenBlas().set_threads(threads_before_);
  }
}

}  // namespace nacre::calibrate::internal
