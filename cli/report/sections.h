#pragma once

#include "core/exr.h"
#include "core/json_fwd.h"
#include "core/progress.h"

#include <filesystem>
#include <string>
#include <vector>

namespace nacre::cli::report {

/// Each returns a <section> on one artefact. They read the whole artefact, and throw
/// what its reader throws. A brief section on a dataset leaves the checks out.
std::string DatasetSection(const std::filesystem::path& path,
                           bool brief,
                           const ProgressFunction& progress);
std::string MaterialSection(const std::filesystem::path& path);
/// A preset's folder: what it says of itself, whether it is whole, and its material.
std::string PresetSection(const std::filesystem::path& folder);
std::string SessionSection(const std::filesystem::path& folder);
std::string CalibrationSection(const std::filesystem::path& path);
/// Warnings and figures of a calibration, for its section; empty if this build was made
/// without `calibrate`.
std::string CalibrationFigures(const std::filesystem::path& path);

/// Pictures, EXR or PNG. `css_class` "hero" for the one that a page is about.
std::string PictureSection(const std::filesystem::path& path);
std::string PictureFigure(const std::filesystem::path& path,
                          const std::string& css_class);

/// Figures on an OpenEXR picture: its channels, the noise that its variance tells,
/// where its samples went, how it was made.
std::string PictureStats(const std::vector<ExrPart>& parts);

/// The table of time, memory and error from stages.json; `json` is that file's content,
/// `origin` its name for messages.
std::string StagesSection(const Json& json, const std::string& origin);

/// Shared: red, green and blue of the page for channels of those names, else others.
int ChannelColor(const std::string& name, std::size_t index);

/// The indices of the channels "R", "G", "B"; else that of the first channel alone.
std::vector<std::size_t> PictureChannels(const std::vector<std::string>& channels);

/// The software's version and the command from a provenance text (HTML), or empty.
std::string ProvenanceLine(const std::string& provenance);

}  // namespace nacre::cli::report
