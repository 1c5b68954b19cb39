# Debian packages of what scripts/install.cmake installs, made by CPack: scripts/package.sh. Included last by the root, so
# that every component is known.
set(CAIRN_MAINTAINER "Cairn developers <cairn@packages.invalid>" CACHE STRING "Maintainer of the Debian packages")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME cairn)
set(CPACK_PACKAGE_CONTACT ${CAIRN_MAINTAINER})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL "")
# What Debian wants otherwise than cmake --install leaves it.
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/scripts/debian/layout.cmake)
set(CPACK_CAIRN_SOURCE ${PROJECT_SOURCE_DIR})

# cairn_package(<component> <package> <section> <description>): the first line of the description is its summary. Of what
# the package needs, shared libraries are found; others are in CPACK_DEBIAN_<COMPONENT>_PACKAGE_DEPENDS and the like.
macro(cairn_package component package section description)
  string(TOUPPER ${component} upper)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_${upper}_DESCRIPTION ${description})
endmacro()

# Node.js runs the decoder of LAZ, which is in the package; PCL's input and output is loaded for compressed PCD, EGL for
# pictures by OpenGL.
find_library(pcl_io pcl_io REQUIRED)
file(REAL_PATH ${pcl_io} pcl_io)
string(REGEX REPLACE ".*\\.so\\.([0-9]+\\.[0-9]+).*" "libpcl-io\\1" pcl_io_package ${pcl_io})
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "nodejs, ${pcl_io_package}, libegl1")
cairn_package(program cairn science
"multiresolution point datasets from laser scans
Cairn turns laser scans, any number of files with more points than memory
holds, into one dataset that can be drawn on a budget, proved, measured and
given back: a multi-way kd-tree whose nodes all hold as many points. It reads
LAS, LAZ, E57, PLY, PCD, PTX and other texts of numbers.")

set(CPACK_DEBIAN_READER_PACKAGE_DEPENDS 
  "libcurl4-openssl-dev | libcurl-dev, libfmt-dev (>= 9), libfmt-dev (<< 10), liblzo2-dev, libxxhash-dev, libzstd-dev, pkgconf | pkg-config")
cairn_package(reader libcairn-dev libdevel
"multiresolution point datasets from laser scans - reading them
A static C++20 library that opens the datasets of the program cairn, checks
and decodes their nodes, with its headers and what CMake needs to find it:
find_package(cairn), target cairn::reader.")

if(CAIRN_PYTHON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
    ${PROJECT_SOURCE_DIR}/scripts/debian/python3-cairn/postinst ${PROJECT_SOURCE_DIR}/scripts/debian/python3-cairn/prerm)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  cairn_package(python python3-cairn python
"multiresolution point datasets from laser scans - Python 3 module
The module cairn reads datasets of the program cairn, from a folder or from
a server, into NumPy arrays: a level of detail, a box, a budget of points, or
node after node, in several threads.")
endif()

# A further component needs one more call, before this.
include(CPack)
