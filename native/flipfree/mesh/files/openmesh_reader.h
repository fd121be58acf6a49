// A plain form through OpenMesh's reader of its format.
#pragma once

#include <vector>

#include "flipfree/mesh/files/plain_form.h"

namespace flipfree::mesh {

struct Polygons {
  std::vector<Index> corners;   // vertices of one polygon behind those of another
  std::vector<Index> begin{0};  // #polygons + 1, where each one's corners begin
  std::vector<float> uv;        // 2 a corner, NaN where a polygon has none; empty if none has
  Points3 positions;            // 32-bit ones, of STL; else none
};

// InternalError if OpenMesh does not find what the plain form has, which is ours.
Polygons read_with_openmesh(const PlainForm& plain);

}  // namespace flipfree::mesh
