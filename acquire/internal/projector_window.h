#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace nacre::acquire::internal {

/// A black window over the whole of a display, by SDL 2. To be used by the thread that
/// made it.
class ProjectorWindow {
 public:
  /// Throws DeviceError if there is no such display.
  explicit ProjectorWindow(int display);
  ~ProjectorWindow();
  ProjectorWindow(const ProjectorWindow&) = delete;
  ProjectorWindow& operator=(const ProjectorWindow&) = delete;

  int width() const { return width_; }
  int height() const { return height_; }
  const std::string& display_name() const { return display_name_; }

  /// 0xRRGGBB, width × height. Throws DeviceError if the window isn't as it was.
  void Show(const std::vector<std::uint32_t>& picture);

  enum class State { kFine, kRepaint, kLost };
  /// What became of the window since this was called last.
  State Listen();

 private:
  struct Handles;
  std::unique_ptr<Handles> handles_;
  int width_ = 0;
  int height_ = 0;
  std::string display_name_;
};

}  // namespace nacre::acquire::internal
