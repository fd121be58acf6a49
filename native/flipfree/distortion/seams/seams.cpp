#include "flipfree/distortion/seams/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {

namespace {

// From a seamless map in floating point to one that is seamless exactly, in 64 and in 32 bits.
//
// All coordinates are integers, at most 2^23 in size, in units of one power of two: floats hold
// them, in the first quadrant too, and doubles hold all their sums and differences, so that every
// transition is exact as stored.
// Free coordinates are rounded, the others follow without error (constraints.h).

using numeric::GaussianInteger;

struct GridMap {
  Points2 uv;       // #V of the cut surface; every value is a float
  double step = 0;  // of the grid, a power of two
};

// Integer coordinates in steps are no larger, so that the whole map spans at most 2^24 and floats
// hold it wherever it is moved on its grid.
constexpr double kLargestGridNumber = 0x1p23;
// Room for what rounding and repairs move points by, in steps.
constexpr double kSlack = 256;

// The largest size of a coordinate.
double half_extent(const Points2& uv) { return uv.cwiseAbs().maxCoeff(); }

// Every component, as faces and seams join it, about the origin: what lies far off costs all of
// them digits.
Points2 centred(const CutMap& map, const Points2& uv, double unit = 0.0) {
  const Triangles& faces = map.surface.faces;
  DisjointSets sets(static_cast<Index>(uv.rows()));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    sets.join(faces(f, 0), faces(f, 1));
    sets.join(faces(f, 0), faces(f, 2));
  }
  for (const SeamEdge& seam : map.seams)
    sets.join(mesh::source(faces, seam.h), mesh::source(faces, seam.o));
  Points2 low = uv, high = uv;
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const Index root = sets.find(v);
    low.row(root) = low.row(root).cwiseMin(uv.row(v));
    high.row(root) = high.row(root).cwiseMax(uv.row(v));
  }
  Points2 moved = uv;
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const Index root = sets.find(v);
    Eigen::RowVector2d middle = 0.5 * (low.row(root) + high.row(root));
    if (unit > 0.0) middle = (middle / unit).array().round() * unit;
    moved.row(v) -= middle;
  }
  return moved;
}

double step_for(double extent) {
  const double numbers = kLargestGridNumber - kSlack;
  // Floats have no finer numbers than their least.
  double step = std::max<double>(std::ldexp(1.0, std::ilogb(extent) - 24),
                                 std::numeric_limits<float>::denorm_min());
  while (extent > numbers * step) step *= 2;
  return step;
}

// Nodes rounded, vertices computed from them: no error anywhere.
Points2 rounded_map(const SeamConstraints& constraints, const Points2& nodes, double step) {
  std::vector<GaussianInteger> whole(at(constraints.node_count()));
  for (Index n = 0; n < constraints.node_count(); ++n) {
    const std::int64_t unit = n < constraints.position_count() ? 1 : constraints.translation_step;
    const double scale = step * static_cast<double>(unit);
    whole[at(n)] = {unit * std::llround(nodes(n, 0) / scale),
                    unit * std::llround(nodes(n, 1) / scale)};
  }
  Points2 points(static_cast<Eigen::Index>(constraints.divisor.size()), 2);
  for (std::size_t v = 0; v < constraints.divisor.size(); ++v) {
    GaussianInteger sum;
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      sum = sum + term.factor * whole[at(term.node)];
    }
    const std::int64_t d = constraints.divisor[v];
    if (sum.re % d != 0 || sum.im % d != 0)
      throw InternalError("seams: a vertex is not on the grid of its nodes");
    points.row(static_cast<Eigen::Index>(v)) << static_cast<double>(sum.re / d),
        static_cast<double>(sum.im / d);
  }
  return points * step;
}

GridMap finish(const CutMap& map, const Points2& points, double step) {
  const auto corner = [&](CornerId c) -> GaussianInteger {
    const VertexId v = mesh::source(map.surface.faces, c);
    return {std::llround(points(v, 0) / step), std::llround(points(v, 1) / step)};
  };
  for (const auto& [h, o, r] : map.seams) {
    const GaussianInteger turn = numeric::quarter_turn(r);
    if (!(corner(next_corner(o)) + -(turn * corner(h)) ==
          corner(o) + -(turn * corner(next_corner(h)))))
      throw InternalError("seams: the sides of a seam edge do not match on the grid");
  }
  return {points, step};
}

PointRules rules_of(const SeamConstraints& constraints, const std::vector<char>& held) {
  PointRules rules;
  rules.leader.assign(constraints.divisor.size(), kInvalid);
  rules.turns.assign(rules.leader.size(), 0);
  rules.axis.assign(rules.leader.size(), PointRules::kBoth);
  for (std::size_t v = 0; v < rules.leader.size(); ++v) {
    const auto [node, turns] = constraints.position_of(static_cast<VertexId>(v));
    if (node == kInvalid || (!held.empty() && held[at(node)] != 0)) continue;
    rules.leader[v] = constraints.position[at(node)];
    const Index direction = constraints.direction[at(node)];
    rules.turns[v] = turns - direction;
    if (constraints.real[at(node)] != 0)
      rules.axis[v] = direction % 2 == 0 ? PointRules::kFirst : PointRules::kSecond;
  }
  rules.where =
      "when the seamless map is rounded to a grid that 32-bit values hold, and no grid points near "
      "by avoid it. Reduce the distortion: more cones, or fewer far apart.";
  return rules;
}

