# What `cmake --install` puts where, included by the root. Components:
#
#   program   cairn, what other processes of it need, manual page, completions, documents, examples
#   reader    the library that reads datasets, its headers, and what find_package(cairn) needs
#   python    the Python package; told in formats/python/CMakeLists.txt
#
# Nothing knows the prefix: what is installed may be moved.
include(CMakePackageConfigHelpers)

# Relative to the prefix. Debian's own zsh looks into share/zsh/vendor-completions instead.
set(CAIRN_ZSH_FOLDER ${CMAKE_INSTALL_DATADIR}/zsh/site-functions CACHE STRING "Where completions of zsh go")

# --- The program ----------------------------------------------------------------------------------
install(TARGETS cairn RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)

# cairn_resource_folder(<folder> <option of install()>...): a folder that formats::resource_folder is to find.
function(cairn_resource_folder folder)
  install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_DATADIR}/cairn COMPONENT program
    FILE_PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ ${ARGN})
endfunction()
# Of laz-perf what Node.js loads, no builds for browsers.
cairn_resource_folder(${laz_worker}
  PATTERN installed EXCLUDE PATTERN .package-lock.json EXCLUDE PATTERN package-lock.json EXCLUDE
  PATTERN "*.d.ts" EXCLUDE PATTERN lib/web EXCLUDE PATTERN lib/worker EXCLUDE
  REGEX "/laz-perf/lib/[^/]*\\.(js|wasm)$" EXCLUDE)

cairn_resource_folder(${page})

# The manual page and the completions, told by the program itself.
set(manual ${PROJECT_BINARY_DIR}/manual)
file(MAKE_DIRECTORY ${manual})
foreach(kind IN ITEMS man bash zsh fish)
  add_custom_command(OUTPUT ${manual}/cairn.${kind}
    COMMAND cairn --generate ${kind} > ${manual}/cairn.${kind} DEPENDS cairn VERBATIM)
  list(APPEND manual_files ${manual}/cairn.${kind})
endforeach()
add_custom_target(cairn_manual ALL DEPENDS ${manual_files})
foreach(place IN ITEMS
    man:${CMAKE_INSTALL_MANDIR}/man1/cairn.1
    bash:${CMAKE_INSTALL_DATADIR}/bash-completion/completions/cairn
    zsh:${CAIRN_ZSH_FOLDER}/_cairn
    fish:${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d/cairn.fish)
  string(REGEX MATCH "^([a-z]+):(.*)/([^/]+)$" matched ${place})
  install(FILES ${manual}/cairn.${CMAKE_MATCH_1} DESTINATION ${CMAKE_MATCH_2} RENAME ${CMAKE_MATCH_3}
    COMPONENT program)
endforeach()

# Documents, and what to start from: campaigns, scenes, studies, walks and the presets.
install(FILES README.md CHANGELOG.md LICENSE formats/FORMAT.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)
install(DIRECTORY configs/ DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples COMPONENT program
  FILES_MATCHING PATTERN "*.toml" PATTERN "*.tsv" PATTERN "*.conf")
install(FILES scripts/example_levels.py DESTINATION ${CMAKE_INSTALL_DOCDIR}/examples COMPONENT program)

# --- The reader -----------------------------------------------------------------------------------
# The headers that dataset_reader.h and error.h include, and those that they include, under their own names.
set(reader_headers "")
set(more formats/dataset/dataset_reader.h formats/error.h)
while(more)
  list(POP_FRONT more header)
  list(APPEND reader_headers ${header})
  file(STRINGS ${header} includes REGEX "^#include \"formats/")
  foreach(line IN LISTS includes)
    string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included ${line})
    if(NOT included IN_LIST reader_headers AND NOT included IN_LIST more)
      list(APPEND more ${included})
    endif()
  endforeach()
endwhile()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${reader_headers})  # what they include may change
target_sources(cairn_reader PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${reader_headers})
set_target_properties(cairn_reader PROPERTIES EXPORT_NAME reader)
add_library(cairn::reader ALIAS cairn_reader)

set(cmake_folder ${CMAKE_INSTALL_LIBDIR}/cmake/cairn)
install(TARGETS cairn_reader EXPORT cairn_targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT reader
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/cairn COMPONENT reader
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/cairn)
target_compile_features(cairn_reader INTERFACE cxx_std_20)
install(EXPORT cairn_targets NAMESPACE cairn:: FILE cairn-targets.cmake DESTINATION ${cmake_folder} COMPONENT reader)
configure_package_config_file(scripts/cairn-config.cmake.in ${PROJECT_BINARY_DIR}/cairn-config.cmake
  INSTALL_DESTINATION ${cmake_folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/cairn-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/cairn-config.cmake ${PROJECT_BINARY_DIR}/cairn-config-version.cmake
  DESTINATION ${cmake_folder} COMPONENT reader)
