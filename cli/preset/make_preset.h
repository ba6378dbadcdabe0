#pragma once

#include "cli/preset/preset.h"
#include "core/options.h"
#include "core/progress.h"

#include <filesystem>
#include <string>

namespace nacre::preset {

struct MakeOptions {
  std::string name;
  std::string title;
  std::string author = "the Nacre project";
  std::string licence = "Apache-2.0";
  std::string notes;
  int thumbnail_px = 160;
  int thumbnail_spp = 32;
  int thread_count = 0;

  template <class Self, class Visitor>
  static void Visit(Self& self, Visitor&& visit) {
    visit("name", self.name, Range{}, "what scenes call it; the folder's name");
    visit("title", self.title, Range{}, "for people; the name unless given");
    visit("author", self.author, Range{}, "whom to thank");
    visit("licence", self.licence, Range{}, "SPDX identifier");
    visit("notes", self.notes, Range{}, "where the parameters are from, what to know");
    visit("thumbnail_px", self.thumbnail_px, Range{16, 1024}, "side of the thumbnail");
    visit("thumbnail_spp", self.thumbnail_spp, Range{1, 4096}, "its samples a pixel");
  }
};

/// What a thumbnail is a picture of: a scene with $material, $res and $mm (millimetres
/// of the sample a scene unit), see cli/scenes/thumbnail.xml.
struct MakeInputs {
  std::filesystem::path material;
  std::filesystem::path dataset;  ///< that it was factored from; empty: not known
  std::filesystem::path scene;
};

/// Makes `library`/`options.name` of a material: copies it, fits the maps, renders the
/// thumbnail. Replaces what is there.
Preset MakePreset(const MakeInputs& inputs,
                  const std::filesystem::path& library,
                  const MakeOptions& options,
                  const ProgressFunction& progress = {});

}  // namespace nacre::preset
