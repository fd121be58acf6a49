// Bytes read as maps of small surfaces to the plane: most are valid or nearly so, with charts on
// top of each other, slits turned inside out, corners that touch, and coordinates that differ by a
// bit.
#pragma once

#include "bytes.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::fuzz {

struct PlanarMap {
  mesh::Surface surface;
  mesh::CutMesh cut;
  Points2 uv;  // per vertex of the cut mesh
  Points2 corner_uv() const;
};

// At most some 40 triangles. All of them positive unless `may_flip`.
PlanarMap read_planar_map(Bytes& bytes, bool may_flip);

}  // namespace flipfree::fuzz
