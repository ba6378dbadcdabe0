// Pictures, and render().

#include "core/error.h"
#include "core/exr.h"
#include "core/json.h"
#include "core/png.h"
#include "render/render.h"
#include "render/tone.h"

#include <optional>

#include "python/bindings.h"

namespace nacre::python {
namespace {

// [channel][row][column] in memory, seen as rows, columns, channels.
py::array Pixels(const py::object& self) {
  auto& part = self.cast<ExrPart&>();
  constexpr auto kItem = static_cast<py::ssize_t>(sizeof(float));
  const auto channels = static_cast<py::ssize_t>(part.channels.size());
  return py::array_t<float>(
      {py::ssize_t{part.height}, py::ssize_t{part.width}, channels},
      {part.width * kItem, kItem, part.height * part.width * kItem},
      part.values.data(),
      self);
}

ExrPart MakeImage(const Floats& pixels,
                  const std::optional<std::vector<std::string>>& channels) {
  if (pixels.ndim() != 3) {
    throw UsageError("Image(pixels): it must have three axes: height, width, channels");
  }
  const auto count = static_cast<std::size_t>(pixels.shape(2));
  static const std::vector<std::string> color{"R", "G", "B", "A"};
  ExrPart part{.name = "",
               .width = static_cast<int>(pixels.shape(1)),
               .height = static_cast<int>(pixels.shape(0)),
               .channels = {},
               .values = {},
               .attributes = {}};
  if (channels) {
    part.channels = *channels;
  } else if (count == 1) {
    part.channels = {"Y"};
  } else if (count == 3 || count == 4) {
    part.channels.assign(color.begin(),
                         color.begin() + static_cast<std::ptrdiff_t>(count));
  }
  if (part.channels.size() != count || count == 0) {
    throw UsageError(
        fmt::format("Image(channels = …): {} names for {} channels of pixels",
                    part.channels.size(),
                    count));
  }
  const auto values = pixels.unchecked<3>();
  for (py::ssize_t c = 0; c < pixels.shape(2); ++c) {
    for (py::ssize_t y = 0; y < pixels.shape(0); ++y) {
      for (py::ssize_t x = 0; x < pixels.shape(1); ++x) {
        part.values.push_back(values(y, x, c));
      }
    }
  }
  return part;
}

void WriteImage(const ExrPart& image,
                const std::filesystem::path& path,
                double exposure_ev) {
  const py::gil_scoped_release unlocked;
  if (path.extension() == ".png") {
    WritePng(path, render::ToPng(image, exposure_ev));
  } else if (path.extension() == ".exr") {
    WriteExr(path, {image});
  } else {
    throw UsageError(path.string() + ": the name must end in .exr or .png");
  }
}

void AddImage(py::module_& module) {
  py::class_<ExrPart, std::shared_ptr<ExrPart>>(
      module, "Image", "A picture of linear floats, the top row first.")
      .def(py::init(&MakeImage),
           "Copies an array: height, width, channels.",
           py::arg("pixels"),
           py::arg("channels") = py::none())
      .def_readonly("name", &ExrPart::name, "of this part of its file; may be empty")
      .def_readonly("channels", &ExrPart::channels)
      .def_readonly("attributes", &ExrPart::attributes)
      .def_property_readonly(
          "pixels",
          &Pixels,
          "height, width, channels: the picture's own memory, a channel after another")
      .def("write",
           &WriteImage,
           "*.exr: as it is; *.png: sRGB, `exposure_ev` stops brighter.",
           py::arg("path"),
           py::arg("exposure_ev") = 0.0);
  module.def(
      "read_images",
      [](const std::filesystem::path& path) {
        std::vector<std::shared_ptr<ExrPart>> images;
        const py::gil_scoped_release unlocked;
        for (ExrPart& part : ReadExr(path)) {
          images.push_back(std::make_shared<ExrPart>(std::move(part)));
        }
        return images;
      },
      "All parts of an OpenEXR file, a list.",
      py::arg("path"));
}

// NOLINTNEXTLINE(readability-function-size): arguments that Python names
py::tuple Render(const std::filesystem::path& scene_file,
                 const std::map<std::string, std::string>& define,
                 bool lenient,
                 bool allow_outside,
                 const py::object& progress,
                 int thread_count,
                 std::uint64_t seed,
                 const py::kwargs& arguments) {
  auto options = OptionsFrom<render::RenderOptions>(arguments, "render");
  options.thread_count = thread_count;
  options.seed = seed;
  std::vector<std::string> notes;
  LongCall call(progress);
  render::Rendering result = call.Run([&](const ProgressFunction& report) {
    const render::Scene scene = render::ReadScene(
        scene_file,
        {.defines = define, .lenient = lenient, .allow_outside = allow_outside});
    notes = scene.notes;
    return render::Render(scene, options, report);
  });
  const py::dict summary = FromJson(result.summary.ToJson().dump());
  summary["notes"] = notes;
  py::dict aovs;
  for (ExrPart& part : result.aovs) {
    const py::str name(part.name);
    aovs[name] = std::make_shared<ExrPart>(std::move(part));
  }
  summary["aovs"] = aovs;
  return py::make_tuple(std::make_shared<ExrPart>(std::move(result.image)), summary);
}

}  // namespace

void AddPictures(py::module_& module) {
  AddImage(module);
  const std::string help =
      "Renders a scene file in Mitsuba's XML; `define` gives values to its $names, "
      "`lenient` leaves unknown words out with a note, `allow_outside` lets it read "
      "files "
      "outside its folder.\n\n"
      "Returns the Image and what `nacre render --json` prints, as a dict, with "
      "\"notes\" and \"aovs\" (Images by name). `progress` is called with stage, done "
      "and total; False stops.\n\nOptions:\n" +
      OptionsHelp<render::RenderOptions>();
  module.def("render",
             &Render,
             help.c_str(),
             py::arg("scene"),
             py::kw_only(),
             py::arg("define") = std::map<std::string, std::string>{},
             py::arg("lenient") = false,
             py::arg("allow_outside") = false,
             py::arg("progress") = py::none(),
             py::arg("thread_count") = 0,
             py::arg("seed") = 1);
}

}  // namespace nacre::python
