// Cross fields: in every face four directions of the plane, a quarter turn apart, and across every
// edge which of them belong together.
//
//   half-edge h = 3 f + k, o = opposite(h) = 3 g + l
//   direction(h)  of h in the plane of f, from half-edge 3 f, counter-clockwise:
//                 0 for k = 0, pi - (corner 1) for k = 1, pi + (corner 0) for k = 2
//   d(h) = angle(f) - direction(h): from the edge to the field, in the face on the left of h
//   rotation(h) = d(h) - d(o) + matching(h) pi / 2: by how much the field turns from g to f, as
//                 parallel transport sees it. Antisymmetric: rotation(o) = -rotation(h).
//
// That is the rotation form of thesis 6.3.1 and of Ray, Vallet, Li, Levy 2008; the matching is the
// period jump. All that is topological - cones, turning numbers - follows from the integers alone
// (turning.h).
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::field {

struct CrossField {
  std::vector<double> angle;    // #F: of one of the directions, from half-edge 3 f, radians
  std::vector<Index> matching;  // 3 #F: antisymmetric; 0 on the boundary
};

// The angles of a surface in which fields are measured.
struct Frames {
  std::vector<double> corner;     // 3 #F: angle of the triangle there
  std::vector<double> direction;  // 3 #F: of each half-edge in its face
};
// Precondition: no face of zero area. Cost: O(#F).
Frames measure_frames(const mesh::Surface& surface);

// d(h) above.
inline double from_edge(const Frames& frames, const std::vector<double>& angle, HalfedgeId h) {
  return angle[static_cast<std::size_t>(h / 3)] - frames.direction[static_cast<std::size_t>(h)];
}

// The field with these directions whose rotation lies in [-pi/4, pi/4] across every edge: every
// direction goes with the nearest one. Ties are decided once per edge. Cost: O(#F).
CrossField match_nearest(const mesh::Adjacency& adjacency, const Frames& frames,
                         std::vector<double> angle);

// rotation(h) of every half-edge (3 #F), radians; 0 on the boundary. Cost: O(#F).
std::vector<double> rotation_form(const mesh::Adjacency& adjacency, const Frames& frames,
                                  const CrossField& field);

// The field of a rotation form, up to one turn of all directions of a component. Throws
// InvalidInput (kBadAngles) naming the edge where the form is not antisymmetric, or not that of a
// cross field: it may be off by `tolerance` radians. Cost: O(#F).
CrossField field_of_rotation(const mesh::Adjacency& adjacency, const Frames& frames,
                             const std::vector<double>& rotation, double tolerance = 1e-6);

// The field with these directions, matched as a rotation form says. Throws as the above.
CrossField match_by_rotation(const mesh::Adjacency& adjacency, const Frames& frames,
                             std::vector<double> angle, const std::vector<double>& rotation,
                             double tolerance = 1e-6);

// As users see it: the direction of h's face goes with that of the neighbour across h turned
// counter-clockwise by so many quarter turns, 0 to 3 (3 #F; 0 on the boundary). It tells no whole
// turns; fields that turn by half a turn or more across an edge have some.
std::vector<Index> quarters_across(const mesh::Adjacency& adjacency, const CrossField& field);
// The field with these directions and quarters, of any size, whose rotation lies in [-pi, pi).
// Throws InvalidInput (kBadOption) naming the edge whose two sides do not agree.
CrossField match_by_quarters(const mesh::Adjacency& adjacency, const Frames& frames,
                             std::vector<double> angle, const std::vector<Index>& quarters);

// Unit vectors in the planes of the faces (#F x 3), and back. Vectors that lie askew are projected.
// Throws InvalidInput (kBadAngles) naming the faces whose vector is not finite or has no part in
// the plane. Cost: O(#F).
Points3 directions_of(const mesh::Surface& surface, const std::vector<double>& angle);
std::vector<double> angles_of(const mesh::Surface& surface, const Points3& directions);

// How much neighbouring faces are tied to each other when a field is smoothed.

// Per face. Cost: O(#F).
std::vector<double> face_areas(const mesh::Surface& surface);
// Square root of the sum: what lengths are measured in where the surface's size shall not matter.
double extent_of(const mesh::Surface& surface);

// Per half-edge, the same on both sides: 3 |e|^2 / (2 (area_f + area_g)), the edge's length over
// the distance of the two centres; 0 on the boundary. Bounded, 1e-5 to 1e5: needles would drown
// what their neighbours say in rounding. Cost: O(#F).
std::vector<double> edge_weights(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                 const std::vector<double>& area);

}  // namespace flipfree::field
