# What `make install` gives: headers, the library, a pkg-config file, a CMake package, the program,
# logic programs, scenes and weights. Paths are relative, so that a tree can be installed anywhere and moved.
include(CMakePackageConfigHelpers)
set(OM_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/omentum)

install(TARGETS omentum EXPORT omentumTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/omentum DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(FILES LICENSE NOTICE DESTINATION ${CMAKE_INSTALL_DOCDIR})
foreach(folder asp scenes weights)
    if(EXISTS ${PROJECT_SOURCE_DIR}/${folder})
        install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_DATADIR}/omentum)
    endif()
endforeach()
if(TARGET omentum_cli)
    install(TARGETS omentum_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
    set(OM_PAGES ${PROJECT_BINARY_DIR}/pages)
    install(FILES ${OM_PAGES}/omentum.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
    install(FILES ${OM_PAGES}/omentum DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
    install(FILES ${OM_PAGES}/_omentum DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
    install(FILES ${OM_PAGES}/omentum.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
endif()

# The prefix of the pkg-config file follows the file: ${pcfiledir} is <prefix>/<libdir>/pkgconfig.
string(REGEX REPLACE "[^/]+" ".." OM_PC_UP "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
configure_file(cmake/omentum.pc.in ${PROJECT_BINARY_DIR}/omentum.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/omentum.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

install(EXPORT omentumTargets NAMESPACE omentum:: DESTINATION ${OM_CMAKE_DIR})
configure_package_config_file(cmake/omentumConfig.cmake.in ${PROJECT_BINARY_DIR}/omentumConfig.cmake
    INSTALL_DESTINATION ${OM_CMAKE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/omentumConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/omentumConfig.cmake ${PROJECT_BINARY_DIR}/omentumConfigVersion.cmake
    DESTINATION ${OM_CMAKE_DIR})

# The wheel of the Python package (pyproject.toml): the library and its data inside of the package.
if(SKBUILD)
    install(FILES $<TARGET_FILE:omentum> DESTINATION omentum/lib COMPONENT python)
    install(FILES LICENSE NOTICE DESTINATION omentum COMPONENT python)
    install(DIRECTORY scenes weights asp DESTINATION omentum/share COMPONENT python)
endif()
