# cpack -G DEB: the command, what a rig needs, the presets, the add-on for Blender, and
# libraries to build on, a package each; the Python module where it is built.
set(CPACK_PACKAGE_NAME nacre)
set(CPACK_PACKAGE_CONTACT "The Nacre project")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Measured translucency: captured, factored, rendered")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_COMPONENTS_ALL tools rig presets blender dev)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME nacre)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "nacre-presets, nacre-rig")
set(CPACK_COMPONENT_TOOLS_DESCRIPTION "The nacre command, its scenes and manual pages")

set(CPACK_DEBIAN_RIG_PACKAGE_NAME nacre-rig)
set(CPACK_DEBIAN_RIG_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RIG_PACKAGE_DEPENDS nacre)
set(CPACK_COMPONENT_RIG_DESCRIPTION
  "Rig descriptions, the laser's watch-dog, and udev rules for cameras and laser")

set(CPACK_DEBIAN_PRESETS_PACKAGE_NAME nacre-presets)
set(CPACK_DEBIAN_PRESETS_PACKAGE_ARCHITECTURE all)
set(CPACK_COMPONENT_PRESETS_DESCRIPTION "Materials to pick from")

set(CPACK_DEBIAN_BLENDER_PACKAGE_NAME nacre-blender)
set(CPACK_DEBIAN_BLENDER_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_BLENDER_PACKAGE_DEPENDS "nacre, nacre-presets, blender, python3-numpy")
set(CPACK_COMPONENT_BLENDER_DESCRIPTION "Nacre as a render engine in Blender")

if(TARGET nacre_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-nacre)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= ${NACRE_PYTHON_VERSION}), python3 (<< ${NACRE_PYTHON_NEXT}), python3-numpy")
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "Datasets, materials and pictures as NumPy arrays")
endif()

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libnacre-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEV_DESCRIPTION "Nacre's static libraries and headers")
include(CPack)
