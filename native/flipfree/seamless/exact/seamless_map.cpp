#include "flipfree/seamless/exact/seamless_map.h"

#include <numbers>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/in_time.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {
namespace {

// Of the progress.
constexpr double kEngineShare = 0.5;

certify::Parametrization map_in_time(const mesh::Surface& surface, const std::vector<Index>& cones,
                                     const SeamlessOptions& options, ExecutionContext& context) {
  PennerMapOptions engine = options.engine;
  engine.metric.max_seconds = 0.0;
  PennerMap found;
  {
    const ProgressRange range(context, 0.0, kEngineShare);
    found = compute_penner_map(surface, cones, std::nullopt, engine, context);
  }
  certify::Parametrization map = std::move(found.map);
  if (map.certificate.flips64 != 0)
    throw certify::CertificateFailed("The seamless map", certify::in_input_faces(map));
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::EdgeFlags cuts = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
  const distortion::CutMap cut = distortion::cut_map(map.surface, adjacency, cuts, map.uv);
  distortion::ExactOptions exact_options;
  exact_options.optimise = options.optimise;
  exact_options.max_iterations = options.max_iterations;
  const ProgressRange range(context, kEngineShare, 1.0);
  distortion::ExactMap exact = distortion::make_exact(cut, exact_options, context);
  map.uv = distortion::corners_of(cut, exact.uv);
  map.uv32 = map.uv.cast<float>();
  map.agreed.resize(0, 2);
  for (auto& [name, value] : exact.stats) map.stats[name] = std::move(value);
  certify::CertifyRequest request;
  request.require_seamless = true;
  request.measure_overlaps = false;
  std::vector<VertexId> places;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (cones[v] == 4) continue;
    places.push_back(static_cast<VertexId>(v));
    request.cone_angles.emplace_back(places.back(), cones[v] * 0.5 * std::numbers::pi);
  }
  write_transitions(seam_branches(map.surface.faces, adjacency, cuts, places, map.uv), map);
  certify::certify_map(map, surface, request, context);
  certify::require_certificate(map, "The seamless map");
  return map;
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

}  // namespace flipfree::seamless
