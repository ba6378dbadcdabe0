#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace nacre::render {

/// Unpacks gzip data of one or more members. Throws BadData naming `origin` if it is
/// damaged, cut short or above `max_bytes` once unpacked.
std::string Gunzip(std::string_view bytes,
                   const std::string& origin,
                   std::uint64_t max_bytes = std::uint64_t{4} << 30);

}  // namespace nacre::render
