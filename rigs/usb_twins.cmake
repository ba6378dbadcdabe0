# Devices on an emulated USB, for tests. Not installed: they need umockdev in the process.
option(NACRE_WITH_USB_TWINS "Emulated USB devices for the tests (needs umockdev)"
       ${NACRE_WITH_TESTS})
if(NACRE_WITH_USB_TWINS AND TARGET nacre_helios)
  find_package(PkgConfig REQUIRED)
  pkg_check_modules(umockdev REQUIRED IMPORTED_TARGET umockdev-1.0)
  add_library(nacre_usb_twins STATIC
    emulated_rig.cc helios_dac_twin.cc internal/helios_firmware.cc internal/usb_port.cc)
  add_library(nacre::usb_twins ALIAS nacre_usb_twins)
  target_include_directories(nacre_usb_twins PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(nacre_usb_twins
    PUBLIC nacre::laser nacre::rigs PRIVATE PkgConfig::umockdev nacre_flags)
endif()
