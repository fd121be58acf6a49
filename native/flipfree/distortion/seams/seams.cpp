#include "flipfree/distortion/seams/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/point_repair.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/distortion/seams/exact_grid.h"
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

SeamConstraints constraints_of(const CutMap& map, const ExecutionContext& context) {
  return eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces,
                         map.seams, map.straight, context);
}

Minimized optimised(const CutMap& map, const SeamConstraints& constraints,
                    const MinimizeOptions& minimize, ExecutionContext& context) {
  RestShapes rest = build_rest_shapes(map.surface, context);
  const std::vector<char> free(static_cast<std::size_t>(map.uv.rows()), 0);
  SeamSystem system(constraints, map.surface.faces, free, context);
  return Minimizer(map.surface.faces, std::move(rest), nullptr, map.uv, minimize, context, &system)
      .run();
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
  return out;
}

Points2 corners_of(const CutMap& map, const Points2& uv) {
  Points2 corners(3 * map.surface.faces.rows(), 2);
  for (CornerId c = 0; c < static_cast<CornerId>(corners.rows()); ++c)
    corners.row(c) = uv.row(map.surface.faces(c / 3, c % 3));
  return corners;
}

namespace {

class Mover {
 public:
  Mover(const CutMap& map, const Points2& goal, const std::vector<char>& held,
        ExecutionContext& context)
      : map_(map),
        faces_(map.surface.faces),
        context_(context),
        constraints_(eliminate_seams(static_cast<Index>(map.uv.rows()), faces_, map.seams,
                                     map.straight, context)),
        system_(constraints_, faces_, held, context) {
    mesh::Surface flat{Points3::Zero(map.uv.rows(), 3), faces_};
    flat.vertices.leftCols<2>() = map.uv;
    rest_ = build_rest_shapes(flat, context);
    nodes_ = nodes_of(constraints_, faces_, map.seams, goal);
    fixed_.assign(static_cast<std::size_t>(nodes_.rows()), 0);
    std::fill(fixed_.begin() + constraints_.position_count(), fixed_.end(), char{1});
    for (std::size_t v = 0; v < held.size(); ++v) {
      if (held[v] == 0) continue;
      options_.fixed.push_back(static_cast<VertexId>(v));
      for (Index t = constraints_.begin[v]; t < constraints_.begin[v + 1]; ++t)
        fixed_[at(constraints_.terms[at(t)].node)] = 1;
    }
    round_held(1.0);
    const Points2 whole = map_of(constraints_, nodes_);
    for (const VertexId v : options_.fixed) {
      if (whole.row(v) == whole.row(v).array().round().matrix()) continue;
      round_held(static_cast<double>(constraints_.translation_step));
      break;
    }
    options_.unit = 1.0;
    options_.keep_last = true;
  }

  std::optional<Points2> run(Stats& stats) {
    std::optional<Points2> start = map_of(constraints_, nodes_);
    const std::size_t flips = flipped_faces(faces_, *start, context_).size();
    stats["carried.flips"] = static_cast<std::int64_t>(flips);
    if (flips > 0) start = pulled();
    stats["carried"] = std::string(!start ? "not" : flips > 0 ? "pulled" : "at once");
    if (!start) return std::nullopt;
    return on_grid(settled(*std::move(start), kSteps));
  }

 private:
  static constexpr int kSteps = 12;

  // Translations to multiples of a number, places to whole ones.
  void round_held(double unit) {
    for (Eigen::Index n = 0; n < nodes_.rows(); ++n) {
      const double by = n < constraints_.position_count() ? 1.0 : unit;
      if (fixed_[at(n)] != 0) nodes_.row(n) = by * (nodes_.row(n) / by).array().round();
    }
  }

  // Fixed nodes moved to where they shall be, as far as one gets in every step, the others
  // following.
  std::optional<Points2> pulled() {
    constexpr int kMostRounds = 60;
    constexpr double kLeastStep = 1e-4;
    constexpr double kLeastLeft = 1e-3;  // of the way: what is left would turn a triangle over
    std::vector<RestTriangle> rest;
    scale_rest(rest_.triangles, 1.0 / rest_.length, context_, rest);
    Points2 uv = map_.uv;
    double whole = 0.0;
    for (int round = 0; round < kMostRounds; ++round) {
      context_.report("carrying", static_cast<double>(round) / kMostRounds);
      Points2 left = nodes_ - nodes_of(constraints_, faces_, map_.seams, uv);
      for (Eigen::Index n = 0; n < left.rows(); ++n)
        if (fixed_[at(n)] == 0) left.row(n).setZero();
      const double far = left.cwiseAbs().maxCoeff();
      if (round == 0) whole = far;
      if (far < kLeastLeft * whole) return std::nullopt;
      system_.prescribe(std::move(left));
      system_.assemble(rest, uv, false, context_);
      Points2 direction;
      system_.solve(direction, context_);
      system_.prescribe({});
      const double most =
          std::min(1.0, kShareOfFlip * step_to_first_flip(faces_, uv, direction, context_));
      Points2 trial;
      const double step = halved_step(most, uv, direction, trial, [&](double) {
        return is_flip_free(faces_, trial, context_);
      });
      if (!(step > kLeastStep)) return std::nullopt;
      uv.swap(trial);
      if (step == 1.0) return uv;
      uv = settled(std::move(uv), 2);
    }
    return std::nullopt;
  }

  Points2 settled(Points2 uv, int steps) {
    options_.max_iterations = steps;
    return Minimizer(faces_, rest_, nullptr, uv, options_, context_, &system_).run().uv;
  }

  // With what is held where it shall be, bit for bit.
  std::optional<Points2> on_grid(const Points2& uv) {
    Points2 nodes = nodes_of(constraints_, faces_, map_.seams, uv);
    for (Eigen::Index n = 0; n < nodes.rows(); ++n)
      if (fixed_[at(n)] != 0) nodes.row(n) = nodes_.row(n);
    Stats ignored;
    try {
      return round_to_grid(constraints_, faces_, map_.seams, map_of(constraints_, nodes), context_,
                           ignored, 1.0, fixed_)
          .uv;
    } catch (const NotConverged&) {
      return std::nullopt;
    }
  }

  const CutMap& map_;
  const Triangles& faces_;
  ExecutionContext& context_;
  SeamConstraints constraints_;
  SeamSystem system_;
  RestShapes rest_;
  Points2 nodes_;  // as they shall be, where they are fixed
  std::vector<char> fixed_;
  MinimizeOptions options_;
};

}  // namespace

std::optional<Points2> carried_to(const CutMap& map, const Points2& goal,
                                  const std::vector<char>& held, ExecutionContext& context,
                                  Stats& stats) {
  return Mover(map, goal, held, context).run(stats);
}

}  // namespace flipfree::distortion
