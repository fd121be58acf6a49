// The ways to a map that meets all constraints (thesis 3.3 and what comes before it), and what one
// of them takes from another. match.cpp says in which order they are tried.
//
//   continuation.cpp   a valid map without the pins, then the pins moved to their targets
//   class_overlay.cpp  pins in a convex boundary, all at one stroke
//   arms.cpp           pins of a map that may overlap itself, all at one stroke
//   move_outline.cpp   an outline that winds, by a homotopy from a convex one
//   matchmaker_pp.cpp  MatchMaker++: the guarantee
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/embedding/disk.h"
#include "flipfree/matchmaker/request.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// step(), as this part of the progress.
template <typename Step>
auto in_range(ExecutionContext& context, double begin, double end, const Step& step) {
  const ProgressRange range(context, begin, end);
  return step();
}

// The disk onto its polygon in 64 bits. Throws NotConverged where it cannot be.
Points2 embedded(const embedding::Disk& disk, ExecutionContext& context);

// The way that needs no guarantee: a valid map without the pins, then the pins moved
// to their targets.
//
// On large surfaces what takes long is the way: dozens of Newton steps that all move far. So they
// are decimated, with all pins among the few vertices left, the pins are moved there, and all other
// vertices return to their places one by one (mesh/decimated/): none is added.

// Brings pins to their targets, refining the surface only where the way is blocked.
//
// First all pins together by continuation (minimize_with_targets()), along maps that are all
// flip-free: nothing has to be repaired, and inner vertices keep winding once, which untangling
// with a free boundary does not ensure. If that stops, pins inside a convex boundary are planned
// together (place_pins()), and where the boundary is free and the map may overlap itself, every
// pin gets an arm of its own (move_with_arms()); then refinement is taken back (coarsen.h).

// Precondition: map.uv is flip-free, a prescribed boundary is at its targets. Pins that have
// arrived are at their targets bit for bit; otherwise the map is a valid one on the way.
// `together`: by continuation, which adds no vertex; `refine`: by a plan or arms, where they are
// for such pins. Returns how they arrived ("first try" where there are none), null if they did not.
// Stats: "time_limit_reached".
const char* move_pins(mesh::RefinedMap& map, const Constraints& constraints, bool together,
                      bool refine, ExecutionContext& context, Stats& stats);

// Nothing if there is no such map, or a pin does not arrive. In the end the map lies on the surface
// itself. Stats: "continuation.coarsest" (vertices of the coarse level that all pins arrived on, if
// there is one), "time_limit_reached".
std::optional<Solution> by_continuation(const Problem& problem, ExecutionContext& context,
                                        Stats& stats);

// Splits every inner edge between boundary vertices but those of `uncut` (lines): whether its ends
// see each other may differ between outlines.
void split_chords(mesh::RefinedSurface& surface,
                  const std::vector<std::pair<VertexId, VertexId>>& uncut);

// Brings many pins to their targets at one stroke where the boundary is free and the map may
// overlap itself: every pin gets an arm of its own.
//
// The surface is laid into a circle and from there onto a star, whose arms lead to the
// targets and may cross each other. So nothing winds around anything, in whatever order the pins
// are, and what is added grows linearly with their number: a map that is one-to-one has to wind
// lines around lines (MatchMaker++, thesis 3.3), and so does one that grows out of such a map by
// moving pins past each other. A star depends on the point that the pins are seen
// from. Several are tried as they are, those that come to rest with the least distortion with the
// surface on them, and of these the one is taken that adds fewest vertices; taking refinement back
// is for the caller.

// The surface in a circle, all of it with room.
mesh::RefinedMap in_circle(const mesh::RefinedSurface& surface, ExecutionContext& context);

// Precondition: map.uv is flip-free. True: the map is flip-free by exact test, all pins are where
// they should be bit for bit; vertices were added at the end of the numbering, some of them on the
// boundary. What map.uv was does not matter. False, and the map unchanged, where the boundary is
// prescribed or the map must be one-to-one, with lines, with fewer than three pins, or where
// doubles are not enough. Cost: an embedding into a circle, some hundred Newton steps, and O(log)
// per crossing of the surface's edges with the star's.
bool move_with_arms(mesh::RefinedMap& map, const Constraints& constraints,
                    ExecutionContext& context);

// A map in a given isotopy class, with all pins at their targets, at one stroke.
//
// The class is that of a motion of the pins, the one of thousands with the fewest crossings. A
// triangulation of the pins' sources and one of their targets are laid over each other: in the
// class's tightest position, edges of one cross the triangles of the other along straight lines in
// both, which cut cells of at most six corners, convex in both. So the overlay's map is linear on
// triangles and positive; relaxed, it is a coarse map that meets all pins, and the surface is
// carried along with it (mesh_overlay.h).

// Preconditions: map.uv is flip-free, `constraints` prescribe a simple boundary that map.uv meets.
// True: the map is flip-free by exact test and meets all pins bit for bit; vertices were added at
// the end of the numbering, some of them along a ring inside the boundary. False, and the map
// unchanged, where the outline is not convex, there are lines or very many pins, pins lie next to
// the boundary, or doubles are not enough.
bool place_pins(mesh::RefinedMap& map, const Constraints& constraints, ExecutionContext& context);

// Brings a map from a convex polygon onto an outline through the frames of a homotopy
// (move_outline.cpp), along maps that are all flip-free, refining the surface where the way is
// blocked.
//
// From frame to frame the boundary and the pins are prescribed, everything else follows by Newton
// steps of the distortion's energy (minimize_with_targets()). A frame that is not reached is
// tried again nearer; where steps become hard, the edges that are too long to bend with
// the outline are split: those of the triangles that would fold first if every vertex rode on the
// homotopy (Carrier). Every map on the way is valid, so inner vertices keep winding once, and the
// disk that the homotopy's triangulation stands for, one of perhaps several with that outline, is
// the one that is reached.

// The way to an outline that winds: a map onto a convex polygon, the first frame of a homotopy
// and from there to the last.

// Precondition: a prescribed boundary. Nothing if the way is blocked. Stats:
// "time_limit_reached".
std::optional<Solution> by_homotopy(const Problem& problem, ExecutionContext& context,
                                    Stats& stats);

// MatchMaker++ from constraints to a valid map: phases 1 to 3 of thesis 3.3.

// The same, made fit for use, less distorted and with as few added vertices as time allows: the way
// that is always there. With `bijective`, which only a one-to-one start can hold, the map does not
// overlap itself. Stats: "distortion.*", "optimise_failure", "time_limit_reached".
mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
