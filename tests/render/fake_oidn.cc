// Takes the place of Open Image Denoise in tests: what comes out is the colour, to
// which half of the albedo and a quarter of the normal are added. Fails for a red of
// -1.
#include <cstddef>
#include <cstring>

namespace {

const float* images[3];
float* output;
std::size_t count;
bool hdr;
bool committed;
const char* error;

}  // namespace

// NOLINTBEGIN(readability-identifier-naming): that library's names
extern "C" {

void* oidnNewDevice(int type) {
  return type == 1 ? &error : nullptr;
}
void oidnCommitDevice(void*) {
  error = nullptr;
}
void oidnReleaseDevice(void*) {}
void* oidnNewFilter(void*, const char* type) {
  committed = false;
  return std::strcmp(type, "RT") == 0 ? &count : nullptr;
}
void oidnReleaseFilter(void*) {}
void oidnSetSharedFilterImage(void*,
                              const char* name,
                              void* pixels,
                              int format,
                              std::size_t width,
                              std::size_t height,
                              std::size_t offset,
                              std::size_t pixel_stride,
                              std::size_t row_stride) {
  constexpr const char* names[3] = {"color", "albedo", "normal"};
  if (format != 3 || offset + pixel_stride + row_stride != 0) {
    error = "format";
  }
  count = 3 * width * height;
  for (int n = 0; n < 3; ++n) {
    if (std::strcmp(name, names[n]) == 0) {
      images[n] = static_cast<const float*>(pixels);
    }
  }
  if (std::strcmp(name, "output") == 0) {
    output = static_cast<float*>(pixels);
  }
}
void oidnSetFilter1b(void*, const char* name, bool value) {
  hdr = std::strcmp(name, "hdr") == 0 && value;
}
void oidnCommitFilter(void*) {
  committed = true;
}
void oidnExecuteFilter(void*) {
  if (!hdr || !committed || images[0][0] == -1) {
    error = "a red of -1";
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    output[i] = images[0][i] + 0.5F * images[1][i] + 0.25F * images[2][i];
  }
}
int oidnGetDeviceError(void*, const char** message) {
  *message = error;
  return error == nullptr ? 0 : 1;
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
