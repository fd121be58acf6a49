// The engine "padding" (thesis 5): a seamless map in doubles from cones, up to the rounding of its
// metric; always there, whatever the genus.
//
//   make_admissible_cut()   cut into disks with right-angled corners   admissible_cut.cpp
//   padded_metric()         rectilinear metrics, padded and glued      padding.cpp
//   finish_penner_metric()  rounding removed, then relaxed             penner/penner.h
//   then overlay and layout as of the engine "penner"                  penner/penner.h
//
// The map is one of the surface as the cut refined it, refined further where a triangle would flip.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/disk_metric.h"
#include "flipfree/seamless/padding/reroute.h"
#include "flipfree/seamless/penner/penner.h"

namespace flipfree::seamless {

// Finds the cut of one connected surface, a component of the input: its face f, with
// the same corners, is the input's face faces[f].
using CutMaker =
    std::function<AdmissibleCut(const mesh::Surface& surface, const std::vector<Index>& cones,
                                const std::vector<FaceId>& faces, ExecutionContext& context)>;

// `cones`: quarter turns per vertex, 4 where it is flat. Surfaces
// of genus 0 have their conformal metric. Stats: those of compute_penner_map(). Errors: as
// compute_penner_map(), NotConverged where the cut or a piece's metric is not reached.
PennerMap compute_padding_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                              const CutMaker& make_cut, const PennerOptions& options,
                              ExecutionContext& context);

// Cuts that make a closed surface with cones ready for padding (thesis 5.3, 5.4.1).
//
//   genus 0                   no cut at all
//   cones all multiples of 4  hole chain: one component (Proposition 10); so no cones on a torus
//   genus 1, 2                chain with two T-nodes, joined by a path: all nodes have four
//   branches genus 3 and more          hole chain and an extra path (Proposition 11) otherwise hole
//   chain and a loop around a cone with k = 1
//
// On surfaces of many handles curves are led by the cones, with turns to be met along the field
// (hole_chain.h); where such a chain is not found, they are as short as they can be.
//
// A cut all of whose nodes have four branches can be equalized if no component has a multiple of
// four corners: its matrix has full row rank (Lemma 5.10 for both components at once), and the
// vector of ones in its kernel. That the thesis lists patterns for parts with 2, 3, 5, 6 and 7
// corners but not with one is why cones as (1, 7) on a torus or (1, 15) on genus 2 are missing
// there.

// `surface`: closed, connected, valid. `cones`: #V, quarter turns k of every vertex, 4 where it is
// flat. The cut's surface has the input's vertices first; new ones halve edges. The same input
// gives the same cut. Throws InvalidInput (kBadAngles) for k < 1, Infeasible (kGaussBonnet,
// kBadAngles) if no surface of this genus has such cones, NotConverged naming the step if doubles
// leave no room for it. Cost: O(genus #F log #F), mostly much less.
// The faces' names are not looked at.
AdmissibleCut make_admissible_cut(const mesh::Surface& surface, const std::vector<Index>& cones,
                                  const std::vector<FaceId>& faces, ExecutionContext& context);

// The same with loops that turn as `wished` says, which must be so for a cross field with exactly
// these cones; also where there are no cones at all. Throws NotConverged (kBadAngles) besides where
// the excesses of all cones have a common divisor that keeps this cut from it.
AdmissibleCut make_turning_cut(const mesh::Surface& surface, const std::vector<Index>& cones,
                               const WishedTurns& wished, ExecutionContext& context);

}  // namespace flipfree::seamless
