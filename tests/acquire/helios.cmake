find_package(rapidcheck REQUIRED)
nacre_test(laser
  SOURCES
    laser_safety_test.cc
  LIBRARIES
    nacre::laser rapidcheck)
if(TARGET nacre_acquire AND NACRE_WITH_ARAVIS)
  nacre_test(rig_light
    SOURCES
      rig_light_test.cc
    LIBRARIES
      nacre::acquire)
  target_compile_definitions(rig_light_tests PRIVATE
    NACRE_RIGS_FOLDER="${PROJECT_SOURCE_DIR}/rigs")
endif()
if(TARGET nacre_usb_twins)
  nacre_test(helios
    SOURCES
      helios_dac_test.cc
    LIBRARIES
      nacre::helios nacre::usb_twins
    EMULATED_USB)
endif()
if(TARGET nacre_projector AND TARGET nacre_acquire AND NACRE_WITH_ARAVIS)
  nacre_test(projector
    SOURCES
      projector_test.cc
    LIBRARIES
      nacre::projector nacre::acquire)
  # Not its target: its flags would keep the headers that tests share from being used.
  target_include_directories(projector_tests SYSTEM PRIVATE ${sdl2_INCLUDE_DIRS})
  target_compile_definitions(projector_tests PRIVATE
    NACRE_RIGS_FOLDER="${PROJECT_SOURCE_DIR}/rigs")
endif()
