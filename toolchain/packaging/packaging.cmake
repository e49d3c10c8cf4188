# The Debian package: `make deb`. What it installs, and what it depends on, is all here.
if(CMAKE_INSTALL_PREFIX_INITIALIZED_TO_DEFAULT)
  set(CMAKE_INSTALL_PREFIX /usr CACHE PATH "where the package puts things" FORCE)
endif()
include(GNUInstallDirs)
set(packaging ${CMAKE_SOURCE_DIR}/toolchain/packaging)
set(documentation ${CMAKE_INSTALL_DOCDIR})

install(TARGETS firstlook RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
# Fixed places: systemd and udev of Debian 12 look below /lib, whatever the prefix is.
install(FILES ${packaging}/firstlook.service DESTINATION /lib/systemd/system)
install(FILES ${packaging}/60-firstlook.rules DESTINATION /lib/udev/rules.d)
install(FILES ${packaging}/80-firstlook-can.network DESTINATION /lib/systemd/network)
install(FILES ${packaging}/firstlook.sysusers DESTINATION /usr/lib/sysusers.d RENAME firstlook.conf)
install(FILES ${packaging}/copyright ${packaging}/README.Debian ${packaging}/COMMISSIONING.md DESTINATION ${documentation})
install(FILES ${packaging}/lintian-overrides DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME firstlook)
install(FILES ${packaging}/firstlook.yaml DESTINATION ${documentation}/examples)

# Debian wants its texts compressed without a time stamp, so that the same sources give the same package.
function(install_compressed source name destination)
  set(made ${CMAKE_CURRENT_BINARY_DIR}/packaging/${name}.gz)
  add_custom_command(
    OUTPUT ${made}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_CURRENT_BINARY_DIR}/packaging
    COMMAND sh -c "gzip -9nc '${source}' > '${made}'"
    DEPENDS ${source}
    VERBATIM)
  set_property(GLOBAL APPEND PROPERTY firstlook_compressed ${made})
  install(FILES ${made} DESTINATION ${destination})
endfunction()
install_compressed(${packaging}/firstlook.1 firstlook.1 ${CMAKE_INSTALL_MANDIR}/man1)
install_compressed(${packaging}/changelog changelog ${documentation})
get_property(compressed GLOBAL PROPERTY firstlook_compressed)
add_custom_target(packaging_texts DEPENDS ${compressed})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME firstlook)
set(CPACK_PACKAGE_CONTACT "firstlook developers <firstlook@example.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "calibrates the camera on a robot arm and maps its work cell")
set(CPACK_PACKAGE_DESCRIPTION
    "Press one button, and firstlook finds the calibration board, works out
where the camera sits on the arm and how sure that is, looks around without
moving through space that it has not seen to be free, and leaves a calibrated
camera and a collision map for any motion planner. It runs with no hardware
in a simulated cell.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_SET_DESTDIR ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
    WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "systemd | systemd-standalone-sysusers, udev")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION TRUE)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${packaging}/postinst ${packaging}/prerm ${packaging}/postrm)
include(CPack)
