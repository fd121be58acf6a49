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
// period jump. All that is topological - cones, turning numbers - follows from the integers alone.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/loops.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::field {

struct CrossField {
  std::vector<double> angle;    // #F: of one of the directions, from half-edge 3 f, radians
  std::vector<Index> matching;  // 3 #F: antisymmetric; 0 on the boundary
};

// The angles of a surface, which must outlive them, in which fields are measured.
struct Frames {
  const mesh::Surface& surface;
  std::vector<double> corner;     // 3 #F: angle of the triangle there
  std::vector<double> direction;  // 3 #F: of each half-edge in its face
};
// Precondition: no face of zero area. Cost: O(#F).
Frames measure_frames(const mesh::Surface& surface);

// d(h) above.
inline double from_edge(const Frames& frames, const std::vector<double>& angle, HalfedgeId h) {
  return angle[at(h / 3)] - frames.direction[at(h)];
}

// d(h), to the nearest quarter turn.
Index nearest_quarter(const Frames& frames, const CrossField& field, HalfedgeId h);

// The field with these directions whose rotation lies in [-pi/4, pi/4] across every edge: every
// direction goes with the nearest one. Ties are decided once per edge. Cost: O(#F).
CrossField match_nearest(const Frames& frames, std::vector<double> angle);

// rotation(h) of every half-edge (3 #F), radians; 0 on the boundary. Cost: O(#F).
std::vector<double> rotation_form(const Frames& frames, const CrossField& field);

// The field of a rotation form, up to one turn of all directions of a component. Throws
// InvalidInput (kBadAngles) naming the edge where the form is not antisymmetric, or not that of a
// cross field: it may be off by 1e-6 radians. Cost: O(#F).
CrossField field_of_rotation(const Frames& frames, const std::vector<double>& rotation);

// The field with these directions, matched as a rotation form says. Throws as the above.
CrossField match_by_rotation(const Frames& frames, std::vector<double> angle,
                             const std::vector<double>& rotation);

// As users see it: the direction of h's face goes with that of the neighbour across h turned
// counter-clockwise by so many quarter turns, 0 to 3 (3 #F; 0 on the boundary). It tells no whole
// turns; fields that turn by half a turn or more across an edge have some.
std::vector<Index> quarters_across(const mesh::Surface& surface, const CrossField& field);
// The field with these directions and quarters, of any size, whose rotation lies in [-pi, pi).
// Throws InvalidInput (kBadOption) naming the edge whose two sides do not agree.
CrossField match_by_quarters(const Frames& frames, std::vector<double> angle,
                             const std::vector<Index>& quarters);

// Unit vectors in the planes of the faces (#F x 3), and back. Vectors that lie askew are projected.
// Throws InvalidInput (kBadAngles) naming the faces whose vector is not finite or has no part in
// the plane. Cost: O(#F).
Points3 directions_of(const mesh::Surface& surface, const std::vector<double>& angle);
std::vector<double> angles_of(const mesh::Surface& surface, const Points3& directions);

// How much neighbouring faces are tied to each other when a field is smoothed.

// Per face. Cost: O(#F).
std::vector<double> face_areas(const mesh::Surface& surface);

// Per half-edge, the same on both sides: 3 |e|^2 / (2 (area_f + area_g)), the edge's length over
// the distance of the two centres; 0 on the boundary. Bounded, 1e-5 to 1e5: needles would drown
// what their neighbours say in rounding. Cost: O(#F).
std::vector<double> edge_weights(const mesh::Surface& surface, const std::vector<double>& area);

// What is topological about a cross field: cones and turning numbers, counted in whole quarter
// turns from its matching alone. No angle is looked at, so nothing is rounded.
//
// Along a dual loop (intrinsic/loops.h) a flat metric that the field is parallel in
// turns by (sum of signed corner angles) + (sum of rotations across). Angles of the field and
// directions of edges cancel in that sum; what stays are the matchings, and 2 quarter turns with a
// sign for every corner: that of (direction(out) - direction(in) -+ corner) = +- pi. So turning
// numbers are the holonomy numbers of thesis 6.2 that a map must have to follow the field.

// On the surface's faces: half-edges 3 f + k.
using intrinsic::DualLoop;
using intrinsic::LoopTurn;

// Quarter turns k of the total angle of every vertex: 4 where the field is regular. On the boundary
// those of the field between the two boundary edges, each taken for the nearest of its directions:
// 2 where it goes straight on. Their sum along a boundary loop depends on the matching alone.
// 4 and 2 at vertices without faces. Cost: O(#F).
std::vector<Index> cone_turns(const Frames& frames, const CrossField& field);

// What a strip adds to the turn of a loop in the face that it enters by the half-edge `entered` of
// that face and leaves by another one of it, without the matching across.
Index turn_at_corner(HalfedgeId entered, HalfedgeId leaving);

// Precondition: a closed strip that does not turn back. Cost: O(loop).
Index turning_number(const mesh::Surface& surface, const CrossField& field, const DualLoop& loop);

// The strips of faces along each boundary loop, which runs on their right hand, in the order of
// mesh::boundary_loops(); empty where the strip shrinks to a point. Cost: O(#F).
std::vector<DualLoop> boundary_strips(const mesh::Surface& surface);

struct Signature {
  std::vector<Index> cones;     // #V
  std::vector<LoopTurn> loops;  // 2 g of a homology basis, then those along the boundary
};

// Of all components. Precondition: a valid surface. Cost: O(#F log #F) and the loops.
Signature signature_of(const mesh::Surface& surface, const CrossField& field,
                       const ExecutionContext& context);

}  // namespace flipfree::field
