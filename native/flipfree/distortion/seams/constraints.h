// The constraints of a seamless map, eliminated: which coordinates are free, and how all others
// follow from them without error.
//
// Points of the plane are complex numbers, a quarter turn is i. Across every cut edge the two
// copies of an end point are b = i^r a + t, with one t per branch (a chain of cut edges that
// nothing else joins). Going around a vertex of the surface, its copies are i^k z + (sum of units
// times t); coming back, either the turn is whole, and a sum of units times t must be zero; or it
// is not, and z = (such a sum) / (1 - i^s): a cone. The sums that must be zero are few, one per
// joint of the cut graph, sparse, and eliminated exactly (numeric/exact_elimination.h). What
// remains free are the position of one copy of each other vertex, and some of the translations: the
// nodes.
//
// Every vertex of the cut surface is then (sum of Gaussian integers times nodes) / divisor: one
// node with factor 1 almost everywhere, a position and one or a few translations on the far side of
// a seam.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/seams/cut_map.h"
#include "flipfree/numeric/exact_elimination.h"

namespace flipfree::distortion {

struct NodeTerm {
  Index node = kInvalid;
  numeric::GaussianInteger factor;
};

struct SeamConstraints {
  // Nodes below are positions: UVs of the cut vertices in `position`. Nodes from there on are
  // translations: of the seam edges in `translation`, h's side to o's.
  std::vector<VertexId> position;
  std::vector<Index> translation;
  Index position_count() const { return static_cast<Index>(position.size()); }
  Index node_count() const { return static_cast<Index>(position.size() + translation.size()); }

  // Per seam edge: the edge that stands for its branch, and the unit by which the translation of
  // that one is to be multiplied to get its own.
  std::vector<Index> branch;
  std::vector<numeric::GaussianInteger> branch_unit;

  // Per cut vertex: terms begin[v] to begin[v + 1], to be divided by divisor[v].
  std::vector<Index> begin;
  std::vector<NodeTerm> terms;
  std::vector<std::int64_t> divisor;
  // Are positions integers and translations multiples of this integer, then every vertex is an
  // integer point (2 where there are cones).
  std::int64_t translation_step = 1;

  // Is v the very position of its node?
  bool is_own_node(VertexId v) const {
    const auto first = static_cast<std::size_t>(begin[static_cast<std::size_t>(v)]);
    return begin[static_cast<std::size_t>(v) + 1] == begin[static_cast<std::size_t>(v)] + 1 &&
           terms[first].node < position_count() &&
           terms[first].factor == numeric::GaussianInteger{1, 0} &&
           divisor[static_cast<std::size_t>(v)] == 1;
  }
};

// `vertex_count` and `faces` of the cut surface. Throws InvalidInput (kBadOption) naming the faces
// at a seam edge whose ends do not pair up, NotConverged (kFactorizationFailed) if translations
// depend on each other through numbers beyond 64 bits or grids finer than 2^12 steps.
// Cost: O(#seams log #seams) plus the elimination, with one row per joint.
SeamConstraints eliminate_seams(Index vertex_count, const Triangles& faces,
                                const std::vector<SeamEdge>& seams,
                                const ExecutionContext& context);

// The nodes of a map that meets the constraints up to rounding: translations are the means over
// their seam edges' ends.
Points2 nodes_of(const SeamConstraints& constraints, const Triangles& faces,
                 const std::vector<SeamEdge>& seams, const Points2& uv);
// The map of given nodes, in floating point.
Points2 map_of(const SeamConstraints& constraints, const Points2& nodes);

}  // namespace flipfree::distortion
