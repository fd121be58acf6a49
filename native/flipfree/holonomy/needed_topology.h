// The cones and turns that a map must have to follow a cross field, on surfaces with and without
// boundary.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/field/cross_field.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::holonomy {

struct NeededTopology {
  // Per vertex, quarter turns. At boundary vertices those between the edges, each taken for the
  // nearest of the field's directions; aligned: corners that no map has, and pairs of neighbours of
  // which one bends in and the other out, are evened out, so that none is less than 1.
  std::vector<Index> cones;
  // As compute_penner_metric() takes them: of each component a homology basis, with its boundaries
  // contracted, and where these are aligned strips from one to each other one.
  std::vector<intrinsic::LoopTurn> loops;
  // Per half-edge at a boundary: which of the field's directions it runs along, counted from that
  // of its face, in quarter turns.
  std::vector<Index> border;
};

// `ragged`: such pairs are evened out at the ends of edges that are shorter even where the surface
// has them. Precondition: a valid surface. Throws Cancelled. Cost: O(#F log #F).
NeededTopology needed_topology(const mesh::Surface& surface, const field::CrossField& field,
                               bool aligned, double ragged, const ExecutionContext& context);

// Loops of a refined surface as loops of the surface that it refines: for judging a map by loops
// that its maker has not seen, and for asking for turns on a surface with some of its edges
// divided.

using intrinsic::DualLoop;

struct Refinement {
  const mesh::Surface& input;
  const mesh::Surface& surface;
  const std::vector<FaceId>& parent_face;  // per face of `surface` (certify::Parametrization)

  // The half-edge 3 f + k of the input's face f = parent_face[h / 3] across which half-edge h of
  // the refinement leaves it, at the boundary too; kInvalid if it stays inside. Cost: O(1).
  HalfedgeId input_halfedge(HalfedgeId h) const;
  // The loop's homotopy class beside all vertices of the input, as a strip of its faces that does
  // not turn back; empty if it shrinks to a point in a face. `closed`: false for a strip between
  // boundaries. Cost: O(loop).
  DualLoop projected(const DualLoop& loop, bool closed = true) const;
};

// NeededTopology::loops on a refinement. `cones`: of the refinement, quarter turns; `border`: of
// the input. Cost: O(#F log #F).
std::vector<intrinsic::LoopTurn> turned_loops(const Refinement& refined,
                                              const std::vector<Index>& cones,
                                              const field::CrossField& field,
                                              const std::vector<Index>& border, bool aligned,
                                              const ExecutionContext& context);

}  // namespace flipfree::holonomy
