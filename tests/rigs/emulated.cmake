if(TARGET nacre_usb_twins AND NACRE_WITH_ARAVIS)
  nacre_test(emulated_rig
    SOURCES
      emulated_rig_test.cc
    LIBRARIES
      nacre::helios nacre::usb_twins nacre::rigs nacre::acquire
    LABEL regression
    TIMEOUT 300
    EMULATED_USB)
endif()
