// Datasets and materials, and factor() from one to the other.

#include "core/error.h"
#include "core/json.h"
#include "factor/factor.h"

#include <optional>
#include <variant>

#include "python/bindings.h"

namespace nacre::python {
namespace {

using factor::Material;
using reconstruct::RdDataset;
using reconstruct::RdHeader;
using Bytes = py::array_t<std::uint8_t, py::array::c_style | py::array::forcecast>;

std::vector<py::ssize_t> ShapeOf(const RdHeader& header) {
  return {header.points_y,
          header.points_x,
          static_cast<py::ssize_t>(header.channels.size()),
          header.core,
          header.core};
}

template <class T>
std::vector<T> Copied(
    const py::array_t<T, py::array::c_style | py::array::forcecast>& a,
    const RdHeader& header,
    const char* name) {
  const std::vector<py::ssize_t> shape(a.shape(), a.shape() + a.ndim());
  if (shape != ShapeOf(header)) {
    throw UsageError(fmt::format("Dataset({} = …): its shape is ({}), that of rd ({})",
                                 name,
                                 fmt::join(shape, ", "),
                                 fmt::join(ShapeOf(header), ", ")));
  }
  return {a.data(), a.data() + a.size()};
}

std::vector<std::string> ChannelNames(py::ssize_t count) {
  if (count == 3) {
    return {"R", "G", "B"};
  }
  std::vector<std::string> names;
  for (py::ssize_t c = 0; c < count; ++c) {
    names.push_back(count == 1 ? "Y" : fmt::format("channel{}", c + 1));
  }
  return names;
}

RdDataset MakeDataset(const Floats& rd,
                      double pitch_mm,
                      double eta,
                      const std::optional<std::vector<std::string>>& channels,
                      const std::optional<Floats>& sigma,
                      const std::optional<Bytes>& valid) {
  if (rd.ndim() != 5 || rd.shape(3) != rd.shape(4)) {
    throw UsageError(
        "Dataset(rd = …): it must have five axes: points_y, points_x, channels, core, "
        "core");
  }
  RdDataset dataset;
  dataset.header = {.points_x = static_cast<int>(rd.shape(1)),
                    .points_y = static_cast<int>(rd.shape(0)),
                    .core = static_cast<int>(rd.shape(3)),
                    .pitch_mm = pitch_mm,
                    .eta = eta,
                    .channels = channels.value_or(ChannelNames(rd.shape(2))),
                    .provenance = "{}"};
  reconstruct::Validate(dataset.header, "Dataset()");
  dataset.rd = Copied(rd, dataset.header, "rd");
  dataset.sigma = sigma ? Copied(*sigma, dataset.header, "sigma")
                        : std::vector<float>(dataset.rd.size(), 0);
  dataset.valid = valid ? Copied(*valid, dataset.header, "valid")
                        : std::vector<std::uint8_t>(dataset.rd.size(), 1);
  return dataset;
}

// A view of one of the arrays of a dataset.
template <class T>
auto ArrayOf(std::vector<T> RdDataset::*values) {
  return [values](const py::object& self) {
    const auto& dataset = self.cast<const RdDataset&>();
    return View(dataset.*values, ShapeOf(dataset.header), self, true);
  };
}

void AddDataset(py::module_& module) {
  py::class_<RdDataset, std::shared_ptr<RdDataset>>(
      module,
      "Dataset",
      "R_d(x_i, d): axes points_y, points_x, channels, core, core; row 0 is the top, "
      "the window's middle d = 0. Arrays are the dataset's own memory.")
      .def(py::init(&MakeDataset),
           "Copies arrays. `sigma` 0 and `valid` 1 unless given.",
           py::arg("rd"),
           py::kw_only(),
           py::arg("pitch_mm"),
           py::arg("eta"),
           py::arg("channels") = py::none(),
           py::arg("sigma") = py::none(),
           py::arg("valid") = py::none())
      .def_property_readonly(
          "rd", ArrayOf(&RdDataset::rd), "mm^-2, means over grid cells")
      .def_property_readonly("sigma",
                             ArrayOf(&RdDataset::sigma),
                             "its standard deviation from noise; 0: unknown")
      .def_property_readonly(
          "valid", ArrayOf(&RdDataset::valid), "1 where it was measured, else 0")
      .def_property_readonly("pitch_mm",
                             [](const RdDataset& d) { return d.header.pitch_mm; })
      .def_property_readonly("eta", [](const RdDataset& d) { return d.header.eta; })
      .def_property_readonly("channels",
                             [](const RdDataset& d) { return d.header.channels; })
      .def_property_readonly("provenance",
                             [](const RdDataset& d) { return d.header.provenance; })
      .def(
          "write",
          [](const RdDataset& d, const std::filesystem::path& path) {
            const py::gil_scoped_release unlocked;
            reconstruct::WriteDataset(path, d);
          },
          "As *.rd.exr.",
          py::arg("path"));
  module.def(
      "read_dataset",
      [](const std::filesystem::path& path) {
        const py::gil_scoped_release unlocked;
        return std::make_shared<RdDataset>(reconstruct::ReadDataset(path));
      },
      "Reads a whole *.rd.exr.",
      py::arg("path"));
}

// A material's arrays are read-only: their meaning depends on each other.
py::array Maps(const py::object& self) {
  const auto& m = self.cast<const Material&>();
  return View(
      m.f, {m.MapSets(), m.MapCount(), m.MapHeight(), m.MapWidth()}, self, false);
}

py::array Kernels(const py::object& self) {
  const auto& m = self.cast<const Material&>();
  return View(m.h,
              {m.KernelSets(),
               m.cluster_count,
               m.KernelCount(),
               m.KernelSize() / m.KernelWidth(),
               m.KernelWidth()},
              self,
              false);
}

auto PointsOf(std::vector<float> Material::*values) {
  return [values](const py::object& self) {
    const auto& m = self.cast<const Material&>();
    return View(m.*values,
                {static_cast<py::ssize_t>(m.channels.size()), m.points_y, m.points_x},
                self,
                false);
  };
}

py::array Window(const Material& m, int channel, int i, int j) {
  if (channel < 0 || channel >= static_cast<int>(m.channels.size()) || i < 0 ||
      i >= m.points_x || j < 0 || j >= m.points_y) {
    throw py::index_error(fmt::format(
        "window({}, {}, {}): the material has {} channels and {} x {} points",
        channel,
        i,
        j,
        m.channels.size(),
        m.points_x,
        m.points_y));
  }
  py::array_t<float> window({m.core, m.core});
  m.EvaluateWindow(channel, i, j, window.mutable_data());
  return window;
}

void AddMaterial(py::module_& module) {
  py::class_<Material, std::shared_ptr<Material>>(
      module,
      "Material",
      "A factored dataset; arrays are its own memory, read-only, row 0 at the top.")
      .def_readonly("method", &Material::method)
      .def_readonly("terms", &Material::terms)
      .def_readonly("core", &Material::core)
      .def_readonly("pitch_mm", &Material::pitch_mm)
      .def_readonly("eta", &Material::eta)
      .def_readonly("channels", &Material::channels)
      .def_readonly("error", &Material::error, "of the fit, by name")
      .def_readonly("provenance", &Material::provenance)
      .def_property_readonly("form",
                             [](const Material& m) { return factor::Name(m.form); })
      .def_property_readonly(
          "albedo", PointsOf(&Material::albedo), "channels, points_y, points_x")
      .def_property_readonly(
          "row_scale", PointsOf(&Material::row_scale), "channels, points_y, points_x")
      .def_property_readonly(
          "maps",
          &Maps,
          "factor maps: sets (a channel each, or one), maps, height, "
          "width (with the margin)")
      .def_property_readonly(
          "kernels",
          &Kernels,
          "sets (a channel each, or one), clusters, kernels, height, width")
      .def("window",
           &Window,
           "R_d(x_i, d) in mm^-2, core x core, of grid point (i, j): a new array.",
           py::arg("channel"),
           py::arg("i"),
           py::arg("j"))
      .def(
          "write",
          [](const Material& m, const std::filesystem::path& path) {
            const py::gil_scoped_release unlocked;
            factor::WriteMaterial(path, m);
          },
          "As *.nacre.exr.",
          py::arg("path"));
  module.def(
      "read_material",
      [](const std::filesystem::path& path) {
        const py::gil_scoped_release unlocked;
        return std::make_shared<Material>(factor::ReadMaterial(path));
      },
      "Reads a *.nacre.exr.",
      py::arg("path"));
}

using Measured = std::variant<std::shared_ptr<RdDataset>, std::filesystem::path>;

py::tuple Factor(const Measured& dataset,
                 const py::object& progress,
                 int thread_count,
                 std::uint64_t seed,
                 const py::kwargs& arguments) {
  auto options = OptionsFrom<factor::FactorOptions>(arguments, "factor");
  options.thread_count = thread_count;
  options.seed = seed;
  LongCall call(progress);
  auto result = call.Run([&](const ProgressFunction& report) {
    if (const auto* memory = std::get_if<std::shared_ptr<RdDataset>>(&dataset)) {
      return factor::Factor(**memory, options, report);
    }
    reconstruct::RdReader reader(std::get<std::filesystem::path>(dataset));
    return factor::Factor(reader, options, report);
  });
  return py::make_tuple(std::make_shared<Material>(std::move(result.material)),
                        FromJson(result.summary.ToJson().dump()));
}

}  // namespace

void AddSamples(py::module_& module) {
  AddDataset(module);
  AddMaterial(module);
  const std::string help =
      "Factors a Dataset, or the *.rd.exr of that name without holding all of it.\n\n"
      "Returns the Material and what `nacre factor --json` prints, as a dict. "
      "`progress` is called with stage, done and total; False stops.\n\nOptions:\n" +
      OptionsHelp<factor::FactorOptions>();
  module.def("factor",
             &Factor,
             help.c_str(),
             py::arg("dataset"),
             py::kw_only(),
             py::arg("progress") = py::none(),
             py::arg("thread_count") = 0,
             py::arg("seed") = 1);
}

}  // namespace nacre::python
