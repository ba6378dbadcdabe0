#include "acquire/internal/projector_window.h"

#include "core/error.h"

#include <SDL.h>
#include <fmt/format.h>

namespace nacre::acquire::internal {
namespace {

Error Failure(const std::string& what) {
  return DeviceError(fmt::format("projector: {}: {}", what, SDL_GetError()));
}

std::string Displays() {
  std::string text;
  for (int k = 0; k < SDL_GetNumVideoDisplays(); ++k) {
    SDL_Rect bounds{};
    const char* name = SDL_GetDisplayName(k);
    SDL_GetDisplayBounds(k, &bounds);
    text += fmt::format("{}{} = {}, {} x {}",
                        k == 0 ? "" : "; ",
                        k,
                        name == nullptr ? "unnamed" : name,
                        bounds.w,
                        bounds.h);
  }
  return text.empty() ? "none" : text;
}

struct FreeSurface {
  void operator()(SDL_Surface* surface) const { SDL_FreeSurface(surface); }
};

}  // namespace

struct ProjectorWindow::Handles {
  // Of the process: nested calls are counted by SDL.
  class Video {
   public:
    Video() {
      // Ctrl-C belongs to the command; and the person types in another window.
      SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
      SDL_SetHint(SDL_HINT_VIDEO_MINIMIZE_ON_FOCUS_LOSS, "0");
      if (SDL_InitSubSystem(SDL_INIT_VIDEO) != 0) {
        throw Failure("there are no displays here");
      }
    }
    ~Video() { SDL_QuitSubSystem(SDL_INIT_VIDEO); }
    Video(const Video&) = delete;
    Video& operator=(const Video&) = delete;
  };

  struct DestroyWindow {
    void operator()(SDL_Window* old) const { SDL_DestroyWindow(old); }
  };

  Video video;
  std::unique_ptr<SDL_Window, DestroyWindow> window;
};

ProjectorWindow::ProjectorWindow(int display) : handles_(std::make_unique<Handles>()) {
  if (display >= SDL_GetNumVideoDisplays()) {
    throw DeviceError(
        fmt::format("projector: there is no display {}; there are: {}. Connect the "
                    "projector and extend the desktop to it, or set `display`",
                    display,
                    Displays()));
  }
  const char* name = SDL_GetDisplayName(display);
  display_name_ = name == nullptr ? fmt::format("display {}", display) : name;
  const auto middle = static_cast<int>(SDL_WINDOWPOS_CENTERED_DISPLAY(display));
  handles_->window.reset(
      SDL_CreateWindow("Nacre projector",
                       middle,
                       middle,
                       640,
                       480,
                       SDL_WINDOW_FULLSCREEN_DESKTOP | SDL_WINDOW_ALWAYS_ON_TOP));
  if (!handles_->window) {
    throw Failure("no window");
  }
  SDL_ShowCursor(SDL_DISABLE);
  SDL_PumpEvents();
  const SDL_Surface* surface = SDL_GetWindowSurface(handles_->window.get());
  if (surface == nullptr) {
    throw Failure("no picture in the window");
  }
  width_ = surface->w;
  height_ = surface->h;
  SDL_FlushEvents(SDL_FIRSTEVENT, SDL_LASTEVENT);  // of its coming up
}

ProjectorWindow::~ProjectorWindow() = default;

void ProjectorWindow::Show(const std::vector<std::uint32_t>& picture) {
  SDL_Surface* surface = SDL_GetWindowSurface(handles_->window.get());
  if (surface == nullptr || surface->w != width_ || surface->h != height_) {
    throw DeviceError(
        "projector: the window was resized; set the display's mode, "
        "leave it so, and resume");
  }
  std::vector<std::uint32_t> pixels = picture;  // SDL takes no constant ones
  const std::unique_ptr<SDL_Surface, FreeSurface> source(
      SDL_CreateRGBSurfaceWithFormatFrom(
          pixels.data(), width_, height_, 32, 4 * width_, SDL_PIXELFORMAT_RGB888));
  if (!source || SDL_BlitSurface(source.get(), nullptr, surface, nullptr) != 0 ||
      SDL_UpdateWindowSurface(handles_->window.get()) != 0) {
    throw Failure("a picture can't be shown");
  }
}

ProjectorWindow::State ProjectorWindow::Listen() {
  State state = State::kFine;
  SDL_Event event{};
  while (SDL_PollEvent(&event) != 0) {
    if (event.type == SDL_QUIT) {
      return State::kLost;
    }
    if (event.type != SDL_WINDOWEVENT) {
      continue;
    }
    switch (event.window.event) {
      case SDL_WINDOWEVENT_CLOSE:
      case SDL_WINDOWEVENT_HIDDEN:
      case SDL_WINDOWEVENT_MINIMIZED:
        return State::kLost;
      case SDL_WINDOWEVENT_EXPOSED:
      case SDL_WINDOWEVENT_SIZE_CHANGED:
        state = State::kRepaint;  // which finds out whether the size is another
        break;
      default:
        break;
    }
  }
  return state;
}

}  // namespace nacre::acquire::internal
