# Libraries from their sources, for a wheel that needs nothing of the system at run time: those with code as static ones with
# hidden symbols, so that no other Bullet or OMPL in the process is taken for them. The sources are those of Debian's
# packages, whose bits the golden values are; -DFETCHCONTENT_SOURCE_DIR_ENERGYMARGIN_BULLET=DIR takes them from a folder.

include_guard()
include(FetchContent)
set(energymargin_pool https://deb.debian.org/debian/pool/main)

# Unpacks a package's source into ${energymargin_NAME_SOURCE_DIR}; it builds nothing of it.
function(energymargin_unpack name url hash)
  FetchContent_Declare(energymargin_${name} URL ${energymargin_pool}/${url} URL_HASH SHA256=${hash}
    DOWNLOAD_EXTRACT_TIMESTAMP OFF SOURCE_SUBDIR none ${ARGN})
  FetchContent_MakeAvailable(energymargin_${name})
  set(energymargin_${name}_SOURCE_DIR ${energymargin_${name}_SOURCE_DIR} PARENT_SCOPE)
endfunction()

function(energymargin_bundle name)
  add_library(energymargin_${name} STATIC EXCLUDE_FROM_ALL ${ARGN})
  # Their own flags in Debian's packages: other ones could give other bits.
  target_compile_options(energymargin_${name} PRIVATE -O2 -w -ffunction-sections -fdata-sections)
  set_target_properties(energymargin_${name} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    CXX_STANDARD 14 COMPILE_WARNING_AS_ERROR OFF)
  add_library(energymargin::${name} ALIAS energymargin_${name})
endfunction()
