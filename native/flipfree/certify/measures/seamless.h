// G4: are the two sides of every cut related by a quarter turn and a translation, exactly?
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph/cut.h"

namespace flipfree::certify {

// Half-edges of cut edges (the lower of the two) whose UV vector is no exact quarter turn of the
// one on the other side. Differences are compared without rounding, so equality means equality of
// real numbers.
std::vector<HalfedgeId> seam_failures(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                                      const Points2& corner_uv);

}  // namespace flipfree::certify
