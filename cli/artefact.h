#pragma once

#include <filesystem>
#include <string>

namespace nacre::cli {

/// What a path holds, found by looking inside, not by its name alone.
enum class ArtefactKind {
  kDataset,     ///< *.rd.exr
  kMaterial,    ///< *.nacre.exr
  kExrPicture,  ///< any other OpenEXR file
  kPngPicture,
  kSession,      ///< a folder with session.json
  kPreset,       ///< a folder with preset.toml
  kCalibration,  ///< calibration.json
  kPhantom,      ///< TOML with [slab]
  kRig,          ///< TOML with [scanner]
  kReport,       ///< a page of `nacre report`
  kExport,       ///< a folder with export.json
  kPlyMesh,
  kObjMesh,
  kUnknown,
};

const char* Name(ArtefactKind kind);

/// Throws Error if there is nothing at `path`.
ArtefactKind DetectKind(const std::filesystem::path& path);

/// The first bytes of a file, at most `count`.
std::string Head(const std::filesystem::path& path, std::size_t count);

}  // namespace nacre::cli
