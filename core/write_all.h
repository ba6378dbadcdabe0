#pragma once

#include <string_view>

namespace nacre {

/// Writes all bytes at the file's position, going on after interruptions and short
/// writes. False with errno set if that can't be done.
[[nodiscard]] bool WriteAll(int fd, std::string_view bytes);

}  // namespace nacre