// The nearest grid points; sets the rules' grain, the finest step at which 24 bits hold the map.
Points2 on_finest_grid(const SeamConstraints& constraints, const CutMap& map, const Points2& wide,
                       PointRules& rules) {
  const Points2 nodes = nodes_of(constraints, map, wide);
  for (rules.grain = step_for(half_extent(wide));; rules.grain *= 2) {
    rules.largest = kLargestGridNumber * rules.grain;
    Points2 points = rounded_map(constraints, nodes, rules.grain);
    if (half_extent(points) <= rules.largest) return points;
  }
}

// `uv` is flip-free by the exact test and meets the constraints up to rounding. Every component is
// centred at the origin, not scaled. Guarantee: every triangle is positively oriented and every
// seam edge's two sides are related by its quarter turn and by the translation given, exactly;
// edges of one branch have one translation, up to their units. `unit`: components are centred by
// multiples of it, and translations, lines and held places that are multiples of it stay so, as far
// as the grid is fine enough; 0: there is none. `held`: nodes that no repair moves (flags; empty:
// none). Triangles that rounding would fold are opened again by moving free positions around them
// on the grid, or in 64 bits over a region that grows as far as it must. stats: "rounding.repaired"
// (free positions that are not at their nearest grid point), "rounding.folded" (triangles that
// plain rounding folds), "rounding.opened" (times that a region was opened), "rounding.step".
// Throws NotConverged (kRoundingFlips) naming the faces if the map needs more than 24 bits. Cost:
// O(#F), plus the repairs.
GridMap round_to_grid(const SeamConstraints& constraints, const CutMap& map, const Points2& uv,
                      ExecutionContext& context, Stats& stats, double unit = 0.0,
                      const std::vector<char>& held = {}) {
  const Triangles& faces = map.surface.faces;
  Points2 wide = uv;
  PointRules rules = rules_of(constraints, held);
  const auto open = [&](const std::vector<char>& marked, bool everything, Points2& opened) {
    if (everything && unit > 0.0)  // opened, it has another scale
      throw_not_converged(ErrorCode::kRoundingFlips, rules.where);
    const double before = half_extent(opened);
    const auto system_of = [&](const Triangles& part, const std::vector<char>& held_too) {
      return std::make_unique<SeamSystem>(constraints, part, held_too, context);
    };
    open_crowd(faces, marked, std::vector<char>(marked.size(), 0), system_of, opened, context);
    // A map opened as a whole comes back in the unit of the equilateral triangles.
    if (everything)
      opened *=
          std::ldexp(1.0, static_cast<int>(std::lround(std::log2(before / half_extent(opened)))));
  };
  const RepairedPoints rounded = round_and_repair(
      faces, rules, wide,
      [&](Points2& moved) {
        moved = centred(map, moved, unit);
        return on_finest_grid(constraints, map, moved, rules);
      },
      open, context);
  std::int64_t moved = 0;
  for (const VertexId v : constraints.position) moved += rounded.moved[at(v)];
  stats["rounding.repaired"] = moved;
  stats["rounding.folded"] = std::int64_t{rounded.folded};
  stats["rounding.opened"] = std::int64_t{rounded.opened};
  stats["rounding.step"] = rules.grain;
  return finish(map, rounded.points, rules.grain);
}

// Largest distance between the map and the nearest nodes' map, as a share of its extent.
double misfit(const CutMap& map, const SeamConstraints& constraints) {
  const Points2 nearest = map_of(constraints, nodes_of(constraints, map, map.uv));
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
  return optimised(map, eliminate_seams(map, context), minimize, context);
}

std::optional<Points2> opened_on_grid(const CutMap& map, std::size_t most,
                                      ExecutionContext& context) {
  check_input(map);
  const SeamConstraints constraints = eliminate_seams(map, context);
  const Triangles& faces = map.surface.faces;
  PointRules rules = rules_of(constraints, {});
  Points2 points = on_finest_grid(constraints, map, centred(map, map.uv), rules);
  if (flipped_faces(faces, points, context).size() > most ||
      !repair_points(faces, rules, points, context))
    return std::nullopt;
  return points;
}

ExactMap make_exact(const CutMap& map, const ExactOptions& options, ExecutionContext& context) {
  check_input(map);
  const Triangles& faces = map.surface.faces;
  const SeamConstraints constraints = eliminate_seams(map, context);
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
  const GridMap grid = round_to_grid(constraints, map, uv, context, out.stats);
  out.uv = grid.uv;
  out.uv32 = grid.uv.cast<float>();
  out.step = grid.step;
  return out;
}

Points2 corners_of(const CutMap& map, const Points2& uv) {
  return uv(map.surface.faces.triangles().reshaped<Eigen::RowMajor>(), Eigen::all);
}

namespace {

class Mover {
 public:
  Mover(const CutMap& map, const Points2& goal, const std::vector<char>& held,
        ExecutionContext& context)
      : map_(map),
        faces_(map.surface.faces),
        context_(context),
        constraints_(eliminate_seams(map, context)),
        system_(constraints_, faces_, held, context) {
    mesh::Surface flat{Points3::Zero(map.uv.rows(), 3), faces_};
    flat.vertices.leftCols<2>() = map.uv;
    rest_ = build_rest_shapes(flat, context);
    nodes_ = nodes_of(constraints_, map, goal);
    fixed_.assign(at(nodes_.rows()), 0);
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
      Points2 left = nodes_ - nodes_of(constraints_, map_, uv);
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
    Points2 nodes = nodes_of(constraints_, map_, uv);
    for (Eigen::Index n = 0; n < nodes.rows(); ++n)
      if (fixed_[at(n)] != 0) nodes.row(n) = nodes_.row(n);
    Stats ignored;
    try {
      return round_to_grid(constraints_, map_, map_of(constraints_, nodes), context_, ignored, 1.0,
                           fixed_)
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
