#pragma once

#include "core/options.h"
#include "core/progress.h"

#include <concepts>
#include <filesystem>
#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <string>
#include <vector>

namespace nacre::python {

namespace py = pybind11;

/// Any array, as floats without gaps.
using Floats = py::array_t<float, py::array::c_style | py::array::forcecast>;

/// The parts of the module.
void AddSamples(py::module_& module);
void AddPictures(py::module_& module);

/// A call that takes long: from the first Ctrl-C on, or once the caller's function
/// returned False or raised, the work is asked to stop. Lives while the interpreter's
/// lock is held, and on one thread.
class LongCall {
 public:
  /// `progress` is None or a function of stage, done, total.
  explicit LongCall(py::object progress);
  ~LongCall();
  LongCall(const LongCall&) = delete;
  LongCall& operator=(const LongCall&) = delete;

  /// Runs work(progress) without the interpreter's lock. Raises what the caller's
  /// function raised, KeyboardInterrupt, or what the work throws.
  template <class Work>
  auto Run(Work&& work) {
    try {
      const py::gil_scoped_release unlocked;
      return work(ProgressFunction([this](const Progress& p) { return GoOn(p); }));
    } catch (...) {
      RaiseReason();
      throw;
    }
  }

 private:
  bool GoOn(const Progress& progress);
  void RaiseReason();

  py::object progress_;
  py::object raised_;  // by `progress_`: the exception
  bool watches_ = false;
};

/// JSON text as Python's own objects.
inline py::object FromJson(const std::string& text) {
  return py::module_::import("json").attr("loads")(text);
}

/// Values of C++ as an array without copying; the array keeps `owner` alive.
template <class T>
py::array View(const std::vector<T>& values,
               const std::vector<py::ssize_t>& shape,
               const py::object& owner,
               bool writable) {
  py::array_t<T> array(shape, values.data(), owner);
  if (!writable) {
    array.attr("setflags")(py::arg("write") = false);
  }
  return array;
}

/// Options by name. Raises TypeError for a name that isn't one, naming those there are,
/// and for a value of another type; UsageError for a value out of range.
template <class Options>
Options OptionsFrom(const py::kwargs& arguments, const char* function) {
  Options options;
  py::dict left(arguments);
  std::string names;
  Options::Visit(options, [&](const char* name, auto& value, Range, const char*) {
    using Value = std::remove_cvref_t<decltype(value)>;
    names += (names.empty() ? "" : ", ") + std::string(name);
    if (!left.contains(name)) {
      return;
    }
    try {
      value = left[name].template cast<Value>();
    } catch (const py::cast_error&) {
      throw py::type_error(fmt::format("{}({} = …): a {} can't be given",
                                       function,
                                       name,
                                       Py_TYPE(left[name].ptr())->tp_name));
    }
    PyDict_DelItemString(left.ptr(), name);
  });
  if (!left.empty()) {
    throw py::type_error(fmt::format("{}() has no option '{}'; it has: {}",
                                     function,
                                     py::str((*left.begin()).first).cast<std::string>(),
                                     names));
  }
  Validate(options);
  return options;
}

/// A line an option, for a docstring.
template <class Options>
std::string OptionsHelp() {
  std::string text;
  Options options;
  Options::Visit(options, [&](const char* name, auto& value, Range, const char* help) {
    text += fmt::format("    {} = {}: {}\n", name, value, help);
  });
  return text;
}

}  // namespace nacre::python
