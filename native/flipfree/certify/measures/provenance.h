// G7: a refined mesh subdivides the input.
#pragma once

#include <string>
#include <vector>

#include "flipfree/mesh/surface.h"

namespace flipfree::certify {

struct Provenance {
  const mesh::Surface* parent;
  const std::vector<FaceId>* parent_face;
  const std::vector<FaceId>* vertex_parent;
  const Points3* vertex_barycentric;
};

struct ProvenanceReport {
  std::int64_t failures = 0;
  std::string first;  // what is wrong at the first of them
  std::vector<FaceId>
      faces;  // of the refined mesh, first parts of parents that are not covered included; <= 1000
};

// The parent's vertices come first, bit for bit; every further vertex lies at its barycentric
// weights; every face lies in its parent face, positively oriented, and the faces of one parent
// cover exactly its area (kProvenanceTolerance). Faces of one parent are glued along every edge
// inside it, and along its sides to faces of the parent across; so areas that add up to the
// parent's cover it once. Precondition: both surfaces are manifold. Cost: O(#F).
ProvenanceReport check_provenance(const mesh::Surface& refined, const Provenance& provenance);

}  // namespace flipfree::certify
