#include "cli/report/report.h"

#include "cli/artefact.h"
#include "cli/report/html.h"
#include "cli/report/sections.h"
#ifdef NACRE_HAS_PRESETS
#include "cli/preset/preset.h"
#endif
#include "core/error.h"
#include "core/json.h"
#include "core/provenance.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <set>
#include <vector>

namespace nacre::cli::report {
namespace {

namespace fs = std::filesystem;

bool IsPicture(ArtefactKind kind) {
  return kind == ArtefactKind::kExrPicture || kind == ArtefactKind::kPngPicture;
}

struct Found {
  fs::path path;
  ArtefactKind kind = ArtefactKind::kUnknown;
  std::size_t stage = 0;  // that wrote it, or past the last one
};

// Along the line: captures before datasets before materials before pictures.
int Rank(ArtefactKind kind) {
  switch (kind) {
    case ArtefactKind::kSession:
      return 0;
    case ArtefactKind::kCalibration:
      return 1;
    case ArtefactKind::kDataset:
      return 2;
    case ArtefactKind::kMaterial:
    case ArtefactKind::kPreset:
      return 3;
    default:
      return 4;
  }
}

// What the page can show of a folder, in the order in which it was made: as stages.json
// tells, else along the line, else by name.
std::vector<Found> FindArtefacts(const fs::path& folder, const Json& stages) {
  std::map<std::string, std::size_t> order;
  if (stages.contains("stages")) {
    std::size_t n = 0;
    for (const Json& stage : stages.at("stages")) {
      order.emplace(Get<std::string>(stage, "output", "stages.json"), n++);
    }
  }
  std::vector<Found> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(".") || (!entry.is_directory() && !entry.is_regular_file())) {
      continue;
    }
    const ArtefactKind kind = DetectKind(entry.path());
    if (Rank(kind) < 4 || IsPicture(kind)) {
      const auto stage = order.find(name);
      found.push_back(
          {entry.path(), kind, stage == order.end() ? order.size() : stage->second});
    }
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    const auto key = [](const Found& f) {
      return std::make_tuple(f.stage, Rank(f.kind), f.path.filename().string());
    };
    return key(a) < key(b);
  });
  return found;
}

// A picture that is there as PNG too is shown as its maker developed it.
void DropDoublePictures(std::vector<Found>& found) {
  std::set<std::string> png_stems;
  for (const Found& f : found) {
    if (f.kind == ArtefactKind::kPngPicture) {
      png_stems.insert(f.path.stem().string());
    }
  }
  std::erase_if(found, [&](const Found& f) {
    return f.kind == ArtefactKind::kExrPicture &&
           png_stems.contains(f.path.stem().string());
  });
}

std::string SectionOn(const Found& found,
                      bool brief,
                      const ProgressFunction& progress) {
  switch (found.kind) {
    case ArtefactKind::kDataset:
      return DatasetSection(found.path, brief, progress);
    case ArtefactKind::kMaterial:
      return MaterialSection(found.path);
#ifdef NACRE_HAS_PRESETS
    case ArtefactKind::kPreset:
      return PresetSection(found.path);
#endif
    case ArtefactKind::kSession:
      return SessionSection(found.path);
    case ArtefactKind::kCalibration:
      return CalibrationSection(found.path);
    case ArtefactKind::kExrPicture:
    case ArtefactKind::kPngPicture:
      return PictureSection(found.path);
    default:
      throw BadData(
          fmt::format("{}: is of a kind ({}) that there is no report on; datasets, "
                      "materials, presets, pictures, "
                      "sessions, calibrations and folders of them have one",
                      found.path.string(),
                      Name(found.kind)));
  }
}

std::string FolderLead(std::vector<Found> found) {
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) {
    return Rank(a.kind) < Rank(b.kind);
  });
  std::vector<std::string> names;
  for (const Found& f : found) {
    const std::string name = IsPicture(f.kind) ? "picture" : Name(f.kind);
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      names.push_back(name);
    }
  }
  return Escape(
      fmt::format("From measurement to picture: {}.", fmt::join(names, ", ")));
}

// Of "a/b/", ".", or a file.
std::string NameOf(const fs::path& path) {
  const fs::path whole = fs::absolute(path).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

// A session is known by its two files, a preset by its own.
void AddInputs(const Found& found, Provenance& provenance) {
  if (!fs::is_directory(found.path)) {
    provenance.AddInput(found.path);
    return;
  }
  for (const char* name : {"session.json", "journal", "preset.toml"}) {
    if (fs::exists(found.path / name)) {
      provenance.AddInput(found.path / name);
      provenance.inputs.back()["file"] = fs::path(NameOf(found.path)) / name;
    }
  }
}

std::string FolderReport(const fs::path& folder, const ProgressFunction& progress) {
  const fs::path books = folder / "stages.json";
  const Json stages = fs::exists(books) ? ReadJson(books) : Json::object();
  std::vector<Found> found = FindArtefacts(folder, stages);
  DropDoublePictures(found);
  if (found.empty()) {
    throw BadData(folder.string() +
                  ": holds no dataset, material, session, calibration or picture to "
                  "report on");
  }
  const std::string name = NameOf(folder);
  Provenance provenance{.command = "report"};
  provenance.inputs.push_back({{"folder", name}});
  for (const Found& f : found) {
    AddInputs(f, provenance);
  }
  // The picture at the end of the line is what the page opens with.
  std::string body;
  if (IsPicture(found.back().kind)) {
    body += PictureFigure(found.back().path, "hero");
  }
  const std::string lead = FolderLead(found);
  if (!body.empty()) {
    found.pop_back();
  }
  if (stages.contains("stages")) {
    body += StagesSection(stages, books.string());
  }
  // Of several datasets the last is looked into; the others are what it came from.
  const auto last_dataset =
      std::find_if(found.rbegin(), found.rend(), [](const Found& f) {
        return f.kind == ArtefactKind::kDataset;
      });
  for (const Found& f : found) {
    const bool brief = last_dataset != found.rend() && &f != &*last_dataset;
    body += SectionOn(f, brief, progress);
  }
  return Page("Nacre report" + (name.empty() ? "" : ": " + name),
              lead,
              body,
              provenance.ToString());
}

}  // namespace

std::string BuildReport(const fs::path& named, const ProgressFunction& progress) {
  fs::path path = named;
#ifdef NACRE_HAS_PRESETS
  if (!fs::exists(path)) {  // a preset's name, perhaps
    path = preset::MaterialPath(named);
    path = path == named ? named : path.parent_path();
  }
#endif
  const ArtefactKind kind = DetectKind(path);
  if (fs::is_directory(path) && kind == ArtefactKind::kUnknown) {
    return FolderReport(path, progress);
  }
  const Found found{path, kind};
  const std::string section = SectionOn(found, false, progress);
  Provenance provenance{.command = "report"};
  if (fs::is_directory(path)) {
    provenance.inputs.push_back({{"folder", NameOf(path)}});
  }
  AddInputs(found, provenance);
  return Page("Nacre report: " + NameOf(path), "", section, provenance.ToString());
}

}  // namespace nacre::cli::report
