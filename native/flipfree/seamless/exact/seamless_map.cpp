#include "flipfree/seamless/exact/seamless_map.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/outcome.h"
#include "flipfree/base/in_time.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/error_places.h"
#include "flipfree/seamless/exact/chart_places.h"
#include "flipfree/seamless/exact/edge_directions.h"
#include "flipfree/seamless/exact/take_back.h"
#include "flipfree/seamless/padding/engine/padding.h"
#include "flipfree/seamless/padding/topology/topology.h"
#include "flipfree/seamless/request.h"
#include "flipfree/seamless/seams.h"
#include "flipfree/seamless/suggested_turns.h"

namespace flipfree::seamless {
namespace {

// Of the progress.
constexpr double kSuggestionShare = 0.4;
constexpr double kEngineShare = 0.5;
// Of that of finish_map().
constexpr double kTakenBackShare = 0.6;
// Newton steps of the optimiser between two rounds of taking refinement back.
constexpr int kCoarseSteps = 15;

bool has_boundary(const mesh::Surface& surface) {
  const auto adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  return std::any_of(adjacency.opposite.begin(), adjacency.opposite.end(),
                     [](HalfedgeId o) { return o == kInvalid; });
}

Index euler_characteristic(const mesh::Surface& surface) {
  return mesh::topology(
             surface.faces,
             mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces))
      .euler();
}

// No field says which way up: the edges do.
void turn_along_own_edges(const IndexPairs& diagonals, certify::Parametrization& map) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::Components parts = mesh::face_components(adjacency);
  turn_along_edges(map.surface.faces, adjacency, parts.of_face, parts.count, diagonals, map.uv);
}

// Why the engine "padding" has nothing to say about this request; "" if it has.
std::string not_for_padding(const mesh::Surface& surface, const SeamlessOptions& options) {
  if (options.loops) return "loops that turn as they are told";
  return has_boundary(surface) ? "surfaces with a boundary" : "";
}

PennerMap padded(const mesh::Surface& surface, const std::vector<Index>& cones,
                 const PennerMapOptions& engine, ExecutionContext& context) {
  std::vector<Index> turns = cones;
  std::replace(turns.begin(), turns.end(), kNotGiven, Index{4});
  const auto cut = [](const mesh::Surface& component, const std::vector<Index>& own,
                      const std::vector<FaceId>&, ExecutionContext& inner) {
    return make_admissible_cut(component, own, inner);
  };
  PennerMap found = compute_padding_map(surface, turns, cut, engine, context);
  found.map.stats["engine"] = std::string("padding");
  return found;
}

PennerMap find_map(const mesh::Surface& surface, const std::vector<Index>& cones,
                   const PennerMapOptions& engine, const SeamlessOptions& options,
                   ExecutionContext& context) {
  const std::string unsuited = not_for_padding(surface, options);
  if (options.which == Engine::kPadding) {
    if (!unsuited.empty()) {
      throw_invalid(ErrorCode::kBadOption, "The engine \"padding\" does not know " + unsuited +
                                               ". Take the engine \"penner\" or \"auto\".");
    }
    return padded(surface, cones, engine, context);
  }
  if (options.which == Engine::kPenner || !unsuited.empty())
    return compute_penner_map(surface, cones, options.loops, engine, context);
  auto first =
      attempt([&] { return compute_penner_map(surface, cones, options.loops, engine, context); });
  if (first) return std::move(*first);
  auto second = attempt([&] { return padded(surface, cones, engine, context); });
  if (!second) throw NotConverged(first.error());
  return std::move(*second);
}

certify::Parametrization map_in_time(const mesh::Surface& surface, const std::vector<Index>& cones,
                                     const SeamlessOptions& options, ExecutionContext& context) {
  check_request(surface, cones, context);
  if (options.boundary == Boundary::kFree) check_free(surface, cones);
  PennerMapOptions engine = options.engine;
  engine.metric.max_seconds = 0.0;
  engine.metric.boundary = options.boundary;
  PennerMap found;
  {
    const ProgressRange range(context, 0.0, kEngineShare);
    found = find_map(surface, cones, engine, options, context);
  }
  // An aligned boundary says it.
  if (options.boundary == Boundary::kFree || !has_boundary(surface))
    turn_along_own_edges(options.engine.uncuttable, found.map);
  const ProgressRange range(context, kEngineShare, 1.0);
  return finish_map(std::move(found), surface, {}, options, context);
}

}  // namespace

