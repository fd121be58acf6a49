// The cuts of all components of a surface, as one refined surface.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/padding.h"

namespace flipfree::seamless {

struct RefinedPieces {
  mesh::Surface surface;        // the input's vertices first; faces component by component
  mesh::Provenance provenance;  // on the input
  // Per component, in the order of their smallest face; faces and half-edges are those of `surface`
  // from the component's first face on, vertices are numbered anew.
  std::vector<AdmissibleCut> cuts;
};

// `cones`: quarter turns per vertex. Cost: that of the cuts.
RefinedPieces cut_components(const mesh::Surface& input, const std::vector<Index>& cones,
                             const CutMaker& make_cut, ExecutionContext& context);

}  // namespace flipfree::seamless
