// A map on a refinement of the input whose new vertices lie on the input's edges.
#pragma once

#include <string>
#include <vector>

#include "flipfree/base/types.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

struct RefinedLayout {
  mesh::Surface surface;           // the input's vertices first
  Points2 uv;                      // 3 #F x 2
  mesh::Provenance provenance;     // of faces and vertices
  std::vector<Index> edge_vertex;  // per point of the EdgePointMap: its vertex, kInvalid = left out
  std::vector<FaceId> invalid;     // input faces without a triangulation that is valid as stored
};

// Empty if every face lies in its parent, every parent is covered with the right orientation, and,
// where none is `invalid`, every UV triangle is positive by exact test. Otherwise what is broken.
// Cost: O(#F).
std::string find_broken_invariant(const mesh::Surface& input, const RefinedLayout& layout);

}  // namespace flipfree::intrinsic
