#include "render/scene_reader/objects.h"

#include <charconv>
#include <cmath>

namespace nacre::render {
namespace {

template <class Value>
Value Choose(Element& element,
             const char* name,
             const std::string& word,
             const std::map<std::string, Value>& values) {
  const auto found = values.find(word);
  if (found == values.end()) {
    std::vector<std::string> known;
    known.reserve(values.size());
    for (const auto& entry : values) {
      known.push_back(entry.first);
    }
    element.FailAt(name,
                   fmt::format("no {} '{}'{}", name, word, Suggestion(word, known)));
  }
  return found->second;
}

void ReadFilter(Element element, Film& film) {
  const std::string type = element.type();
  const std::map<std::string, FilterKind> kinds = {
      {"box", FilterKind::kBox},
      {"tent", FilterKind::kTent},
      {"gaussian", FilterKind::kGaussian},
      {"mitchell", FilterKind::kMitchell},
      {"catmullrom", FilterKind::kCatmullRom},
      {"lanczos", FilterKind::kLanczos}};
  const auto found = kinds.find(type);
  if (found == kinds.end()) {
    UnknownPlugin(element,
                  {"box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"});
    return;
  }
  film.filter = found->second;
  film.filter_radius = DefaultRadius(film.filter);
  if (film.filter == FilterKind::kBox || film.filter == FilterKind::kTent) {
    film.filter_radius = static_cast<float>(
        InRange(element,
                "radius",
                element.Float("radius", static_cast<double>(film.filter_radius)),
                {0.01, 32}));
  }
  if (film.filter == FilterKind::kGaussian) {
    film.gaussian_stddev = static_cast<float>(
        InRange(element, "stddev", element.Float("stddev", 0.5), {0.01, 8}));
    film.filter_radius = 4 * film.gaussian_stddev;
  }
  if (film.filter == FilterKind::kMitchell) {
    film.mitchell_b =
        static_cast<float>(InRange(element, "B", element.Float("B", 1.0 / 3), {0, 1}));
    film.mitchell_c =
        static_cast<float>(InRange(element, "C", element.Float("C", 1.0 / 3), {0, 1}));
  }
  if (film.filter == FilterKind::kLanczos) {
    film.filter_radius = static_cast<float>(
        InRange(element, "lobes", element.Integer("lobes", 3), {1, 16}));
  }
  element.Finish();
}

void ReadSize(Element& element, Film& film) {
  constexpr int kMax = 65536;
  film.width = element.Integer("width", 768);
  film.height = element.Integer("height", 576);
  InRange(element, "width", film.width, {1, kMax});
  InRange(element, "height", film.height, {1, kMax});
  film.crop_x = element.Integer("cropOffsetX", 0);
  film.crop_y = element.Integer("cropOffsetY", 0);
  film.crop_width = element.Integer("cropWidth", film.width - film.crop_x);
  film.crop_height = element.Integer("cropHeight", film.height - film.crop_y);
  if (film.crop_x < 0 || film.crop_y < 0 || film.crop_width < 1 ||
      film.crop_height < 1 || film.crop_x > film.width - film.crop_width ||
      film.crop_y > film.height - film.crop_height) {
    element.Fail(
        fmt::format("the crop window {} x {} at ({}, {}) isn't inside the "
                    "film of {} x {}",
                    film.crop_width,
                    film.crop_height,
                    film.crop_x,
                    film.crop_y,
                    film.width,
                    film.height));
  }
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
  if (std::int64_t{film.crop_width} * film.crop_height > kMaxPixels) {
    element.Fail(
        fmt::format("a picture of {} x {} pixels; at most {} are rendered at "
                    "once, use a crop window",
                    film.crop_width,
                    film.crop_height,
                    kMaxPixels));
  }
}

void ReadFilm(Element element, Film& film) {
  const std::string type = element.type();
  if (type != "hdrfilm" && type != "ldrfilm") {
    UnknownPlugin(element, {"hdrfilm", "ldrfilm"});
    return;
  }
  ReadSize(element, film);
  const std::map<std::string, PixelFormat> formats = {
      {"rgb", PixelFormat::kRgb},
      {"rgba", PixelFormat::kRgba},
      {"luminance", PixelFormat::kLuminance},
      {"luminanceAlpha", PixelFormat::kLuminanceAlpha}};
  film.format =
      Choose(element, "pixelFormat", element.String("pixelFormat", "rgb"), formats);
  element.Boolean("banner", false);  // there never is one
  const std::string ours = "the format is chosen by the name of the output";
  for (const char* name : {"fileFormat", "componentFormat"}) {
    element.Ignore(name, ours);
  }
  for (const char* name : {"gamma", "exposure", "tonemapMethod", "key", "burn"}) {
    element.Ignore(name, "pictures are linear; see --exposure for PNG");
  }
  element.Ignore("attachLog", "no log is attached");
  element.Ignore("highQualityEdges", "edges are filtered with full quality");
  for (const Element& filter : element.Objects("rfilter")) {
    ReadFilter(filter, film);
  }
  element.Finish();
}

int ReadSampler(Element element) {
  const std::vector<std::string> known = {
      "independent", "stratified", "ldsampler", "halton", "hammersley", "sobol"};
  const std::string type = element.type();
  if (std::find(known.begin(), known.end(), type) == known.end()) {
    UnknownPlugin(element, known);
  }
  const int count = element.Integer("sampleCount", 4);
  InRange(element, "sampleCount", count, {1, 1 << 24});
  for (const char* name : {"dimension", "scramble", "seed"}) {
    element.Ignore(name, "all samplers are Owen-scrambled Sobol' points here");
  }
  if (type != "sobol") {
    element.document().Note(
        element.node(),
        fmt::format("sampler '{}': Owen-scrambled Sobol' points are used", type));
  }
  element.Finish();
  return count;
}

// A 35 mm film's diagonal is 43.27 mm; "50mm" is a focal length for it.
double FieldOfView(Element& element, FovAxis& axis) {
  if (element.Has("fov")) {
    if (element.Has("focalLength")) {
      element.Fail("give either 'fov' or 'focalLength'");
    }
    return element.Float("fov", 0);
  }
  const std::string text = element.String("focalLength", "50mm");
  double focal_mm = 0;
  const auto [stop, failure] =
      std::from_chars(text.data(), text.data() + text.size(), focal_mm);
  const std::string unit(stop, text.data() + text.size());
  if (failure != std::errc() || !(focal_mm > 0) || (unit != "mm" && !unit.empty())) {
    element.FailAt("focalLength",
                   fmt::format("'{}' isn't a focal length like 50mm", text));
  }
  axis = FovAxis::kDiagonal;
  const double half_diagonal_mm = 0.5 * std::hypot(36.0, 24.0);
  return 2 * std::atan(half_diagonal_mm / focal_mm) * 180 / std::numbers::pi;
}

void ReadCamera(Element& element, Scene& scene) {
  const std::map<std::string, FovAxis> axes = {{"x", FovAxis::kX},
                                               {"y", FovAxis::kY},
                                               {"diagonal", FovAxis::kDiagonal},
                                               {"smaller", FovAxis::kSmaller},
                                               {"larger", FovAxis::kLarger}};
  FovAxis axis = Choose(element, "fovAxis", element.String("fovAxis", "x"), axes);
  const double fov_deg = FieldOfView(element, axis);
  InRange(element, "fov", fov_deg, {1e-4, 179.999});
  Camera& camera = scene.camera;
  camera.half_width = HalfWidth(fov_deg, axis, scene.film.width, scene.film.height);
  camera.near_clip = static_cast<float>(
      InRange(element, "nearClip", element.Float("nearClip", 1e-2), {0, 1e30}));
  camera.far_clip = static_cast<float>(
      InRange(element, "farClip", element.Float("farClip", 1e4), {0, 1e30}));
  if (!(camera.near_clip < camera.far_clip)) {
    element.Fail("nearClip must be below farClip");
  }
  camera.world_from_camera = element.ToWorld();
  if (camera.world_from_camera.Determinant() == 0) {
    element.FailAt("toWorld", "the camera's transform is singular");
  }
}

void ReadPhotons(Element& element, PhotonSettings& photons) {
  photons.enabled = true;
  const int count = element.Integer("photonCount", 250'000);
  InRange(element, "photonCount", count, {1, 1e9});
  photons.count = count;
  photons.initial_radius = static_cast<float>(
      InRange(element, "initialRadius", element.Float("initialRadius", 0), {0, 1e9}));
  photons.alpha = static_cast<float>(
      InRange(element, "alpha", element.Float("alpha", 0.7), {0, 1}));
  element.Ignore("maxPasses", "a sample of the pixels is a pass");
  element.Ignore("granularity", "photons are traced in blocks of their own");
}

}  // namespace

void ReadSensor(Element element) {
  Scene& scene = element.document().scene;
  if (element.type() != "perspective") {
    UnknownPlugin(element, {"perspective"});
    return;
  }
  for (const Element& film : element.Objects("film")) {
    ReadFilm(film, scene.film);
  }
  scene.samples_per_pixel = 4;
  for (const Element& sampler : element.Objects("sampler")) {
    scene.samples_per_pixel = ReadSampler(sampler);
  }
  ReadCamera(element, scene);
  element.Ignore("focusDistance", "the camera is a pinhole");
  for (const char* name : {"shutterOpen", "shutterClose"}) {
    element.Ignore(name, "nothing moves");
  }
  element.Finish();
}

void ReadIntegrator(Element element) {
  IntegratorSettings& settings = element.document().scene.integrator;
  const std::string type = element.type();
  settings.hide_emitters = element.Boolean("hideEmitters", false);
  element.Ignore("strictNormals", "light never crosses the true surface");
  const bool photons = type == "sppm" || type == "ppm";
  if (photons) {
    ReadPhotons(element, settings.photons);
  }
  if (photons || type == "path" || type == "volpath" || type == "volpath_simple") {
    settings.kind = IntegratorSettings::Kind::kPath;
    settings.max_depth = element.Integer("maxDepth", -1);
    settings.rr_depth = element.Integer("rrDepth", 5);
    if (settings.max_depth < -1 || settings.max_depth == 0) {
      element.FailAt("maxDepth", "maxDepth is -1 (no limit) or at least 1");
    }
    if (settings.rr_depth < 1) {
      element.FailAt("rrDepth", "rrDepth is at least 1");
    }
  } else if (type == "direct") {
    settings.kind = IntegratorSettings::Kind::kDirect;
    for (const char* name : {"shadingSamples", "emitterSamples", "bsdfSamples"}) {
      element.Ignore(name, "one of each a sample of the pixel");
    }
  } else {
    UnknownPlugin(element,
                  {"path", "volpath", "volpath_simple", "direct", "sppm", "ppm"});
    return;
  }
  element.Finish();
}

}  // namespace nacre::render
