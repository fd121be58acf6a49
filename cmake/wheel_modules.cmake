# One more _native per entry of FLIPFREE_WHEEL_PYTHONS, all on the one core library:
#
#   -DFLIPFREE_WHEEL_PYTHONS="3.13=DIR;3.14=DIR"    DIR has that Python's headers
#
# Headers are all that a module needs: it finds its Python's functions in the program that loads it.
set(FLIPFREE_WHEEL_PYTHONS "" CACHE STRING "Further Pythons to build the module for, VERSION=HEADERS")
foreach(entry IN LISTS FLIPFREE_WHEEL_PYTHONS)
  string(REGEX MATCH "^3\\.([0-9]+)=(.+)$" matched "${entry}")
  if(NOT matched)
    message(FATAL_ERROR "FLIPFREE_WHEEL_PYTHONS: '${entry}' is not VERSION=HEADERS")
  endif()
  set(tag cp3${CMAKE_MATCH_1})
  set(headers ${CMAKE_MATCH_2})
  set(abi cpython-3${CMAKE_MATCH_1}-${CMAKE_SYSTEM_PROCESSOR}-linux-gnu)

  add_library(_native_${tag} MODULE ${BINDING_SOURCES})
  target_include_directories(_native_${tag} SYSTEM PRIVATE ${headers} ${headers}/python3.${CMAKE_MATCH_1} ${pybind11_INCLUDE_DIR})
  target_link_libraries(_native_${tag} PRIVATE flipfree_core)
  target_include_directories(_native_${tag} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_compile_options(_native_${tag} PRIVATE -O1)
  target_compile_definitions(_native_${tag} PRIVATE FLIPFREE_VERSION="${PROJECT_VERSION}")
  target_link_options(_native_${tag} PRIVATE -static-libstdc++ -static-libgcc
    -Wl,--version-script=${CMAKE_CURRENT_SOURCE_DIR}/module.map)
  set_target_properties(_native_${tag} PROPERTIES UNITY_BUILD ${FLIPFREE_UNITY} UNITY_BUILD_BATCH_SIZE 0 PREFIX "" SUFFIX ".so" OUTPUT_NAME _native.${abi}
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/wheel_modules/${tag})
endforeach()
