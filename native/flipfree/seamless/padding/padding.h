// The engine "padding" (thesis 5): a seamless map in doubles from cones, up to the rounding of its
// metric; always there, whatever the genus.
//
//   make_admissible_cut()    cut into disks with right-angled corners   topology.h
//   compute_padded_metric()  rectilinear metrics, padded and glued      padded_metric.h
//   finish_penner_metric()   rounding removed, then relaxed             penner/penner_metric.h
//   then overlay and layout as of the engine "penner"                   penner/penner.h
//
// The map is one of the surface as the cut refined it, refined further where a triangle would flip.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/segments.h"
#include "flipfree/seamless/penner/penner.h"

namespace flipfree::seamless {

// Finds the cut of one connected surface (topology.h), a component of the input: its face f, with
// the same corners, is the input's face faces[f].
using CutMaker =
    std::function<AdmissibleCut(const mesh::Surface& surface, const std::vector<Index>& cones,
                                const std::vector<FaceId>& faces, ExecutionContext& context)>;

// A map of a surface that was refined into these faces as one of the input: its provenance is put
// together. The certificate is left as it is.
void name_input_places(const mesh::Surface& input, const mesh::Provenance& provenance,
                       const Triangles& refined, certify::Parametrization& map);

// `cones`: quarter turns per vertex, 4 where it is flat. options.solver is not looked at. Surfaces
// of genus 0 have their conformal metric. Stats: those of compute_penner_map(),
// "padding_components" (pieces of the cut), "padding_width" (largest, over the longest segment),
// "padding_near_steps", "cut_vertices" (that the cut added). Errors: as compute_penner_map(),
// NotConverged where the cut or a piece's metric is not reached.
PennerMap compute_padding_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                              const CutMaker& make_cut, const PennerMapOptions& options,
                              ExecutionContext& context);

}  // namespace flipfree::seamless
