// Field-Aligned Seamless Map: a map with exactly the topology of a cross field, that follows it
// (thesis 6; design: G1, G2, G4, G5, G6, G7).
//
//   needed_topology()      needed_topology.h               what the map must have
//   divided_sides()        seamless/exact/parts.h         no edge that the boundary flattens
//   engine_map()           field_aligned.cpp               a map that has it
//   take_back()            seamless/exact/take_back.h      on fewer triangles
//   align()                distortion/alignment/align.h    brought to follow the field
//   finish_map()           seamless/exact/seamless_map.h   exact seams, certificate
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/field/compute.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "flipfree/seamless/padding/padding.h"
#include "flipfree/seamless/penner/penner.h"

namespace flipfree::holonomy {

struct AlignedOptions {
  // kAuto: padding where penner finds no map and the surface is closed.
  seamless::Engine which = seamless::Engine::kAuto;
  seamless::PennerOptions engine;  // its own boundary is not looked at
  // Where the surface is open: kAligned, its boundary runs along the axes; else (kFree, kTurning)
  // it is as near to the surface as the inside allows, and turns in all as the field does.
  seamless::Boundary boundary = seamless::Boundary::kAligned;
  bool optimise = true;  // follow the field; else the engine's map, turned to it
  // Edges inside that the field runs along or across: isolines of the optimised map, exactly, where
  // they can be (distortion/alignment/align.h). Pairs that are no edge inside are not looked at.
  IndexPairs features;
  bool exact = true;           // false: seams match up to rounding only
  std::vector<double> sizing;  // #V: length in the map of a length 1 there, relative to the
                               // others, positive; empty: all alike
  // Length on the surface: steps of the border along shorter edges are evened out.
  double ragged = 0.0;
  int max_iterations = 100;  // of the alignment
  // false: with kPadding, loops turn as they happen to, and G6 is not certified. For comparing
  // (thesis table 6.2).
  bool reroute = true;
  double max_seconds = 0.0;  // of the clock; 0: no limit
};

// Any number of components, with or without boundary. Result: certified; G6 on a homology basis of
// the refined surface, and along its boundaries, with the turning numbers that the field has there.
// What an aligned boundary would flatten is divided (seamless/exact/parts.h), counted in
// "divided_chords"; other refinement is taken back before the alignment
// (seamless/exact/take_back.h). Stats: those of the engine and of align(), "engine", "angle_mean"
// and "angle_p95" (distortion::angles_off() by area, radians), "loops_checked", "enlarged_islands"
// (seamless/exact/parts.h); of padding "reroutings.loops" (of homology bases), "reroutings.guided"
// (branches that took the shortest detour between the cones), "reroutings.fallback" (led around
// cones one by one), "reroutings.quarters" (by which loops were off), "reroutings.straight"
// (components whose cut is straight along the field; others have curves as short as they can be).
// Throws InvalidInput (defects; cones of no angle; sizing), Infeasible
// (signatures that no map has), NotConverged, Cancelled.
certify::Parametrization compute_field_aligned_map(const mesh::Surface& surface,
                                                   const field::CrossField& field,
                                                   const AlignedOptions& options,
                                                   ExecutionContext& context);

// The same along the field that `made` says. If that misses features, once more, with vertices on
// edges between them that leave a field no room for cones and a map none to bend: the map that
// misses less of their length. Stats: "divided_between" (those vertices, where they are kept).
// Throws as compute_cross_field() too.
certify::Parametrization compute_map_along_features(const mesh::Surface& surface,
                                                    const field::FieldOptions& made,
                                                    const AlignedOptions& options,
                                                    ExecutionContext& context);

// Sizing at the vertices of a refinement: that of the corners around, in between.
std::vector<double> carried_sizing(const mesh::Surface& surface, const mesh::Provenance& provenance,
                                   const std::vector<double>& sizing);

// The cuts of all components of a surface, as one refined surface.

struct RefinedPieces {
  mesh::Surface surface;        // the input's vertices first; faces component by component
  mesh::Provenance provenance;  // on the input
  // Per component, in the order of their smallest face; faces and half-edges are those of `surface`
  // from the component's first face on, vertices are numbered anew.
  std::vector<seamless::AdmissibleCut> cuts;
};

// All components cut for padding, such that the map that comes of it turns as the field does along
// every loop; without a field (null), as it happens to. `cones`: quarter turns per vertex, the
// field's if there is one. Adds to `done`. Precondition: a closed valid surface. Errors: as
// seamless::make_turning_cut().
RefinedPieces field_cut(const mesh::Surface& surface, const field::CrossField* field,
                        const std::vector<Index>& cones, seamless::Reroutings& done,
                        ExecutionContext& context);

}  // namespace flipfree::holonomy
