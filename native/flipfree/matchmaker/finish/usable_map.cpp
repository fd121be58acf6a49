#include "flipfree/matchmaker/finish/usable_map.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/overlap.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/coarsening/coarsen.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/matchmaker/request/request.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::matchmaker {
namespace {

// See seconds_to_store().
constexpr double kSecondsAtLeast = 0.02;
constexpr double kSecondsPerFace = 1e-5;

[[noreturn]] void give_up(const mesh::RefinedMap& map, const std::vector<Index>& thin) {
  std::vector<FaceId> slots;
  map.surface.mesh.faces(&slots);
  std::vector<Index> inputs;
  for (const Index f : thin) inputs.push_back(map.surface.mesh.parent(slots[at(f)]));
  sort_unique(inputs);
  const std::string first = inputs.empty() ? "" : ", the first is " + face_id(inputs.front());
  const std::string count = std::to_string(inputs.size());
  throw_not_converged(ErrorCode::kRoundingFlips,
                      "A map without flips was found, but parts of " + count + " faces" + first +
                          ", are too thin in it for the 32-bit values that are stored. Move pins "
                          "nearer to where their surroundings are, or pin fewer vertices.",
                      ElementKind::kFace, std::move(inputs));
}

// Vertices are not named: those that touch are added ones, as a rule, which the caller never saw.
[[noreturn]] void refuse_touching() {
  throw_not_converged(
      ErrorCode::kRoundingFlips,
      "A map without flips that does not overlap itself was found, but parts of its "
      "boundary are so near each other that they meet in the 32-bit values that are "
      "stored. Allow overlaps, or move pins nearer to where their surroundings are.");
}

}  // namespace

double seconds_to_store(const mesh::RefinedSurface& surface) {
  return kSecondsAtLeast + kSecondsPerFace * static_cast<double>(surface.mesh.face_slots());
}

Points2f store_map(const mesh::RefinedMap& map, const std::vector<VertexId>& held, bool bijective,
                   ExecutionContext& context, Stats& stats) {
  distortion::RoundingOptions rounding;
  rounding.fixed = held;
  rounding.bijective = bijective;
  // As a rule far less; where nothing fits, repairing goes on for minutes.
  const double seconds = std::max(context.seconds_left(), seconds_to_store(map.surface));
  Outcome<Points2f> stored = attempt([&] {
    const Grace storing(context, Grace::kShort);
    const TimeLimit limit(context, seconds);
    return distortion::round_to_storage(map.surface.mesh.faces(), map.uv, rounding, context, stats);
  });
  if (stored) return std::move(*stored);
  if (stored.error().code != ErrorCode::kRoundingFlips) throw NotConverged(stored.error());
  // Of a boundary that meets itself, vertices are named.
  if (stored.error().kind != ElementKind::kFace) refuse_touching();
  give_up(map, stored.error().elements);
}

namespace {

// A refined map is optimised for so many Newton steps times vertices, but this many steps at least.
constexpr double kRefinedWork = 4e6;
constexpr int kFewestSteps = 10;

}  // namespace

Points2 optimise(const mesh::RefinedSurface& surface, std::vector<VertexId> held, const Points2& uv,
                 int iterations, bool bijective, ExecutionContext& context, Stats& stats) {
  distortion::MinimizeOptions options;
  options.max_iterations = iterations;
  options.fixed = std::move(held);
  options.bijective = bijective;
  options.lengthen = true;
  if (static_cast<Index>(options.fixed.size()) >= surface.mesh.vertex_count()) return uv;
  Points2 best = uv;
  improve_in_time(context, stats, [&] {
    distortion::Minimized better = distortion::with_own_map(
        [&] { return distortion::minimize_distortion(to_surface(surface), uv, options, context); });
    report(better, stats);
    best = std::move(better.uv);
  });
  return best;
}

int affordable_steps(const mesh::RefinedSurface& surface, int wanted) {
  const auto count = static_cast<double>(surface.mesh.vertex_count());
  if (count < 3 * static_cast<double>(surface.input_vertices())) return wanted;
  return std::min(wanted, std::max(kFewestSteps, static_cast<int>(kRefinedWork / count)));
}

bool overlaps(const mesh::RefinedSurface& surface, const Points2& uv) {
  const Triangles faces = surface.mesh.faces();
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface.mesh.vertex_count(), faces);
  const mesh::EdgeFlags no_cuts(static_cast<std::size_t>(faces.size()), 0);
  return certify::boundary_overlaps(faces, adjacency, no_cuts, unwrap::by_corner(faces, uv))
             .places() > 0;
}

mesh::RefinedMap made_usable(mesh::RefinedMap fine, const mesh::RefinedSurface& surface,
                             const Constraints& constraints, bool bijective,
                             ExecutionContext& context, Stats& stats) {
  {
    const ProgressRange range(context, 0.0, 0.5);
    const TimeLimit share(context, kShareOfStep * context.seconds_left());
    // Its distortion is enormous at first; what counts is that the refinement can be taken back.
    constexpr int kIterations = 40;
    fine.uv = optimise(fine.surface, held_vertices(fine.surface, constraints), fine.uv,
                       affordable_steps(fine.surface, kIterations), bijective, context, stats);
  }
  const ProgressRange range(context, 0.5, 1.0);
  const TimeLimit share(context, (1 - kShareOfStep) * context.seconds_left());
  const Index keep = surface.mesh.vertex_count();
  const std::vector<VertexId> held = held_vertices(surface, constraints);
  mesh::RefinedMap coarse = fine;
  coarsen(coarse, held, keep, {}, context, stats);
  return bijective && overlaps(coarse.surface, coarse.uv) ? fine : coarse;
}

}  // namespace flipfree::matchmaker
