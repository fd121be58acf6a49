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

#include <cstdint>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/seams/eliminate/cut_map.h"
#include "flipfree/numeric/exact_elimination.h"

namespace flipfree::distortion {

struct NodeTerm {
  Index node = kInvalid;
  numeric::GaussianInteger factor;
};

// What a node of a translation is read off a map by.
struct ShiftSource {
  enum class Part : std::uint8_t { kWhole, kReal, kImaginary, kLine };
  Index place = kInvalid;  // seam edge: h's side to o's; or, for kLine, a line
  Part part = Part::kWhole;
};

struct SeamConstraints {
  // Nodes below are positions: UVs of the cut vertices in `position`, for real nodes their first
  // coordinate after turning by -direction. Nodes from there on are translations.
  std::vector<VertexId> position;
  std::vector<Index> direction;  // per position: 0 where it is not real
  std::vector<ShiftSource> translation;
  std::vector<char> real;  // per node
  // Per line of the boundary: cut vertices on it, and the direction it runs in there; c is the
  // second coordinate after turning by -direction.
  std::vector<std::vector<std::pair<VertexId, Index>>> lines;
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
           position[static_cast<std::size_t>(terms[first].node)] == v &&
           real[static_cast<std::size_t>(terms[first].node)] == 0 &&
           terms[first].factor == numeric::GaussianInteger{1, 0} &&
           divisor[static_cast<std::size_t>(v)] == 1;
  }
};

// `vertex_count` and `faces` of the cut surface. Throws InvalidInput (kBadOption) naming the faces
// at a seam edge whose ends do not pair up, NotConverged (kFactorizationFailed) if translations
// depend on each other through numbers beyond 64 bits or grids finer than 2^12 steps.
// Cost: O(#seams log #seams) plus the elimination, with one row per joint and two per end of a seam
// at a straight boundary. `straight`: all boundary edges, or none.
SeamConstraints eliminate_seams(Index vertex_count, const Triangles& faces,
                                const std::vector<SeamEdge>& seams,
                                const std::vector<StraightEdge>& straight,
                                const ExecutionContext& context);

// The same with a free boundary.
SeamConstraints eliminate_seams(Index vertex_count, const Triangles& faces,
                                const std::vector<SeamEdge>& seams,
                                const ExecutionContext& context);

}  // namespace flipfree::distortion
