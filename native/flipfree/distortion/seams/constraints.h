// The constraints of a seamless map, eliminated: which coordinates are free, and how all others
// follow from them without error.
//
// Points of the plane are complex numbers, a quarter turn is i. Across every cut edge the two
// copies of an end point are b = i^r a + t, with one t per cut edge. Going around a vertex of the
// surface, its copies are i^k z + (sum of units times t); coming back, either the turn is whole,
// and a sum of units times t must be zero; or it is not, and z = (such a sum) / (1 - i^s): a cone.
// The sums that must be zero are sparse, most of them of two edges that follow each other, and
// eliminated exactly (numeric/exact_elimination.h). What remains free are the position of one copy
// of each other vertex, and some of the translations: the nodes.
//
// Every vertex of the cut surface is then (sum of Gaussian integers times nodes) / divisor: one
// node with factor 1 almost everywhere, a position and one or a few translations on the far side of
// a seam.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/exact_elimination.h"

namespace flipfree::distortion {

// A map of a surface that is cut open, and what belongs together across the cut: plain data that
// any engine for seamless maps can make.
//
//           b = o's source    a' = h's target
//        ----o<---------    ---------->----         one edge of the surface, seen from both sides;
//             side of o    side of h                half-edges o and h of the cut surface
//
//   uv on the side of o = R^quarter_turns uv on the side of h + translation,   R = (x, y) -> (-y,
//   x)

struct SeamEdge {
  HalfedgeId h = kInvalid;
  HalfedgeId o = kInvalid;
  Index quarter_turns = 0;  // 0 to 3
};

// An edge of the surface that runs along an axis, on its boundary or a feature inside: h's target -
// h's source is a positive multiple of R^direction (1, 0).
struct StraightEdge {
  HalfedgeId h = kInvalid;
  Index direction = 0;  // 0 to 3
};

struct CutMap {
  mesh::Surface surface;        // cut: a vertex for every wedge of the cut; faces as they were
  Points2 uv;                   // #V x 2, of the cut surface's vertices
  std::vector<SeamEdge> seams;  // in order of h, the lower half-edge of each edge
  std::vector<StraightEdge> straight;  // boundary edges: all of a component's, or none
};

// Cuts `surface` along `cuts` and reads the quarter turn of each cut edge that is nearest to the
// map (a tie: the lower one). `corner_uv`: 3 #F x 2; where corners of one wedge differ, the first
// counts. Precondition: valid surface. Cost: O(#F).
CutMap cut_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
               const mesh::EdgeFlags& cuts, const Points2& corner_uv);

// The boundary edges of `surface` with the directions that are nearest to the map, in order.
std::vector<StraightEdge> straight_boundary(const CutMap& map, const mesh::Adjacency& adjacency);

struct NodeTerm {
  Index node = kInvalid;
  numeric::GaussianInteger factor;
};

// What a node of a translation is read off a map by: the mean of i^-turns times the translation
// across each of these seam edges, h's side to o's, for real nodes its first coordinate; or a line.
struct ShiftSource {
  std::vector<std::pair<Index, Index>> edges;  // seam edge, turns
  Index line = kInvalid;
};

struct SeamConstraints {
  // Nodes below are positions: UVs of the cut vertices in `position`, for real nodes their first
  // coordinate after turning by -direction. Nodes from there on are translations.
  std::vector<VertexId> position;
  std::vector<Index> direction;  // per position: 0 where it is not real
  std::vector<ShiftSource> translation;
  std::vector<char> real;  // per node
  // Per line of straight edges: cut vertices on it, and the direction it runs in there; c is the
  // second coordinate after turning by -direction.
  std::vector<std::vector<std::pair<VertexId, Index>>> lines;
  Index position_count() const { return static_cast<Index>(position.size()); }
  Index node_count() const { return static_cast<Index>(position.size() + translation.size()); }

  // Per cut vertex: terms begin[v] to begin[v + 1], to be divided by divisor[v].
  std::vector<Index> begin;
  std::vector<NodeTerm> terms;
  std::vector<std::int64_t> divisor;
  // Are positions integers and translations multiples of this integer, then every vertex is an
  // integer point (2 where there are cones).
  std::int64_t translation_step = 1;

  // The position node of v and the quarter turns by which v follows it; kInvalid of cones.
  std::pair<Index, Index> position_of(VertexId v) const;
  // Is v the very position of its node?
  bool is_own_node(VertexId v) const {
    const NodeTerm& first = terms[at(begin[at(v)])];
    return begin[at(v) + 1] == begin[at(v)] + 1 && first.node < position_count() &&
           position[at(first.node)] == v && real[at(first.node)] == 0 &&
           first.factor == numeric::GaussianInteger{1, 0} && divisor[at(v)] == 1;
  }
};

// Precondition: half-edges and vertices of the map exist.
// Throws InvalidInput (kBadOption) naming the faces at a seam edge whose ends do not pair up,
// NotConverged (kFactorizationFailed) if translations depend on each other through numbers beyond
// 64 bits or grids finer than 2^12 steps.
// Cost: that of the elimination, with one row per vertex of the seams, two per end of a seam at a
// straight boundary and one per crossing of a seam with straight edges or cone on them.
SeamConstraints eliminate_seams(const CutMap& map, const ExecutionContext& context);

// From the free coordinates of a seamless map to the map, and back.

// The nodes of `uv`, another map of the same surface and seams that meets the constraints up to
// rounding: translations are the means over their seam edges' ends, lines those over their
// vertices.
Points2 nodes_of(const SeamConstraints& constraints, const CutMap& map, const Points2& uv);
// The map of given nodes, in floating point.
Points2 map_of(const SeamConstraints& constraints, const Points2& nodes);

}  // namespace flipfree::distortion
