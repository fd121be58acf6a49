// The polygons of a file, by a strict reader for each format.
//
// OpenMesh's own readers serve STL alone, whose vertices have to be found. Of the others (tried
// with OpenMesh 9): an OBJ face `/1` aborts the process; `mtllib` opens any file; positions are
// rounded to 32 bits; a corner that repeats a vertex shifts the texture coordinates of the others;
// a PLY header without an end is read forever; PLY lists other than the faces', and bytes in ASCII,
// put all that follows out of step.
#pragma once

#include <string_view>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct FilePolygons {
  Points3 positions;            // as written; of STL one for each place
  std::vector<Index> corners;   // vertices of one polygon behind those of another
  std::vector<Index> begin{0};  // #polygons + 1, where each one's corners begin
  // Which of the file's faces each of these is: those with fewer than three corners are passed
  // over. None for STL: all.
  std::vector<Index> numbers;
  std::vector<float> uv;  // 2 a corner, NaN where there are none; empty if the format has none
};

// Each throws InvalidInput (kBadFile), naming the line or element.
FilePolygons read_obj(std::string_view bytes);
FilePolygons read_off(std::string_view bytes);
FilePolygons read_ply(std::string_view bytes);
FilePolygons read_stl(std::string_view bytes);

}  // namespace flipfree::mesh