certify::Parametrization compute_seamless_map(const mesh::Surface& surface,
                                              const std::vector<Index>& cones,
                                              const SeamlessOptions& options,
                                              ExecutionContext& context) {
  return in_time(context, options.max_seconds, "The seamless map was not reached",
                 "or spread the curvature over more vertices",
                 [&] { return map_in_time(surface, cones, options, context); });
}

certify::Parametrization finish_map(PennerMap found, const mesh::Surface& surface,
                                    const Strips& strips, const SeamlessOptions& options,
                                    ExecutionContext& context) {
  certify::Parametrization map = std::move(found.map);
  if (map.certificate.flips64 != 0)
    throw certify::CertificateFailed("The seamless map", certify::in_input_faces(map));
  const bool aligned = options.boundary == Boundary::kAligned;
  const double engine_energy = map.certificate.energy;
  const auto engine_added = map.surface.vertices.rows() - surface.vertices.rows();
  // Strips are named by the faces that the engine's map has.
  const bool taken = options.optimise && engine_added > 0 && strips.empty();
  bool settled = false;
  if (taken) {
    const ProgressRange range(context, 0.0, kTakenBackShare);
    settled = take_back(surface, aligned, options.engine.uncuttable,
                        std::min(kCoarseSteps, options.max_iterations), map, context);
  }
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::EdgeFlags cuts = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
  distortion::CutMap cut = distortion::cut_map(map.surface, adjacency, cuts, map.uv);
  if (aligned) cut.straight = distortion::straight_boundary(cut, adjacency);
  distortion::ExactOptions exact_options;
  exact_options.optimise = options.optimise && !settled;
  exact_options.max_iterations = options.max_iterations;
  exact_options.exact = options.exact;
  const ProgressRange finishing(context, taken ? kTakenBackShare : 0.0, 1.0);
  distortion::ExactMap exact;
  try {
    exact = distortion::make_exact(cut, exact_options, context);
  } catch (...) {
    rethrow_placed(map.parent_face, {});  // it counts faces of the refined map
  }
  map.uv = distortion::corners_of(cut, exact.uv);
  if (options.exact) {
    const mesh::Components parts = mesh::face_components(adjacency);
    spread_charts(parts.of_face, parts.count, exact.step, map.uv);
    map.uv32 = map.uv.cast<float>();
  } else {
    map.uv32 = Points2f(map.uv.rows(), 2);  // a resize that fails frees twice
    for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c)
      map.uv32.row(c) = exact.uv32.row(cut.surface.faces(c / 3, c % 3));
  }
  map.agreed.resize(0, 2);
  for (auto& [name, value] : exact.stats) map.stats[name] = std::move(value);
  certify::CertifyRequest request;
  request.require_seamless = options.exact;
  request.measure_overlaps = false;
  request.require_cones = true;
  if (options.exact) request.loops = strips;
  const mesh::Adjacency of_input =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  request.cone_angles = prescribed_angles(found.cones, surface.faces, of_input, aligned);
  const std::vector<VertexId> places = inner_cones(found.cones, surface.faces, of_input);
  write_transitions(seam_branches(map.surface.faces, adjacency, cuts, places, map.uv), map);
  certify::certify_map(map, surface, request, context);
  certify::require_certificate(map, "The seamless map");
  map.stats.try_emplace("engine", std::string("penner"));
  map.stats["engine.added_vertices"] = static_cast<std::int64_t>(engine_added);
  map.stats["energy.engine"] = engine_energy;
  map.stats["energy.optimised"] = map.certificate.energy;
  map.stats["energy"] = map.certificate.energy;
  return map;
}

certify::Parametrization map_with_suggested_cones(const mesh::Surface& surface,
                                                  const SeamlessOptions& options,
                                                  ExecutionContext& context) {
  return in_time(
      context, options.max_seconds, "The seamless map was not reached", "or give the cones", [&] {
        std::vector<Index> cones;
        {
          const ProgressRange range(context, 0.0, kSuggestionShare);
          check_surface(surface, context);
          conformal::SuggestConesOptions suggestion;
          suggestion.bound = options.suggested_bound;
          // Saddles of many quarters each are far from any surface with many handles.
          suggestion.max_cones =
              std::max(suggestion.max_cones, 4 * std::abs(euler_characteristic(surface)));
          // The best cones that half of the time finds, where it is limited.
          if (options.max_seconds > 0.0) suggestion.max_seconds = 0.5 * context.seconds_left();
          cones = suggested_turns(surface, suggestion, context);
        }
        const ProgressRange range(context, kSuggestionShare, 1.0);
        return map_in_time(surface, cones, options, context);
      });
}

}  // namespace flipfree::seamless
