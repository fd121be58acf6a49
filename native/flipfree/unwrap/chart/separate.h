// Which triangles of a chart lie on top of each other in a map of it.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::unwrap {

struct FacePair {
  FaceId first = kInvalid, second = kInvalid;  // ascending
  double area = 0;                             // in common, rounded
};

// Pairs of triangles whose interiors meet, decided exactly; ascending. uv: #V x 2. Precondition:
// every triangle is positive. Cost: O(#F log #F + #pairs).
std::vector<FacePair> overlapping_faces(const Triangles& faces, const Points2& uv,
                                        const ExecutionContext& context);

// Flags of edges along which the chart falls into pieces. The area by which triangles of one piece
// overlap in the map `uv` is at most the share `tolerated` of the piece's; with 0, no two triangles
// of a piece are a pair of `overlapping`, which is overlapping_faces() of the map. The cuts are
// short, the rather along creases, where they show less: each is a minimum cut between triangles
// that lie on top of each other (Boykov, Kolmogorov 2004, through Boost); then neighbouring pieces
// that do not lie on top of each other are joined again. Edges flagged in `uncuttable` (may be
// empty) are cut only where nothing else separates a pair. Deterministic. Cost: a few minimum cuts
// of the faces' graph.
mesh::EdgeFlags separating_cut(const mesh::Surface& chart, const Points2& uv,
                               const std::vector<FacePair>& overlapping, double tolerated,
                               const mesh::EdgeFlags& uncuttable, ExecutionContext& context);

// Flags of a short cut between the two ends of the chart's map (#V x 2). Faces with an `uncuttable`
// edge between them (may be empty) stay together, and faces that are but lines, which cannot be
// stored alone, stay with a neighbour unless thin_alone; all 0 where nothing else is left. Cost:
// that of separating_cut().
mesh::EdgeFlags halving_cut(const mesh::Surface& chart, const Points2& uv,
                            const mesh::EdgeFlags& uncuttable, bool thin_alone,
                            ExecutionContext& context);

}  // namespace flipfree::unwrap
