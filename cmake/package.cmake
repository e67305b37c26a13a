# What `cmake --install` puts where, and the .deb of `cpack`. The manual page and the completion are written by the
# program itself.
include(GNUInstallDirs)
install(TARGETS loam RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES tools/packaging/org.loam.loam.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications)
install(FILES tools/packaging/org.loam.loam.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps)
install(FILES tools/packaging/org.loam.loam.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo)
install(FILES tools/packaging/loam.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
install(CODE "
  set(files \"${CMAKE_BINARY_DIR}/package\")
  file(MAKE_DIRECTORY \"\${files}\")
  foreach(pair man:loam.1 completion:loam)
    string(REPLACE \":\" \";\" pair \"\${pair}\")
    list(GET pair 0 verb)
    list(GET pair 1 name)
    execute_process(COMMAND \"$<TARGET_FILE:loam>\" \${verb} OUTPUT_FILE \"\${files}/\${name}\" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  execute_process(COMMAND gzip -9nkf \"\${files}/loam.1\" COMMAND_ERROR_IS_FATAL ANY)")
install(FILES ${CMAKE_BINARY_DIR}/package/loam.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${CMAKE_BINARY_DIR}/package/loam DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME loam)
set(CPACK_PACKAGE_VERSION 0.9.0)
set(CPACK_PACKAGE_CONTACT "The Loam developers <loam@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "voxel world simulator and renderer")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION games)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "${CPACK_PACKAGE_DESCRIPTION_SUMMARY}
 Generates, imports, simulates and draws worlds made of voxels: in a window to
 walk and build in, or without one from the command line.")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# Opened at run time: a machine that only simulates needs neither.
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libvulkan1, mesa-vulkan-drivers")
include(CPack)
