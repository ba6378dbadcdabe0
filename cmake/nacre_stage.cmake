# nacre_stage(name HEADERS … SOURCES … PUBLIC … PRIVATE …)
#   One library per stage: target nacre_<name>, alias nacre::<name>. Headers are a file
#   set, so that each is compiled alone (all_verify_interface_header_sets) and installed.

add_library(nacre_flags INTERFACE)
target_compile_features(nacre_flags INTERFACE cxx_std_20)
target_compile_options(nacre_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wold-style-cast
  -Wnon-virtual-dtor -Woverloaded-virtual -Wimplicit-fallthrough
  $<$<CXX_COMPILER_ID:GNU>:-Wduplicated-cond -Wlogical-op -Wuseless-cast>
  $<$<BOOL:${NACRE_WERROR}>:-Werror>
  # Of files compiled together, g++ takes all but one for headers.
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:${CMAKE_UNITY_BUILD}>>:-Wno-subobject-linkage>
  -fno-math-errno -ffp-contract=off)
if(NOT NACRE_SANITIZE)
  target_compile_options(nacre_flags INTERFACE
    -fstack-protector-strong -fstack-clash-protection
    $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
  target_link_options(nacre_flags INTERFACE -Wl,-z,relro,-z,now)
else()
  target_compile_options(nacre_flags INTERFACE -fsanitize=${NACRE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(nacre_flags INTERFACE -fsanitize=${NACRE_SANITIZE})
endif()

set_property(GLOBAL PROPERTY NACRE_STAGES "")

function(nacre_stage name)
  cmake_parse_arguments(stage "" "" "HEADERS;SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target nacre_${name})
  add_library(${target} STATIC ${stage_SOURCES})
  add_library(nacre::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES
    EXPORT_NAME ${name}
    POSITION_INDEPENDENT_CODE ON
    VERIFY_INTERFACE_HEADER_SETS ON)
  target_sources(${target} PUBLIC FILE_SET HEADERS
    BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${stage_HEADERS})
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/nacre>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_libraries(${target} PUBLIC ${stage_PUBLIC}
    PRIVATE ${stage_PRIVATE} $<BUILD_INTERFACE:nacre_flags>)
  set_property(GLOBAL APPEND PROPERTY NACRE_STAGES ${target})
endfunction()
