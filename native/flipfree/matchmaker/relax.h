// Lowering the distortion of a refined map: a few Newton steps on the way, of the whole or near
// what has changed, as a mesh of its own, and those of the end. All of these leave a valid map,
// whatever fails and whenever time is over.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// Flags of so many vertices: 1 of these.
std::vector<char> flags_of(const std::vector<VertexId>& vertices, std::size_t count);

// The vertices within so many edges of the seeds, these included; ascending. Seeds may repeat. This
// and the next cost O(k log k) for k faces, whatever the size of the map.
std::vector<VertexId> vertices_near(const mesh::EditableTriangulation& mesh,
                                    std::vector<VertexId> seeds, int rings);
// The faces with one of the vertices as a corner; ascending.
std::vector<FaceId> faces_at(const mesh::EditableTriangulation& mesh,
                             const std::vector<VertexId>& vertices);

// Some triangles of a map, or triangles that are to be some of it, with numbers of their own.
struct Patch {
  std::vector<VertexId> vertices;  // of the map, ascending; their places are the patch's vertices
  mesh::Surface surface;
  Points2 uv;
  std::vector<char> fixed;  // per vertex: does it stay?
};

// All vertices stay but those of `near` (ascending) that the flags `held`, one per vertex of the
// map, do not name.
Patch make_patch(const mesh::RefinedMap& map,
                 const std::vector<mesh::EditableTriangulation::Triangle>& triangles,
                 const std::vector<VertexId>& near, const std::vector<char>& held);

// Would an inner vertex wind more often than once with the patch's first `valid` faces, mapped by
// `uv`, in place of the faces `replaced`? Positive triangles can wind twice; angles that differ by
// 2 pi are told apart beyond rounding. Precondition: no vertex does now.
bool winds_more(const mesh::RefinedMap& map, const Patch& patch, FaceId valid, const Points2& uv,
                const std::vector<FaceId>& replaced);

// distortion::minimize_with_targets(); nothing where a target is missed, or the map is too squeezed
// for the Newton system: the way there is blocked.
using VertexTargets = std::vector<std::pair<VertexId, Vector2>>;
std::optional<distortion::TargetsResult> reach_targets(const mesh::Surface& surface,
                                                       const Points2& uv,
                                                       const VertexTargets& targets,
                                                       const distortion::MinimizeOptions& options,
                                                       ExecutionContext& context);

// Some Newton steps with these vertices where they are. False if the map is too squeezed for the
// Newton system; it is then as before, and valid.
bool relax(mesh::RefinedMap& map, const std::vector<VertexId>& fixed, int steps,
           ExecutionContext& context);

// The vertices below `keep` that are neighbours of others, which were added.
std::vector<VertexId> beside_added(const mesh::EditableTriangulation& mesh, Index keep);

// Relaxes the map near these and near what is added still, which may be all of it, at the scale
// that is the best for all of it. Cost: a few sweeps over the map, Newton steps of the
// neighbourhood.
bool relax_near_added(mesh::RefinedMap& map, std::vector<VertexId> seeds, Index keep,
                      const std::vector<VertexId>& fixed, int steps, ExecutionContext& context);

// Does the image of the boundary meet itself? Exact, and whatever time is left: what was found in
// time is not lost by being judged.
bool overlaps(const mesh::RefinedMap& map, ExecutionContext& context);

// The map's energy against the surface at rest, whose area is length^2.
struct Energy {
  distortion::EnergySums sums;
  double length = 1;
};
Energy measured(const mesh::RefinedMap& map, const ExecutionContext& context);

// UV length of a surface length 1 at which the map's distortion is least; while the worst triangles
// are so bad that they would decide this, at which areas are right in the mean (of their
// logarithms).
double best_unit(const mesh::RefinedMap& map, const ExecutionContext& context);

// Lowers the distortion with these vertices held, as far as time allows, in so many Newton steps;
// where the map was refined much, what they cost is bounded. Stats: "distortion.*",
// "optimise_failure", "time_limit_reached".
void optimise(mesh::RefinedMap& map, std::vector<VertexId> held, int steps, bool bijective,
              ExecutionContext& context, Stats& stats);

}  // namespace flipfree::matchmaker
