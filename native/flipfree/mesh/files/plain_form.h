// What OpenMesh's readers do not check is checked here, and what they do not keep is kept.
//
// Tried with OpenMesh 9 (benchmarks/openmesh_alone.cpp): an OBJ face `/1` aborts the process;
// `mtllib` opens any file; positions are rounded to 32 bits; a corner that repeats a vertex shifts
// the texture coordinates of the others; a PLY header without an end is read forever; PLY lists
// other than the faces', and bytes in ASCII, put all that follows out of step; STL believes any
// number of triangles. So every file is read strictly first, positions are taken from there, and
// OpenMesh gets the plain form: a file of the same format that says the same with nothing but
// positions (zeros, but for STL, where they decide what is one vertex), texture coordinates and
// polygons.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

struct PlainForm {
  std::string text;            // for OpenMesh
  const char* extension = "";  // that tells it which reader to take, ".obj"
  bool binary = false;
  Points3 positions;   // as written; no rows for STL
  Index polygons = 0;  // how many faces OpenMesh must find; STL: at most
  // Which of the file's faces each of these is: those with fewer than three corners are passed
  // over. None for STL: all.
  std::vector<Index> numbers;
  // A vertex that a face uses again is another one for OpenMesh, which passes over it otherwise:
  // behind the positions, the vertices that these are.
  std::vector<Index> again;
  bool corner_uv = false;  // a polygon has texture coordinates
  bool vertex_uv = false;  // vertices have
};

// Each throws InvalidInput (kBadFile), naming the line or element.
PlainForm plain_obj(std::string_view bytes);
PlainForm plain_off(std::string_view bytes);
PlainForm plain_ply(std::string_view bytes);
PlainForm plain_stl(std::string_view bytes);

}  // namespace flipfree::mesh
