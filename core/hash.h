#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

namespace nacre {

/// XXH3, 64 bits, of memory.
std::uint64_t Hash64(const void* data, std::size_t size);

/// XXH3, 128 bits, as 32 hexadecimal digits: the checksum written in artefacts.
std::string HashHex(const void* data, std::size_t size);

/// The same of a whole file, streamed.
std::string HashFile(const std::filesystem::path& path);

}  // namespace nacre
