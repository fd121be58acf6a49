// A disk as a star with a pin at the end of each arm: the coarse map behind arms.h.
//
//        circle                      plane
//         .--t--.                         t
//       b' \ | / b                  b'--------.
//       |   `p'  |            C     q          p t
//       t p- c -p t                 b---------'
//        `--...--'                        t
//
// Seen from a point c of the disk the pins p have an order. Between one and the next the boundary
// (at b) is drawn in to a hub around c, whose side faces the targets; from there a straight arm
// leads to each of them, and the boundary (t) goes around its pin.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "flipfree/matchmaker/at_once/mesh_overlay.h"
#include "flipfree/matchmaker/request/constraints.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

// The pins as they are seen from a point of the disk.
struct StarView {
  Vector2 centre = Vector2::Zero();
  std::vector<std::size_t> order;  // of the pins, counter-clockwise
  std::vector<double> angle;       // in this order, ascending
};

// Views from a grid of points in the unit disk; those from where two pins lie in one direction are
// left out.
std::vector<StarView> star_views(const std::vector<Vector2>& pins);

// The star of a view, positive on both sides by exact test, the pins at their targets bit for bit.
// Its vertices are those of the boundary, the pins and some others; it has some twenty triangles
// per pin and one per boundary edge. Precondition: disk.uv is flip-free with a convex boundary;
// free boundary, no lines. Where the boundary is short of vertices, edges are split, in
// `disk`. Nothing if doubles do not tell the star's points apart. Cost: O(#boundary) per split,
// and O(#pins^2) for the side on which the hub lies.
std::optional<PlaneMap> make_star(mesh::RefinedMap& disk, const Constraints& constraints,
                                  const StarView& view, const ExecutionContext& context);

}  // namespace flipfree::matchmaker
