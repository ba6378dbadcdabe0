#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace nacre {

/// A file under construction: written to temporary_path(), flushed to disk and renamed
/// to its own name by Commit(). Unless committed, the destructor removes it; after a
/// kill, whoever next writes the same file on the same machine. A reader never sees
/// half a file.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// In the same folder, with the same extension; write here.
  const std::filesystem::path& temporary_path() const { return temporary_path_; }

  /// fsync, rename, fsync of the folder. Throws Error naming the file and the reason.
  void Commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_path_;
  bool committed_ = false;
};

/// Writes `bytes` to `path` atomically.
void WriteFile(const std::filesystem::path& path, std::string_view bytes);

/// The whole file. Throws BadData above `max_bytes`, Error if it can't be read.
std::string ReadFile(const std::filesystem::path& path,
                     std::uint64_t max_bytes = std::uint64_t{4} << 30);

}  // namespace nacre
