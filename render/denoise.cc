#include "render/denoise.h"

#include "core/error.h"

#include <array>
#include <cstdlib>
#include <dlfcn.h>
#include <fmt/format.h>
#include <memory>
#include <string>
#include <vector>

namespace nacre::render {
namespace {

// The part of the library's C interface that is used, the same in versions 1 and 2.
constexpr int kCpuDevice = 1;
constexpr int kFloat3 = 3;

class Library {
 public:
  Library() {
    std::vector<std::string> names = {"libOpenImageDenoise.so.2",
                                      "libOpenImageDenoise.so.1",
                                      "libOpenImageDenoise.so.0",
                                      "libOpenImageDenoise.so"};
    if (const char* const own = std::getenv("NACRE_OIDN_LIBRARY")) {
      names = {own};
    }
    for (const std::string& name : names) {
      handle_.reset(dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL));
      if (handle_ != nullptr) {
        return;
      }
    }
    throw UsageError(fmt::format(
        "no denoiser: {} can't be loaded; install Intel Open Image Denoise, set "
        "NACRE_OIDN_LIBRARY to its shared library, or leave out --denoise",
        names.front()));
  }

  /// A function of the library, null if it has none of that name.
  template <class Function>
  Function* Find(const char* name) const {
    return reinterpret_cast<Function*>(dlsym(handle_.get(), name));  // NOLINT
  }
  template <class Function>
  Function* Get(const char* name) const {
    Function* const found = Find<Function>(name);
    if (found == nullptr) {
      throw UsageError(
          fmt::format("the denoiser's library has no {}: versions 1 and 2 "
                      "of Open Image Denoise are known",
                      name));
    }
    return found;
  }

 private:
  struct Close {
    void operator()(void* handle) const { dlclose(handle); }
  };
  std::unique_ptr<void, Close> handle_;
};

class Filter {
 public:
  Filter(int width, int height)
      : width_(static_cast<std::size_t>(width)),
        height_(static_cast<std::size_t>(height)),
        device_(library_.Get<void*(int)>("oidnNewDevice")(kCpuDevice),
                library_.Get<void(void*)>("oidnReleaseDevice")) {
    if (device_ == nullptr) {
      throw Error("the denoiser can't be started");
    }
    library_.Get<void(void*)>("oidnCommitDevice")(device_.get());
    filter_ = {
        library_.Get<void*(void*, const char*)>("oidnNewFilter")(device_.get(), "RT"),
        library_.Get<void(void*)>("oidnReleaseFilter")};
    CheckError();
  }

  void SetImage(const char* name, std::vector<float>& pixels) {
    using Set = void(void*,
                     const char*,
                     void*,
                     int,
                     std::size_t,
                     std::size_t,
                     std::size_t,
                     std::size_t,
                     std::size_t);
    library_.Get<Set>("oidnSetSharedFilterImage")(
        filter_.get(), name, pixels.data(), kFloat3, width_, height_, 0, 0, 0);
  }

  void Run() {
    using SetBool = void(void*, const char*, bool);
    SetBool* set = library_.Find<SetBool>("oidnSetFilterBool");
    if (set == nullptr) {
      set = library_.Get<SetBool>("oidnSetFilter1b");  // as version 1 has it
    }
    set(filter_.get(), "hdr", true);
    library_.Get<void(void*)>("oidnCommitFilter")(filter_.get());
    library_.Get<void(void*)>("oidnExecuteFilter")(filter_.get());
    CheckError();
  }

 private:
  void CheckError() const {
    const char* message = nullptr;
    const int error = library_.Get<int(void*, const char**)>("oidnGetDeviceError")(
        device_.get(), &message);
    if (error != 0) {
      throw Error(fmt::format("the denoiser failed: {}",
                              message != nullptr ? message : std::to_string(error)));
    }
  }

  using Owned = std::unique_ptr<void, void (*)(void*)>;
  std::size_t width_;
  std::size_t height_;
  Library library_;
  Owned device_;
  Owned filter_{nullptr, nullptr};
};

// Pixel after pixel, of three channels or of one three times.
std::vector<float> Interleaved(const ExrPart& part,
                               const std::array<std::size_t, 3>& channels) {
  std::vector<float> pixels(3 * part.PixelCount());
  for (std::size_t c = 0; c < 3; ++c) {
    const float* const plane = part.Channel(channels[c]);
    for (std::size_t i = 0; i < part.PixelCount(); ++i) {
      pixels[3 * i + c] = plane[i];
    }
  }
  return pixels;
}

}  // namespace

void RequireDenoiser() {
  const Library library;
}

ExrPart Denoise(const ExrPart& image, const FeatureImages& features) {
  Expect(image.width == features.albedo.width && image.height == features.albedo.height,
         "features of the same picture");
  const bool grey = image.FindChannel("Y") == 0;
  const std::array<std::size_t, 3> channels =
      grey ? std::array<std::size_t, 3>{0, 0, 0} : std::array<std::size_t, 3>{0, 1, 2};
  std::vector<float> color = Interleaved(image, channels);
  std::vector<float> albedo = Interleaved(features.albedo, {0, 1, 2});
  std::vector<float> normal = Interleaved(features.normal, {0, 1, 2});
  std::vector<float> output(color.size());
  Filter filter(image.width, image.height);
  filter.SetImage("color", color);
  filter.SetImage("albedo", albedo);
  filter.SetImage("normal", normal);
  filter.SetImage("output", output);
  filter.Run();
  ExrPart denoised = image;
  for (std::size_t c = 0; c < (grey ? 1u : 3u); ++c) {
    float* const plane = denoised.Channel(c);
    for (std::size_t i = 0; i < image.PixelCount(); ++i) {
      plane[i] = output[3 * i + c];
    }
  }
  return denoised;
}

}  // namespace nacre::render
