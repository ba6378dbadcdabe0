#pragma once

#include "core/png.h"
#include "reconstruct/clustering.h"

#include <filesystem>
#include <string>

namespace nacre::reconstruct {

/// Which cluster each grid point is in: an OpenEXR picture of the grid, one channel
/// "cluster" of whole numbers from 0, attributes `nacre.kind` = "clusters",
/// `nacre.version`, `nacre.pitch_mm`, `nacre.provenance`. Written atomically.
void WriteClusterMap(const std::filesystem::path& path,
                     const RdHeader& header,
                     const Clustering& clustering,
                     const std::string& provenance);

/// The same to look at: a colour a cluster, `scale` × `scale` pixels a point; hues are
/// a golden section of the circle apart, so that neighbours in number differ.
PngImage PictureOfClusters(const RdHeader& header,
                           const Clustering& clustering,
                           int scale);

}  // namespace nacre::reconstruct
