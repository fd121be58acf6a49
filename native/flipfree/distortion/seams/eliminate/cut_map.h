// A map of a surface that is cut open, and what belongs together across the cut: plain data that
// any engine for seamless maps can make.
//
//           b = o's source    a' = h's target
//        ----o<---------    ---------->----         one edge of the surface, seen from both sides;
//             side of o    side of h                half-edges o and h of the cut surface
//
//   uv on the side of o = R^quarter_turns uv on the side of h + translation,   R = (x, y) -> (-y,
//   x)
#pragma once

#include <vector>

#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

struct SeamEdge {
  HalfedgeId h = kInvalid;
  HalfedgeId o = kInvalid;
  Index quarter_turns = 0;  // 0 to 3
};

// A boundary edge of the surface that runs along an axis: h's target - h's source is a positive
// multiple of R^direction (1, 0).
struct StraightEdge {
  HalfedgeId h = kInvalid;
  Index direction = 0;  // 0 to 3
};

struct CutMap {
  mesh::Surface surface;        // cut: a vertex for every wedge of the cut; faces as they were
  Points2 uv;                   // #V x 2, of the cut surface's vertices
  std::vector<SeamEdge> seams;  // in order of h, the lower half-edge of each edge
  std::vector<StraightEdge> straight;  // in order of h; empty where the boundary is free
};

// Cuts `surface` along `cuts` and reads the quarter turn of each cut edge that is nearest to the
// map (a tie: the lower one). `corner_uv`: 3 #F x 2; where corners of one wedge differ, the first
// counts. Precondition: valid surface. Cost: O(#F).
CutMap cut_map(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
               const mesh::EdgeFlags& cuts, const Points2& corner_uv);

// The boundary edges of `surface` with the directions that are nearest to the map, in order.
std::vector<StraightEdge> straight_boundary(const CutMap& map, const mesh::Adjacency& adjacency);

}  // namespace flipfree::distortion
