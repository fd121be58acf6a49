// A surface all of whose components were cut, and refined for it.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/seamless/padding/admissible_cut.h"

namespace flipfree::seamless {

// Finds the cut of one connected surface (topology/topology.h), a component of the input: its face
// f, with the same corners, is the input's face faces[f].
using CutMaker =
    std::function<AdmissibleCut(const mesh::Surface& surface, const std::vector<Index>& cones,
                                const std::vector<FaceId>& faces, ExecutionContext& context)>;

struct RefinedPieces {
  mesh::Surface surface;        // the input's vertices first; faces component by component
  mesh::Provenance provenance;  // on the input
  std::vector<Index> cones;     // per vertex
  // Per component, in the order of their smallest face; faces and half-edges are those of `surface`
  // from first_face on, vertices are numbered anew.
  std::vector<AdmissibleCut> cuts;
};

// Cost: that of the cuts.
RefinedPieces cut_components(const mesh::Surface& input, const std::vector<Index>& cones,
                             const CutMaker& make_cut, ExecutionContext& context);

// A map of pieces.surface as one of the input: its provenance is put together. The certificate is
// left as it is.
void name_input_places(const mesh::Surface& input, const RefinedPieces& pieces,
                       certify::Parametrization& map);

}  // namespace flipfree::seamless
