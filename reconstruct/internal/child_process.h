#pragma once

#include "reconstruct/internal/mapped_file.h"

#include <functional>
#include <memory>
#include <string>

namespace nacre::reconstruct::internal {

/// Calls `work` in a child process and gives back what it wrote to the file it is
/// handed (in memory): for libraries that die of hostile files. An Error that `work`
/// throws is thrown here. Throws BadData beginning with `origin` if the child died of a
/// fault, or needed more than `most_seconds` of processor time; Interrupted if it was
/// asked to stop. What it leaves in memory or prints at its end is gone with it.
std::unique_ptr<MappedFile> RunInChild(const std::string& origin,
                                       int most_seconds,
                                       const std::function<void(int fd)>& work);

}  // namespace nacre::reconstruct::internal
