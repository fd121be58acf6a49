// Cross fields for users: smoothest, following curvature, edges or the boundary, or with a
// signature.
//
//   follow_curvature(), follow_edges()  smoothest.h    what each face is asked for
//   sized_frames()                      smoothest.h    for maps of varying size
//   smoothest()                         smoothest.h    directions
//   match_nearest()                     cross_field.h  integers
//   field_with_signature()              prescribed.h   the other way round
//   simplify()                          prescribed.h   fewer cones
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/field/cross_field.h"

namespace flipfree::field {

struct FieldOptions {
  double alignment = 0.0;    // to principal curvatures, in [0, 1)
  IndexPairs edges;          // vertex pairs: edges that the field follows
  bool boundary = true;      // it follows the boundary
  double edge_weight = 1.0;  // of edges and boundary, in (0, 1]; 1: exactly
  // Edges are let go at inner vertices that would have no quarter turn, which no map has, and of
  // connected lines shorter than a 64th of the longest.
  bool let_go = false;
  // #V: length in a map of a length 1 there, relative to the others, positive; empty: all alike.
  std::vector<double> sizing;
  // Merge near cones, but where sizing is given, as these make room; spread those of one quarter
  // turn. Those of none or less, which no map can have, are spread in any case.
  bool simplify = false;
  double reach = 0.05;  // of that merging: SimplifyOptions::reach (prescribed.h)
  // Instead of all that: the field with these cones (#V) and turns.
  std::optional<std::vector<Index>> cones;
  std::optional<std::vector<LoopTurn>> loops;
  double max_seconds = 0.0;  // 0 = never
};

struct FoundField {
  CrossField field;
  std::vector<Index> cones;  // of it, per vertex
  Stats stats;  // "let_go" (edges), "cancelled", "spread" (prescribed.h), "cones", "sharp_cones"
                // (of one quarter turn or less), "seconds"
};

// Any number of components, with or without boundary (prescribed signatures: without). Throws
// InvalidInput (defects; options; edges that are none), Infeasible, NotConverged, Cancelled.
FoundField compute_cross_field(const mesh::Surface& surface, const FieldOptions& options,
                               ExecutionContext& context);

// A field as users give it: vectors in the faces (#F x 3), and how they go together: by a rotation
// form (3 #F), else by quarters (3 #F; cross_field.h), else, both empty, each with the
// nearest. Without directions: those of the rotation form. Validates the surface. Throws
// InvalidInput, Cancelled.
struct GivenField {
  Points3 directions;
  std::vector<double> rotation;
  std::vector<Index> quarters;
};
CrossField read_field(const mesh::Surface& surface, const GivenField& given,
                      const ExecutionContext& context);

// The same, of a field.
GivenField describe(const mesh::Surface& surface, const CrossField& field);

}  // namespace flipfree::field
