// Where the boundary of a seamless map has its corners, if nobody says so.
//
// An aligned curve runs along the axes: each of its edges has one of four directions, and where
// that changes there is a corner. The edges get the directions that lie nearest to their own,
// corners where these are sharp, and as many more as the turning asks for; found by dynamic
// programming along the curve. A corner costs so much that short teeth are ridden over.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Angles at the boundary of a seamless map, in quarter turns.
//
// A seamless map of a surface with boundary is a flat metric on its double whose cones and loops
// turn by quarters. Aligned: the boundary is straight but for corners of whole quarters, so that it
// runs along the axes; sum over inner vertices (4 - k) + sum over boundary vertices (2 - k) = 4 chi
// (Gauss-Bonnet). Free: its angles are any, and each curve of it turns by whole quarters in all.

enum class Boundary {
  kAligned,        // straight along the axes, corners in quarter turns
  kAlignedOrFree,  // free in connected parts for which no aligned map is found
  kFree,           // as near to the surface's own metric as the inside allows
  kTurning,        // the same, but every curve of it turns in all as the given corners do
  kGiven,          // aligned in connected parts whose boundary angles are all given, free in others
};

// An angle that is not given: inside, the vertex is flat.
inline constexpr Index kNotGiven = 0;

// InvalidInput (kBadAngles) naming the vertex: no cone has less than one quarter turn.
[[noreturn]] void throw_too_sharp(VertexId v, Index quarter_turns);
// Infeasible (kGaussBonnet): `what` sum, `but` needed; `whose` quarter turns k are to be others.
[[noreturn]] void throw_angle_sum(const std::string& what, std::int64_t sum, const std::string& but,
                                  std::int64_t needed, const std::string& whose);

// `cones` with 4, flat, where nothing is given inside. No vertex without a face.
std::vector<Index> flat_inside(std::vector<Index> cones, const mesh::Surface& surface);

// `cones`: quarter turns per vertex of a connected surface; kNotGiven at boundary vertices, or what
// the caller wants there. Returns them with all boundary vertices given: if the caller gave any,
// the others are straight (2); else corners are put where the boundary is sharp, and what
// Gauss-Bonnet then asks for is spread along its curves; the same for every size of the surface.
// Closed surfaces: as they are. Throws InvalidInput (kBadAngles) for k < 1, Infeasible
// (kGaussBonnet) with what is missing, Cancelled.
std::vector<Index> aligned_cones(const mesh::Surface& surface, const std::vector<Index>& cones,
                                 ExecutionContext& context);

// Inner vertices that are not flat; `cones` of any number of components.
std::vector<VertexId> inner_cones(const std::vector<Index>& cones, const mesh::Surface& surface);
// What a certificate is to check: the angles (radians) of these, and of all boundary vertices that
// have one if `aligned`.
std::vector<std::pair<VertexId, double>> prescribed_angles(const std::vector<Index>& cones,
                                                           const mesh::Surface& surface,
                                                           bool aligned);

// Throws InvalidInput (kBadAngles) naming the boundary vertex whose angle is given. Any number of
// components.
void check_free(const mesh::Surface& surface, const std::vector<Index>& cones);

// Total angles (radians) at all vertices for a free boundary: k quarter turns inside, at the
// boundary those of the discretely conformal metric with scale 1 there, corrected evenly along each
// curve so that it turns by whole quarters: the nearest that Gauss-Bonnet allows (`boundary`:
// kFree), or the sum of 2 - k of its vertices (kTurning), where k may be any number. Throws
// InvalidInput (kBadAngles) for k < 1 inside and, for kFree, as check_free(); Infeasible
// (kGaussBonnet) if the turning that is asked for is not what the inside needs; Cancelled. Cost: a
// conformal metric.
std::vector<double> free_angles(const mesh::Surface& surface, const std::vector<Index>& cones,
                                Boundary boundary, ExecutionContext& context);

}  // namespace flipfree::seamless
