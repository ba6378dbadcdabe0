# The same answer in every build: nothing that lets the compiler change sums, and nothing
# that differs from build to build or from run to run.
#   cmake -DBUILD=folder -P tests/check_arithmetic.cmake

set(failures "")
function(refuse file pattern why)
  file(STRINGS ${file} lines REGEX "${pattern}")
  foreach(line IN LISTS lines)
    string(APPEND failures "${file}: ${why}: ${line}\n")
  endforeach()
  set(failures "${failures}" PARENT_SCOPE)
endfunction()

set(folders acquire bench calibrate cli core factor python reconstruct render rigs cmake)
set(sources CMakeLists.txt CMakePresets.json)
foreach(folder IN LISTS folders)
  file(GLOB_RECURSE found ${folder}/*.cc ${folder}/*.h ${folder}/*.in ${folder}/CMakeLists.txt
    ${folder}/*.cmake)
  list(APPEND sources ${found})
endforeach()
# Numbers of a fake camera, not of an artefact.
list(REMOVE_ITEM sources "${CMAKE_CURRENT_SOURCE_DIR}/rigs/gige_camera_twin.cc")
list(LENGTH sources count)
if(count LESS 300)
  message(FATAL_ERROR "only ${count} sources found: run in the project's folder")
endif()

set(loose "-ffast-math|-Ofast|-funsafe-math|-fassociative-math|-freciprocal-math|-ffinite-math-only|-fno-signed-zeros")
foreach(file IN LISTS sources)
  refuse(${file} "${loose}|fast_math|optimize *[(]" "arithmetic that isn't IEEE's")
  refuse(${file} "__DATE__|__TIME__|__TIMESTAMP__" "differs from build to build")
  refuse(${file} "random_device|[^a-z_]s?rand[(]" "differs from run to run")
endforeach()

# What packages or the environment add shows in the build's own commands.
if(EXISTS "${BUILD}/build.ninja")
  refuse(${BUILD}/build.ninja "${loose}" "arithmetic that isn't IEEE's")
  file(STRINGS ${BUILD}/build.ninja contracted REGEX "-ffp-contract=off" LIMIT_COUNT 1)
  if(NOT contracted)
    string(APPEND failures "${BUILD}/build.ninja: -ffp-contract=off is missing\n")
  endif()
endif()

if(failures)
  message(FATAL_ERROR "${failures}")
endif()
