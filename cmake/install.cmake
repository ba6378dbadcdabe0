# cmake --install and find_package(nacre).
include(CMakePackageConfigHelpers)

get_property(stages GLOBAL PROPERTY NACRE_STAGES)
install(TARGETS ${stages} EXPORT nacreTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nacre)
install(EXPORT nacreTargets NAMESPACE nacre::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nacre)
configure_package_config_file(cmake/nacreConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/nacreConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nacre)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/nacreConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/nacreConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/nacreConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nacre)
if(TARGET nacre)
  install(TARGETS nacre RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(DIRECTORY cli/scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre)
  install(DIRECTORY presets/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre/presets
    PATTERN phantoms EXCLUDE PATTERN README.md EXCLUDE)
endif()
if(TARGET nacre_acquire)
  install(FILES acquire/70-nacre-camera.rules
    DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre)
endif()
if(TARGET nacre-laser-watchdog)
  install(TARGETS nacre-laser-watchdog
    RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/nacre)
  install(FILES acquire/70-nacre-helios.rules
    DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre)
endif()
if(NACRE_WITH_RIGS)
  install(DIRECTORY rigs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre/rigs
    FILES_MATCHING PATTERN "*.toml")
endif()
