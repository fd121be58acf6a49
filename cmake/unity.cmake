# Unity builds: several sources are compiled as one, so that what they include is read, and its templates are instantiated, once.
# A batch holds sources of one folder below ROOT (a stage), in the order of their paths, up to BYTES; names in
# anonymous namespaces are therefore unique within a stage (scripts/check_house.py). A source that alone takes as long as a
# batch stays alone; all that include CGAL are one batch, as reading it takes five seconds. Sanitizer, fuzz and coverage builds
# compile each source by itself: what one takes from its neighbours by accident is an error there. Sources with the property
# FLIPFREE_ALONE stay alone too: tests have the linker redirect calls of their functions (tests/native/faults/poison.cpp), and it
# knows none within one batch.
option(FLIPFREE_UNITY "Compile several sources as one" ON)
if(FLIPFREE_SANITIZE OR FLIPFREE_FUZZ OR FLIPFREE_COVERAGE)
  set(FLIPFREE_UNITY OFF)
endif()

# unite(TARGET ROOT BYTES SOURCE...): SOURCEs are absolute paths of TARGET's, below ROOT. Large batches are compiled in fewer
# seconds all in all, small ones sooner after an edit of one source.
function(unite target root most)
  if(NOT FLIPFREE_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  set(stage "")
  set(filled 0)
  foreach(source IN LISTS ARGN)
    file(STRINGS ${source} with_cgal REGEX "^#include <CGAL/")
    if(with_cgal)
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP cgal)
      continue()
    endif()
    get_source_file_property(alone ${source} FLIPFREE_ALONE)
    if(alone)
      continue()
    endif()
    file(RELATIVE_PATH path ${root} ${source})
    string(REGEX MATCH "^[^/]+" folder ${path})
    file(SIZE ${source} bytes)
    math(EXPR filled "${filled} + ${bytes}")
    if(NOT folder STREQUAL stage)
      set(stage ${folder})
      set(batch 1)
      set(filled ${bytes})
    elseif(filled GREATER most)
      math(EXPR batch "${batch} + 1")
      set(filled ${bytes})
    endif()
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${stage}_${batch})
  endforeach()
endfunction()
