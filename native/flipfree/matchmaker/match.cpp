#include "flipfree/matchmaker/match.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/matchmaker/ways/solve.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::matchmaker {
namespace {

// What stays where it is until the end: movable boundary vertices do not.
std::vector<VertexId> held_to_the_end(const mesh::RefinedSurface& surface,
                                      const Constraints& constraints) {
  std::vector<VertexId> held = held_vertices(surface, constraints);
  std::erase_if(held, [&](VertexId v) {
    return std::binary_search(constraints.movable.begin(), constraints.movable.end(), v);
  });
  return held;
}

certify::Parametrization to_parametrization(const mesh::RefinedMap& solution, const Points2& uv,
                                            const Points2f& uv32) {
  certify::Parametrization map;
  const mesh::RefinedSurface& refined = solution.surface;
  std::vector<FaceId> slots;
  map.surface = to_surface(refined);
  refined.mesh.faces(&slots);
  map.surface.vertices.topRows(refined.input_vertices()) = refined.input->vertices;
  map.vertex_parent.assign(refined.position.size(), kInvalid);
  map.vertex_barycentric = Points3::Zero(static_cast<Eigen::Index>(refined.position.size()), 3);
  map.uv.resize(map.surface.faces.size(), 2);
  map.uv32.resize(map.surface.faces.size(), 2);
  for (FaceId f = 0; f < map.surface.faces.rows(); ++f) {
    const FaceId parent = refined.mesh.parent(slots[at(f)]);
    map.parent_face.push_back(parent);
    for (Index k = 0; k < 3; ++k) {
      const VertexId v = map.surface.faces(f, k);
      map.uv.row(3 * f + k) = uv.row(v);
      map.uv32.row(3 * f + k) = uv32.row(v);
      map.vertex_parent[at(v)] = parent;
      for (Index c = 0; c < 3; ++c) {
        map.vertex_barycentric(v, c) = refined.support[at(v)].of(refined.input->faces(parent, c));
      }
    }
  }
  map.cut_edges.resize(0, 2);
  return map;
}

certify::CertifyRequest certify_request(const mesh::RefinedSurface& surface,
                                        const Constraints& constraints,
                                        const certify::Parametrization& map, bool bijective) {
  std::vector<const Vector2*> target(surface.position.size(), nullptr);
  for (const PinnedVertex& p : constraints.pins) target[at(p.vertex)] = &p.uv;
  for (std::size_t i = 0; i < constraints.outline.size(); ++i) {
    target[at(surface.boundary[i])] = &constraints.outline[i];
  }
  for (const VertexId v : constraints.movable) target[at(v)] = nullptr;
  certify::CertifyRequest request;
  request.require_bijective = bijective;
  for (CornerId c = 0; c < map.surface.faces.size(); ++c) {
    const Vector2* uv = target[at(map.surface.faces.data()[c])];
    if (uv != nullptr) request.pins.push_back({c, *uv});
  }
  return request;
}

void lower_distortion(mesh::RefinedMap& map, const Constraints& constraints,
                      const MatchOptions& options, bool bijective, ExecutionContext& context,
                      Stats& stats) {
  const std::vector<VertexId> held = held_to_the_end(map.surface, constraints);
  const int steps = affordable_steps(map.surface, options.max_iterations);
  map.uv = optimise(map.surface, held, map.uv, steps, bijective, context, stats);
}

// The values to be stored. A map that was accepted before it could be stored is optimised after
// all.
Points2f stored(Solution& solution, const Constraints& constraints, const MatchOptions& options,
                bool bijective, ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap& map = solution.map;
  const auto store = [&] {
    return store_map(map, held_to_the_end(map.surface, constraints), solution.keep, bijective,
                     context, stats);
  };
  if (!context.accepted() || !options.optimise) return store();
  const mesh::RefinedMap early = map;
  Outcome<Points2f> values = attempt(store);
  if (values) return std::move(*values);
  map = early;
  lower_distortion(map, constraints, options, bijective, context, stats);
  return store();
}

certify::Parametrization match_in_time(const mesh::Surface& surface, const MatchRequest& request,
                                       const MatchOptions& options, ExecutionContext& context) {
  mesh::ValidateOptions validation;
  validation.require_disk = true;
  mesh::validate(surface, validation, context);
  Stats stats;
  stats["time_limit_reached"] = std::int64_t{0};
  const Stopwatch watch;
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints = read_constraints(
      refined, request, options.bijective ? SelfOverlaps::kRefused : SelfOverlaps::kAllowed);
  constraints.one_to_one = options.bijective && constraints.free_boundary();
  // A boundary that moves away from a simple outline stays simple.
  const bool bijective =
      constraints.one_to_one || (!constraints.movable.empty() && constraints.simple_outline);

  Solution solution;
  {
    const ProgressRange range(context, 0.0, 0.85);
    solution = solve({refined, constraints, options}, context, stats);
  }
  mesh::RefinedMap& found = solution.map;
  const double seconds_map = watch.seconds();
  if (bijective && overlaps(found.surface, found.uv)) {
    throw_not_converged(ErrorCode::kLineSearchStalled,
                        "All pins can be met without a flip, but the piece then overlaps "
                        "itself. Allow overlaps, or move a pin.");
  }
  if (options.optimise) {
    const ProgressRange range(context, 0.85, 0.95);
    const double left = context.seconds_left();
    const TimeLimit limit(context, left - std::min(0.5 * left, seconds_to_store(found.surface)));
    const MapInHand valid(context);
    lower_distortion(found, constraints, options, bijective, context, stats);
  }
  const double seconds_optimise = watch.seconds() - seconds_map;

  const ProgressRange range(context, 0.95, 1.0);
  const Points2f uv32 = stored(solution, constraints, options, bijective, context, stats);
  const Grace finishing(context);
  certify::Parametrization map = to_parametrization(found, found.uv, uv32);
  certify::certify_map(map, surface, certify_request(found.surface, constraints, map, bijective),
                       context);
  certify::require_certificate(map, "The match");
  stats["engine"] = solution.engine;
  stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows() - surface.vertices.rows());
  stats["energy"] = map.certificate.energy;
  stats["seconds_map"] = seconds_map;
  stats["seconds_optimise"] = seconds_optimise;
  stats["seconds"] = watch.seconds();
  map.stats = std::move(stats);
  return map;
}

}  // namespace

certify::Parametrization match(const mesh::Surface& surface, const MatchRequest& request,
                               const MatchOptions& options, ExecutionContext& context) {
  return in_time(context, options.max_seconds, kNoMapFound, kMoreTimeOr,
                 [&] { return match_in_time(surface, request, options, context); });
}

}  // namespace flipfree::matchmaker
