# Debian 12's exported config of OpenImageIO is broken.
find_path(OPENIMAGEIO_INCLUDE_DIR OpenImageIO/imageio.h)
find_library(OPENIMAGEIO_LIBRARY OpenImageIO)
find_library(OPENIMAGEIO_UTIL_LIBRARY OpenImageIO_Util)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenImageIO
  REQUIRED_VARS OPENIMAGEIO_INCLUDE_DIR OPENIMAGEIO_LIBRARY OPENIMAGEIO_UTIL_LIBRARY)
if(OpenImageIO_FOUND AND NOT TARGET OpenImageIO::OpenImageIO)
  add_library(OpenImageIO::OpenImageIO INTERFACE IMPORTED)
  target_include_directories(OpenImageIO::OpenImageIO SYSTEM INTERFACE "${OPENIMAGEIO_INCLUDE_DIR}")
  target_link_libraries(OpenImageIO::OpenImageIO INTERFACE "${OPENIMAGEIO_LIBRARY}" "${OPENIMAGEIO_UTIL_LIBRARY}")
endif()
