#include "flipfree/distortion/seams/seams.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <tuple>
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
  // Floats have no finer numbers than their least.
  rules.grain = std::max<double>(std::ldexp(1.0, std::ilogb(half_extent(wide)) - 24),
                                 std::numeric_limits<float>::denorm_min());
  for (;; rules.grain *= 2) {
    rules.largest = kLargestGridNumber * rules.grain;
    if (half_extent(wide) > rules.largest - kSlack * rules.grain) continue;
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
// plain rounding folds). Returns the map and the grid's step. Throws NotConverged (kRoundingFlips)
// naming the faces if the map needs more than 24 bits. Cost: O(#F), plus the repairs.
std::pair<Points2, double> round_to_grid(const SeamConstraints& constraints, const CutMap& map,
                                         const Points2& uv, ExecutionContext& context, Stats& stats,
                                         double unit = 0.0, const std::vector<char>& held = {}) {
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
  return {rounded.points, rules.grain};
}

void require_storable(const CutMap& map) {
  const double largest = 0.25 * static_cast<double>(std::numeric_limits<float>::max());
  if (!(map.uv.array().abs() <= largest).all()) {
    throw_invalid(ErrorCode::kNotFinite,
                  "The map has UVs that are no finite numbers, or beyond what 32 bits can store. "
                  "Scale it to a size of about one.");
  }
}

Minimized optimised(const CutMap& map, const SeamConstraints& constraints, int max_iterations,
                    ExecutionContext& context) {
  MinimizeOptions minimize;
  minimize.max_iterations = max_iterations;
  minimize.acceptable = true;
  minimize.keep_last = true;  // without a step more it is a map all the same
  const std::vector<char> free(static_cast<std::size_t>(map.uv.rows()), 0);
  SeamSystem system(constraints, map.surface.faces, free, context);
  return descend({map.surface.faces, build_rest_shapes(map.surface, context), map.uv, &system},
                 minimize, context);
}

}  // namespace

Minimized less_distorted(const CutMap& map, int max_iterations, ExecutionContext& context) {
  require_storable(map);
  check_start(map.surface, map.uv, {}, context);
  return optimised(map, eliminate_seams(map, context), max_iterations, context);
}

std::optional<Points2> opened_on_grid(const CutMap& map, std::size_t most,
                                      ExecutionContext& context) {
  require_storable(map);
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
  require_storable(map);
  check_start(map.surface, map.uv, {}, context);
  const Triangles& faces = map.surface.faces;
  const SeamConstraints constraints = eliminate_seams(map, context);
  ExactMap out;
  Points2 uv = map.uv;
  bool hurried = false;
  if (options.optimise) {
    const ProgressRange range(context, 0.0, 0.9);
    const TimeLimit limit(
        context, seconds_to_search(context.seconds_left(), static_cast<Index>(faces.rows())));
    hurried = !ended_in_time([&] {
      Minimized better = optimised(map, constraints, options.max_iterations, context);
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
  std::tie(out.uv, out.step) = round_to_grid(constraints, map, uv, context, out.stats);
  out.uv32 = out.uv.cast<float>();
  return out;
}

Points2 corners_of(const CutMap& map, const Points2& uv) {
  return uv(map.surface.faces.triangles().reshaped<Eigen::RowMajor>(), Eigen::all);
}

std::optional<Points2> carried_to(const CutMap& map, const Points2& goal,
                                  const std::vector<char>& held, ExecutionContext& context,
                                  Stats& stats) {
  const Triangles& faces = map.surface.faces;
  const SeamConstraints constraints = eliminate_seams(map, context);
  MinimizeOptions options;
  options.unit = 1.0;
  options.keep_last = true;
  options.max_iterations = 12;
  options.max_pulls = 60;
  std::vector<char> fixed(at(constraints.node_count()), 0);
  std::fill(fixed.begin() + constraints.position_count(), fixed.end(), char{1});
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (held[v] == 0) continue;
    options.fixed.push_back(static_cast<VertexId>(v));
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t)
      fixed[at(constraints.terms[at(t)].node)] = 1;
  }
  // Fixed nodes as they shall be: translations multiples of a number, places whole ones.
  Points2 nodes = nodes_of(constraints, map, goal);
  const auto round_fixed = [&](double unit) {
    for (Index n = 0; n < constraints.node_count(); ++n) {
      const double by = n < constraints.position_count() ? 1.0 : unit;
      if (fixed[at(n)] != 0) nodes.row(n) = by * (nodes.row(n) / by).array().round();
    }
    return map_of(constraints, nodes);
  };
  Points2 whole = round_fixed(1.0);
  const auto is_whole = [&](VertexId v) {
    return whole.row(v) == whole.row(v).array().round().matrix();
  };
  if (!std::all_of(options.fixed.begin(), options.fixed.end(), is_whole))
    whole = round_fixed(static_cast<double>(constraints.translation_step));

  const std::size_t flips = flipped_faces(faces, whole, context).size();
  const auto motion_left = [&](const Points2& uv) {
    Points2 left = nodes - nodes_of(constraints, map, uv);
    for (Index n = 0; n < constraints.node_count(); ++n)
      if (fixed[at(n)] == 0) left.row(n).setZero();
    return left;
  };
  mesh::Surface flat{Points3::Zero(map.uv.rows(), 3), faces};
  flat.vertices.leftCols<2>() = map.uv;
  SeamSystem system(constraints, faces, held, context);
  DescentStart start{faces, build_rest_shapes(flat, context), flips > 0 ? map.uv : whole, &system};
  if (flips > 0) start.motion_left = motion_left;
  const Minimized moved = descend(std::move(start), options, context);
  const bool arrived = moved.fraction == 1.0;
  stats["carried"] = std::string(!arrived ? "not" : flips > 0 ? "pulled" : "at once");
  if (!arrived) return std::nullopt;
  // With what is fixed where it shall be, bit for bit.
  const Points2 there =
      map_of(constraints, nodes_of(constraints, map, moved.uv) + motion_left(moved.uv));
  Stats ignored;
  try {
    return round_to_grid(constraints, map, there, context, ignored, 1.0, fixed).first;
  } catch (const NotConverged&) {
    return std::nullopt;
  }
}

}  // namespace flipfree::distortion
