#pragma once

#include "core/error.h"

#include <arv.h>

#include <fmt/format.h>
#include <memory>
#include <string>

namespace nacre::acquire::internal {

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
/// One reference to a GObject.
template <class Object>
using GHandle = std::unique_ptr<Object, Unref>;

struct Free {
  void operator()(gpointer memory) const { g_free(memory); }
};

/// The error argument of a call of GLib style: `f(…, error.out()); error.Check(…)`.
class GErrorSlot {
 public:
  GErrorSlot() = default;
  ~GErrorSlot() { g_clear_error(&error_); }
  GErrorSlot(const GErrorSlot&) = delete;
  GErrorSlot& operator=(const GErrorSlot&) = delete;

  GError** out() {
    g_clear_error(&error_);
    return &error_;
  }
  bool failed() const { return error_ != nullptr; }
  std::string message() const { return failed() ? error_->message : ""; }
  /// Throws DeviceError "camera NAME: tried: message" if the call failed.
  void Check(const std::string& name, const std::string& tried) const {
    if (failed()) {
      throw DeviceError(fmt::format("camera {}: {}: {}", name, tried, message()));
    }
  }

 private:
  GError* error_ = nullptr;
};

}  // namespace nacre::acquire::internal
