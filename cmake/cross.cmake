# Toolchain of scripts/cross.sh, -DFLIPFREE_TARGET=windows, macos or aarch64: it puts libraries and headers into build/TARGET/root.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES FLIPFREE_TARGET)
# Without "..": CMake drops it where it reads its cache, and every command would be another at the second run.
get_filename_component(FLIPFREE_TARGET_FOLDER ${CMAKE_CURRENT_LIST_DIR}/../build/${FLIPFREE_TARGET} ABSOLUTE)
if(FLIPFREE_TARGET STREQUAL "windows")
  set(CMAKE_SYSTEM_NAME Windows)
  set(CMAKE_SYSTEM_PROCESSOR x86_64)
  set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
  set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
  set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
  set(CMAKE_CXX_FLAGS_INIT "-D_USE_MATH_DEFINES -DNOMINMAX -Wa,-mbig-obj")
  set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
elseif(FLIPFREE_TARGET STREQUAL "macos")
  set(CMAKE_SYSTEM_NAME Darwin)
  set(CMAKE_SYSTEM_PROCESSOR arm64)
  set(CMAKE_C_COMPILER ${FLIPFREE_TARGET_FOLDER}/bin/clang)
  set(CMAKE_CXX_COMPILER ${FLIPFREE_TARGET_FOLDER}/bin/clang++)
  set(CMAKE_AR llvm-ar)
  set(CMAKE_RANLIB llvm-ranlib)
  set(CMAKE_INSTALL_NAME_TOOL true)  # nothing is installed
  set(CMAKE_OSX_SYSROOT "")
  set(FLIPFREE_PRECOMPILED OFF CACHE BOOL "ziglang's driver takes no -emit-pch")
  # For what Boost's headers say to libc++, which has dropped it.
  set(CMAKE_CXX_FLAGS_INIT -D_LIBCPP_ENABLE_CXX17_REMOVED_UNARY_BINARY_FUNCTION)
  # ziglang's linker cannot hide operators new and delete, with which dyld would mix those of others.
  set(FLIPFREE_CREATE_MODULE "ld64.lld-19 -bundle -arch arm64 -platform_version macos 11.0 11.0 -dead_strip -x -S \
-exported_symbol _PyInit__native -undefined dynamic_lookup -o <TARGET> <OBJECTS> <LINK_LIBRARIES> \
${FLIPFREE_TARGET_FOLDER}/root/lib/divdc3.o -L${FLIPFREE_TARGET_FOLDER}/root/lib -lSystem -lc++ -lc++abi")
else()
  set(CMAKE_SYSTEM_NAME Linux)
  set(CMAKE_SYSTEM_PROCESSOR aarch64)
  set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
  set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
  set(CMAKE_CXX_FLAGS_INIT -Wno-psabi)  # notes about other versions of GCC
endif()
set(CMAKE_FIND_ROOT_PATH ${FLIPFREE_TARGET_FOLDER}/root)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
