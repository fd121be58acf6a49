# One more _native per entry of FLIPFREE_WHEEL_PYTHONS, all on the one core library:
#
#   -DFLIPFREE_WHEEL_PYTHONS="3.13=DIR;3.14=DIR"    DIR has that Python's headers
#
# Headers are all that a module needs, as it finds its Python's functions in the program that loads it; for Windows the import
# library beside them.
set(FLIPFREE_WHEEL_PYTHONS "" CACHE STRING "Further Pythons to build the module for, VERSION=HEADERS")
foreach(entry IN LISTS FLIPFREE_WHEEL_PYTHONS)
  string(REGEX MATCH "^3\\.([0-9]+)=(.+)$" matched "${entry}")
  if(NOT matched)
    message(FATAL_ERROR "FLIPFREE_WHEEL_PYTHONS: '${entry}' is not VERSION=HEADERS")
  endif()
  set(minor ${CMAKE_MATCH_1})
  set(headers ${CMAKE_MATCH_2})
  set(tag cp3${minor})
  add_library(_native_${tag} MODULE ${BINDING_SOURCES})
  target_include_directories(_native_${tag} SYSTEM PRIVATE ${headers} ${headers}/python3.${minor} ${pybind11_INCLUDE_DIR})
  binding_module(_native_${tag})
  if(WIN32)
    set(name _native.${tag}-win_amd64 SUFFIX .pyd)
    target_link_libraries(_native_${tag} PRIVATE ${headers}/libpython3${minor}.dll.a)
  elseif(APPLE)
    set(name _native.cpython-3${minor}-darwin SUFFIX .so)
  else()
    set(name _native.cpython-3${minor}-${CMAKE_SYSTEM_PROCESSOR}-linux-gnu SUFFIX .so)
  endif()
  set_target_properties(_native_${tag} PROPERTIES PREFIX "" OUTPUT_NAME ${name}
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/wheel_modules/${tag})
endforeach()
