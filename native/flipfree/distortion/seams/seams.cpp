#include "flipfree/distortion/seams/seams.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/distortion/seams/exact_grid.h"
#include "flipfree/distortion/seams/relief.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {
namespace {

// Largest distance between the map and the nearest nodes' map, as a share of its extent.
double misfit(const CutMap& map, const SeamConstraints& constraints) {
  const Points2 nearest =
      map_of(constraints, nodes_of(constraints, map.surface.faces, map.seams, map.uv));
  const double extent = (map.uv.colwise().maxCoeff() - map.uv.colwise().minCoeff()).maxCoeff();
  return (nearest - map.uv).rowwise().norm().maxCoeff() / extent;
}

void check_input(const CutMap& map) {
  if (map.surface.faces.rows() == 0) throw_invalid(ErrorCode::kEmptyMesh, "The map has no faces.");
  if (map.uv.rows() != map.surface.vertices.rows()) {
    throw_invalid(ErrorCode::kBadShape, "The map has " + std::to_string(map.uv.rows()) +
                                            " points for " +
                                            std::to_string(map.surface.vertices.rows()) +
                                            " vertices of the cut surface.");
  }
  const double largest = 0.25 * static_cast<double>(std::numeric_limits<float>::max());
  if (!(map.uv.array().abs() <= largest).all()) {
    throw_invalid(ErrorCode::kNotFinite,
                  "The map has UVs that are no finite numbers, or beyond what 32 bits can store. "
                  "Scale it to a size of about one.");
  }
}

}  // namespace

namespace {

SeamConstraints constraints_of(const CutMap& map, const ExecutionContext& context) {
  return eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces,
                         map.seams, map.straight, context);
}

Minimized optimised(const CutMap& map, const SeamConstraints& constraints,
                    const MinimizeOptions& minimize, ExecutionContext& context) {
  RestShapes rest = build_rest_shapes(map.surface, context);
  Points2 uv = map.uv;
  const auto relieved = relieve(constraints, map.surface.faces, rest, {}, uv, context);
  const std::vector<char> free(static_cast<std::size_t>(map.uv.rows()), 0);
  SeamSystem system(constraints, map.surface.faces, free, context);
  Minimizer minimizer(map.surface.faces, std::move(rest), nullptr, uv, minimize, context, &system);
  Minimized descent = minimizer.run();
  descent.relieved = relieved.value_or(0);
  return descent;
}

}  // namespace

Minimized less_distorted(const CutMap& map, int max_iterations, ExecutionContext& context) {
  check_input(map);
  MinimizeOptions minimize;
  minimize.max_iterations = max_iterations;
  minimize.acceptable = true;
  minimize.keep_last = true;
  check_start(map.surface, map.uv, minimize, context);
  return optimised(map, constraints_of(map, context), minimize, context);
}

std::optional<Points2> less_distorted_near(const CutMap& map, const std::vector<char>& near,
                                           ExecutionContext& context) {
  check_input(map);
  check_start(map.surface, map.uv, {}, context);
  Points2 uv = map.uv;
  const RestShapes rest = build_rest_shapes(map.surface, context);
  if (!relieve(constraints_of(map, context), map.surface.faces, rest, near, uv, context))
    return std::nullopt;
  return uv;
}

std::optional<Points2> opened_on_grid(const CutMap& map, std::size_t most,
                                      ExecutionContext& context) {
  check_input(map);
  return unfold_on_grid(constraints_of(map, context), map.surface.faces, map.seams, map.uv, most,
                        context);
}

ExactMap make_exact(const CutMap& map, const ExactOptions& options, ExecutionContext& context) {
  check_input(map);
  const Triangles& faces = map.surface.faces;
  const SeamConstraints constraints = constraints_of(map, context);
  ExactMap out;
  out.stats["seams.nodes"] = static_cast<std::int64_t>(constraints.node_count());
  out.stats["seams.translations"] = static_cast<std::int64_t>(constraints.translation.size());
  out.stats["seams.step"] = constraints.translation_step;
  out.stats["seams.misfit"] = misfit(map, constraints);
  MinimizeOptions minimize;
  minimize.max_iterations = options.max_iterations;
  minimize.tolerance = options.tolerance;
  minimize.acceptable = true;
  minimize.keep_last = true;  // without a step more it is a map all the same
  Points2 uv = map.uv;
  bool hurried = false;
  check_start(map.surface, uv, minimize, context);
  if (options.optimise) {
    const ProgressRange range(context, 0.0, 0.9);
    const TimeLimit limit(context, std::min(limit_of(options.max_seconds),
                                            seconds_to_search(context.seconds_left(),
                                                              static_cast<Index>(faces.rows()))));
    hurried = !ended_in_time([&] {
      Minimized better = optimised(map, constraints, minimize, context);
      report(better, out.stats);
      uv = std::move(better.uv);
    });
    hurried = hurried || context.time_is_over() || context.accepted();
  }
  const Grace storing(context, Grace::kShort);
  context.report("rounding", 0.95);
  out.stats["time_limit_reached"] = static_cast<std::int64_t>(hurried);
  if (!options.exact) {
    out.uv32 = round_to_storage(faces, uv, {}, context, out.stats);
    out.uv = std::move(uv);
    return out;
  }
  const GridMap grid = round_to_grid(constraints, faces, map.seams, uv, context, out.stats);
  out.uv = grid.uv;
  out.uv32 = grid.uv.cast<float>();
  out.step = grid.step;
  for (std::size_t e = 0; e < map.seams.size(); ++e) {
    out.transitions.push_back({map.seams[e].quarter_turns,
                               grid.transition.row(static_cast<Eigen::Index>(e)).transpose()});
  }
  return out;
}

Points2 corners_of(const CutMap& map, const Points2& uv) {
  Points2 corners(3 * map.surface.faces.rows(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(corners.rows()); ++c)
    corners.row(c) = uv.row(map.surface.faces(c / 3, c % 3));
  return corners;
}

}  // namespace flipfree::distortion
