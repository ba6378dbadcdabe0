#include "cli/artefact.h"

#include "core/error.h"

#include <fstream>
#include <regex>

namespace nacre::cli {
namespace {

using namespace std::string_literals;

// Attributes of ours come before the pixels, but after long provenance perhaps.
constexpr std::size_t kHeadBytes = 1 << 20;

ArtefactKind KindOfExr(const std::string& head) {
  // An attribute is its name, its type and the size of its value, ended by zeros.
  const auto says = [&](const std::string& name, const std::string& value) {
    const std::size_t at = head.find(name + "\0string\0"s);
    constexpr std::size_t kSizeBytes = 4;
    const std::size_t skip = name.size() + "\0string\0"s.size() + kSizeBytes;
    return at != std::string::npos && head.compare(at + skip, value.size(), value) == 0;
  };
  if (says("nacre.kind", "rd")) {
    return ArtefactKind::kDataset;
  }
  return says("nacre.format", "") ? ArtefactKind::kMaterial : ArtefactKind::kExrPicture;
}

// In the head of a page of `nacre report`.
constexpr const char* kProvenanceMark = "<meta name=\"nacre.provenance\"";

bool HasTable(const std::string& text, const std::string& table) {
  return std::regex_search(text,
                           std::regex("(^|\n)[ \t]*\\[[ \t]*" + table + "[ \t]*\\]"));
}

ArtefactKind KindOfText(const std::filesystem::path& path, const std::string& head) {
  const std::string extension = path.extension().string();
  if (extension == ".toml") {
    return HasTable(head, "slab")      ? ArtefactKind::kPhantom
           : HasTable(head, "scanner") ? ArtefactKind::kRig
                                       : ArtefactKind::kUnknown;
  }
  if (extension == ".json" && head.find("\"camera\"") != std::string::npos &&
      head.find("\"scan_map\"") != std::string::npos) {
    return ArtefactKind::kCalibration;
  }
  if (extension == ".html" && head.find(kProvenanceMark) != std::string::npos) {
    return ArtefactKind::kReport;
  }
  return extension == ".obj" ? ArtefactKind::kObjMesh : ArtefactKind::kUnknown;
}

}  // namespace

const char* Name(ArtefactKind kind) {
  switch (kind) {
    case ArtefactKind::kDataset:
      return "dataset";
    case ArtefactKind::kMaterial:
      return "material";
    case ArtefactKind::kExrPicture:
      return "OpenEXR picture";
    case ArtefactKind::kPngPicture:
      return "PNG picture";
    case ArtefactKind::kSession:
      return "session";
    case ArtefactKind::kPreset:
      return "preset";
    case ArtefactKind::kCalibration:
      return "calibration";
    case ArtefactKind::kPhantom:
      return "phantom";
    case ArtefactKind::kRig:
      return "rig";
    case ArtefactKind::kReport:
      return "report";
    case ArtefactKind::kExport:
      return "export";
    case ArtefactKind::kPlyMesh:
      return "PLY mesh";
    case ArtefactKind::kObjMesh:
      return "OBJ mesh";
    case ArtefactKind::kUnknown:
      break;
  }
  return "unknown";
}

std::string Head(const std::filesystem::path& path, std::size_t count) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(count, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  if (file.bad() || !file.is_open()) {
    throw SystemError("cannot read " + path.string());
  }
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

ArtefactKind DetectKind(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) {
    throw Error("cannot read " + path.string() + ": there is no such file or folder");
  }
  if (std::filesystem::is_directory(path)) {
    return std::filesystem::exists(path / "session.json")  ? ArtefactKind::kSession
           : std::filesystem::exists(path / "preset.toml") ? ArtefactKind::kPreset
           : std::filesystem::exists(path / "export.json") ? ArtefactKind::kExport
                                                           : ArtefactKind::kUnknown;
  }
  const std::string head = Head(path, kHeadBytes);
  if (head.starts_with("\x76\x2f\x31\x01")) {
    return KindOfExr(head);
  }
  if (head.starts_with("\x89PNG")) {
    return ArtefactKind::kPngPicture;
  }
  if (head.starts_with("ply\n") || head.starts_with("ply\r\n")) {
    return ArtefactKind::kPlyMesh;
  }
  return KindOfText(path, head);
}

}  // namespace nacre::cli
