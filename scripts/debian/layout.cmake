# Run by CPack before a package is made: what Debian's policy wants otherwise than `cmake --install` leaves it. Manual
# pages and changelogs are compressed, the licence is told in `copyright`, static libraries have no debug symbols.
file(GLOB stages LIST_DIRECTORIES true ${CPACK_TEMPORARY_DIRECTORY}/*)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # that of SOURCE_DATE_EPOCH
set(version ${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})

function(compress file)
  execute_process(COMMAND gzip -9nf ${file} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(package ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  foreach(stage IN LISTS stages)
    cmake_path(GET stage FILENAME name)
    if(NOT name STREQUAL component)
      continue()
    endif()
    set(documents ${stage}/usr/share/doc/${package})
    file(MAKE_DIRECTORY ${documents})
    file(REMOVE ${documents}/LICENSE ${documents}/CHANGELOG.md)
    file(COPY ${CPACK_CAIRN_SOURCE}/scripts/debian/copyright DESTINATION ${documents})
    configure_file(${CPACK_CAIRN_SOURCE}/CHANGELOG.md ${documents}/changelog COPYONLY)
    file(WRITE ${documents}/changelog.Debian
      "cairn (${version}) unstable; urgency=medium\n\n"
      "  * Package of version ${CPACK_PACKAGE_VERSION}; what is new is told in changelog.gz.\n\n"
      " -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
    file(GLOB pages ${stage}/usr/share/man/man*/*.[1-9])
    foreach(file IN LISTS pages ITEMS ${documents}/changelog ${documents}/changelog.Debian)
      compress(${file})
    endforeach()
    file(GLOB_RECURSE archives ${stage}/usr/lib/*.a)
    foreach(archive IN LISTS archives)
      execute_process(COMMAND strip --strip-debug --enable-deterministic-archives ${archive} COMMAND_ERROR_IS_FATAL ANY)
    endforeach()
    execute_process(COMMAND chmod -R u+rwX,go+rX,go-w ${stage} COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
endforeach()
