# Scanned lasers. What needs no device is always built: a rig's description is checked by it.
nacre_stage(laser
  HEADERS
    helios_options.h laser_dac.h laser_feeder.h laser_frame.h laser_safety.h scan_field.h
    spot_frames.h
  SOURCES
    laser_dac.cc laser_feeder.cc laser_safety.cc scan_field.cc spot_frames.cc
  PUBLIC
    nacre::core)
target_link_libraries(nacre_acquire PUBLIC nacre::laser)
target_sources(nacre_acquire
  PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES rig_light.h
  PRIVATE rig_light.cc)

option(NACRE_WITH_HELIOS "Laser projectors behind Helios DACs (needs libusb 1.0)" ON)
if(NACRE_WITH_HELIOS)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(libusb REQUIRED IMPORTED_TARGET libusb-1.0)
  nacre_stage(helios
    HEADERS
      helios_dac.h helios_illuminator.h laser_watchdog.h
    SOURCES
      helios_dac.cc helios_illuminator.cc laser_watchdog.cc internal/helios_usb.cc
    PUBLIC
      nacre::laser
    PRIVATE
      Threads::Threads PkgConfig::libusb)
  target_compile_definitions(nacre_acquire PRIVATE NACRE_HAS_HELIOS)

  # Beside the command in the build, in libexec when installed.
  add_executable(nacre-laser-watchdog laser_watchdog_main.cc)
  target_link_libraries(nacre-laser-watchdog PRIVATE nacre_helios nacre_flags)
  set_target_properties(nacre-laser-watchdog PROPERTIES
    RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR})
endif()
