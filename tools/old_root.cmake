# CMake toolchain: this machine's compiler with the C library and the libraries of build/old/root (tools/wheel_old.sh), or of the
# folder OM_OLD_ROOT of the environment: what is built runs from glibc 2.31 on.
# gcc 10 of that root has no versions of a function for several processors (OM_MULTIVERSION).
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER gcc)
set(CMAKE_LIBRARY_ARCHITECTURE x86_64-linux-gnu)
if(DEFINED ENV{OM_OLD_ROOT})
    set(CMAKE_SYSROOT $ENV{OM_OLD_ROOT})
else()
    get_filename_component(CMAKE_SYSROOT ${CMAKE_CURRENT_LIST_DIR}/../build/old/root ABSOLUTE)
endif()
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(multiarch ${CMAKE_SYSROOT}/usr/lib/x86_64-linux-gnu)
set(ENV{PKG_CONFIG_LIBDIR} ${CMAKE_SYSROOT}/usr/local/lib/pkgconfig:${multiarch}/pkgconfig)
set(ENV{PKG_CONFIG_SYSROOT_DIR} ${CMAKE_SYSROOT})
# This gcc looks into its own machine's folders before those of the root: they come first here (-B: crt1.o), with libgomp of the root.
set(CMAKE_SHARED_LINKER_FLAGS_INIT "-B${multiarch} -L${CMAKE_SYSROOT}/usr/local/lib -L${multiarch} -Wl,-rpath-link,${CMAKE_SYSROOT}/usr/local/lib:${multiarch}")
set(CMAKE_EXE_LINKER_FLAGS_INIT "${CMAKE_SHARED_LINKER_FLAGS_INIT}")
set(OpenMP_gomp_LIBRARY ${multiarch}/libgomp.so.1 CACHE FILEPATH "")
