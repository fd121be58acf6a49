#include "flipfree/distortion/seams/exact_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/point_repair.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {

namespace {

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
Points2 centred(const Triangles& faces, const std::vector<SeamEdge>& seams, const Points2& uv,
                double unit = 0.0) {
  DisjointSets sets(static_cast<Index>(uv.rows()));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    sets.join(faces(f, 0), faces(f, 1));
    sets.join(faces(f, 0), faces(f, 2));
  }
  for (const SeamEdge& seam : seams)
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

GridMap finish(const Triangles& faces, const std::vector<SeamEdge>& seams, const Points2& points,
               double step) {
  GridMap map;
  map.step = step;
  map.uv = points;
  const auto corner = [&](CornerId c) -> GaussianInteger {
    const VertexId v = faces(c / 3, c % 3);
    return {std::llround(points(v, 0) / step), std::llround(points(v, 1) / step)};
  };
  for (const auto& [h, o, r] : seams) {
    const GaussianInteger turn = numeric::quarter_turn(r);
    if (!(corner(next_corner(o)) + -(turn * corner(h)) ==
          corner(o) + -(turn * corner(next_corner(h)))))
      throw InternalError("seams: the sides of a seam edge do not match on the grid");
  }
  return map;
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
Points2 on_finest_grid(const SeamConstraints& constraints, const Triangles& faces,
                       const std::vector<SeamEdge>& seams, const Points2& wide, PointRules& rules) {
  const Points2 nodes = nodes_of(constraints, faces, seams, wide);
  for (rules.grain = step_for(half_extent(wide));; rules.grain *= 2) {
    rules.largest = kLargestGridNumber * rules.grain;
    Points2 points = rounded_map(constraints, nodes, rules.grain);
    if (half_extent(points) <= rules.largest) return points;
  }
}

}  // namespace

GridMap round_to_grid(const SeamConstraints& constraints, const Triangles& faces,
                      const std::vector<SeamEdge>& seams, const Points2& uv,
                      ExecutionContext& context, Stats& stats, double unit,
                      const std::vector<char>& held) {
  Points2 wide = uv;
  PointRules rules = rules_of(constraints, held);
  const auto open = [&](const std::vector<char>& marked, bool everything, Points2& map) {
    if (everything && unit > 0.0)  // opened, it has another scale
      throw_not_converged(ErrorCode::kRoundingFlips, rules.where);
    const double before = half_extent(map);
    const auto system_of = [&](const Triangles& part, const std::vector<char>& held_too) {
      return std::make_unique<SeamSystem>(constraints, part, held_too, context);
    };
    open_crowd(faces, marked, std::vector<char>(marked.size(), 0), system_of, map, context);
    // A map opened as a whole comes back in the unit of the equilateral triangles.
    if (everything)
      map *= std::ldexp(1.0, static_cast<int>(std::lround(std::log2(before / half_extent(map)))));
  };
  const RepairedPoints rounded = round_and_repair(
      faces, rules, wide,
      [&](Points2& map) {
        map = centred(faces, seams, map, unit);
        return on_finest_grid(constraints, faces, seams, map, rules);
      },
      open, context);
  std::int64_t moved = 0;
  for (const VertexId v : constraints.position) moved += rounded.moved[at(v)];
  stats["rounding.repaired"] = moved;
  stats["rounding.folded"] = std::int64_t{rounded.folded};
  stats["rounding.opened"] = std::int64_t{rounded.opened};
  stats["rounding.step"] = rules.grain;
  return finish(faces, seams, rounded.points, rules.grain);
}

std::optional<Points2> unfold_on_grid(const SeamConstraints& constraints, const Triangles& faces,
                                      const std::vector<SeamEdge>& seams, const Points2& uv,
                                      std::size_t most, ExecutionContext& context) {
  PointRules rules = rules_of(constraints, {});
  Points2 points = on_finest_grid(constraints, faces, seams, centred(faces, seams, uv), rules);
  if (flipped_faces(faces, points, context).size() > most ||
      !repair_points(faces, rules, points, context))
    return std::nullopt;
  return points;
}

}  // namespace flipfree::distortion
