#pragma once

#include "core/json_fwd.h"

#include <string>
#include <vector>

namespace nacre::cli {

/// The commands that remake the file `name`, first to last, by its provenance; lines
/// that begin with "#" say what has to lie beside them, with its hash. What an
/// artefact was made from is called by the name it had, or, where only its own
/// provenance is known, "dataset.rd.exr" or "calibration.json".
std::vector<std::string> CommandsThatRemake(const Json& provenance,
                                            const std::string& name);

/// A word as the shell takes it: quoted where it has to be.
std::string Quoted(const std::string& word);

}  // namespace nacre::cli
