// import nacre: the module, its errors, and how a long call is stopped.

#include "core/error.h"
#include "core/version.h"

#include <csignal>
#include <utility>

#include "python/bindings.h"

namespace nacre::python {
namespace {

// A signal handler's, and what it stands for meanwhile.
// NOLINTBEGIN(cppcoreguidelines-avoid-non-const-global-variables)
volatile std::sig_atomic_t interrupted = 0;
struct sigaction before {};
// NOLINTEND(cppcoreguidelines-avoid-non-const-global-variables)

extern "C" void OnInterrupt(int signal) {
  interrupted = 1;
  std::signal(signal, SIG_DFL);  // the second one ends it at once
}

bool IsMainThread() {
  const py::module_ threading = py::module_::import("threading");
  return threading.attr("current_thread")().is(threading.attr("main_thread")());
}

}  // namespace

LongCall::LongCall(py::object progress) : progress_(std::move(progress)) {
  // As in Python itself, Ctrl-C is for the main thread.
  if (IsMainThread()) {
    interrupted = 0;
    struct sigaction action {};
    action.sa_handler = OnInterrupt;
    watches_ = sigaction(SIGINT, &action, &before) == 0;
  }
}

LongCall::~LongCall() {
  if (watches_) {
    sigaction(SIGINT, &before, nullptr);
  }
}

bool LongCall::GoOn(const Progress& progress) {
  if (watches_ && interrupted != 0) {
    return false;
  }
  if (progress_.is_none()) {
    return true;
  }
  const py::gil_scoped_acquire locked;
  try {
    const py::object answer = progress_(progress.stage, progress.done, progress.total);
    return answer.is_none() || answer.cast<bool>();
  } catch (const py::error_already_set& error) {
    raised_ = error.value();
    return false;
  }
}

void LongCall::RaiseReason() {
  if (raised_) {
    PyErr_SetObject(py::type::of(raised_).ptr(), raised_.ptr());
    throw py::error_already_set();
  }
  if (watches_ && interrupted != 0) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
    throw py::error_already_set();
  }
}

namespace {

// Exception types live as long as the process.
PyObject* NewError(py::module_& module,
                   const char* name,
                   const char* help,
                   const py::tuple& bases) {
  PyObject* const type = PyErr_NewExceptionWithDoc(
      fmt::format("nacre.{}", name).c_str(), help, bases.ptr(), nullptr);
  if (type == nullptr) {
    throw py::error_already_set();
  }
  module.add_object(name, py::reinterpret_borrow<py::object>(type));
  return type;
}

struct ErrorTypes {
  PyObject* error = nullptr;
  PyObject* usage = nullptr;
  PyObject* bad_data = nullptr;
  PyObject* interrupted = nullptr;
};
// NOLINTNEXTLINE(cppcoreguidelines-avoid-non-const-global-variables): the interpreter's
ErrorTypes error_types;

void AddErrors(py::module_& module) {
  const py::handle base = error_types.error =
      NewError(module,
               "Error",
               "What was tried, what was found, what to do.",
               py::make_tuple(py::handle(PyExc_RuntimeError)));
  error_types.usage = NewError(module,
                               "UsageError",
                               "An option is wrong.",
                               py::make_tuple(base, py::handle(PyExc_ValueError)));
  error_types.bad_data =
      NewError(module,
               "BadData",
               "A file is corrupt, truncated, of another kind, or holds a NaN.",
               py::make_tuple(base));
  error_types.interrupted = NewError(
      module, "Interrupted", "`progress` returned False.", py::make_tuple(base));
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(std::move(thrown));
    } catch (const Error& error) {
      PyObject* const type = error.code() == ExitCode::kUsage     ? error_types.usage
                             : error.code() == ExitCode::kBadData ? error_types.bad_data
                             : error.code() == ExitCode::kInterrupted
                                 ? error_types.interrupted
                                 : error_types.error;
      PyErr_SetString(type, error.what());
    }
  });
}

}  // namespace

}  // namespace nacre::python

PYBIND11_MODULE(nacre, module) {
  module.doc() =
      "Datasets R_d, materials and pictures as NumPy arrays; factor() and render().";
  module.attr("__version__") = nacre::Version();
  nacre::python::AddErrors(module);
  nacre::python::AddSamples(module);
  nacre::python::AddPictures(module);
}
