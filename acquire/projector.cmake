# A video projector instead of a laser. Its options are part of a rig's description always.
target_sources(nacre_acquire PUBLIC FILE_SET HEADERS
  BASE_DIRS ${PROJECT_SOURCE_DIR} FILES projector_options.h)

option(NACRE_WITH_PROJECTOR "Video projectors as a source of spots (needs SDL 2)" ON)
if(NACRE_WITH_PROJECTOR)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(sdl2 REQUIRED IMPORTED_TARGET sdl2)
  nacre_stage(projector
    HEADERS
      projector_illuminator.h projector_pattern.h
    SOURCES
      projector_illuminator.cc projector_pattern.cc internal/projector_window.cc
    PUBLIC
      nacre::core
    PRIVATE
      Threads::Threads PkgConfig::sdl2)
endif()
