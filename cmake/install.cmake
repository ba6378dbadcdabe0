# cmake --install and find_package(nacre). Components are Debian packages: package.cmake.
include(CMakePackageConfigHelpers)

get_property(stages GLOBAL PROPERTY NACRE_STAGES)
install(TARGETS ${stages} EXPORT nacreTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/nacre COMPONENT dev)
install(EXPORT nacreTargets NAMESPACE nacre::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nacre COMPONENT dev)
configure_package_config_file(cmake/nacreConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/nacreConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nacre)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/nacreConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/nacreConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/nacreConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/nacre COMPONENT dev)
if(TARGET nacre)
  install(TARGETS nacre RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
  install(DIRECTORY cli/scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre COMPONENT tools)
  install(FILES cli/completion/nacre.bash RENAME nacre
    DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT tools)
  install(FILES cli/completion/_nacre
    DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT tools)
  find_program(NACRE_HELP2MAN help2man)
  if(NACRE_HELP2MAN)  # made when installing, since they are made of the command's own help
    set(man ${CMAKE_CURRENT_BINARY_DIR}/man1)
    install(CODE "execute_process(
      COMMAND ${PROJECT_SOURCE_DIR}/scripts/make-man $<TARGET_FILE:nacre> ${man}
      COMMAND_ERROR_IS_FATAL ANY)" COMPONENT tools)
    install(DIRECTORY ${man}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT tools)
  endif()
  install(DIRECTORY presets/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre/presets
    COMPONENT presets PATTERN phantoms EXCLUDE PATTERN README.md EXCLUDE)
  install(DIRECTORY blender/nacre_blender DESTINATION ${CMAKE_INSTALL_DATADIR}/blender/scripts/addons
    COMPONENT blender PATTERN __pycache__ EXCLUDE)
endif()
if(TARGET nacre_acquire)
  install(FILES acquire/70-nacre-camera.rules
    DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre COMPONENT rig)
endif()
if(TARGET nacre-laser-watchdog)
  install(TARGETS nacre-laser-watchdog
    RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/nacre COMPONENT rig)
  install(FILES acquire/70-nacre-helios.rules
    DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre COMPONENT rig)
endif()
if(NACRE_WITH_RIGS)
  install(DIRECTORY rigs/ DESTINATION ${CMAKE_INSTALL_DATADIR}/nacre/rigs
    COMPONENT rig FILES_MATCHING PATTERN "*.toml")
endif()
