find_package(rapidcheck REQUIRED)
nacre_test(laser
  SOURCES
    laser_safety_test.cc
  LIBRARIES
    nacre::laser rapidcheck)
if(TARGET nacre_usb_twins)
  nacre_test(helios
    SOURCES
      helios_dac_test.cc
    LIBRARIES
      nacre::helios nacre::usb_twins
    EMULATED_USB)
endif()
