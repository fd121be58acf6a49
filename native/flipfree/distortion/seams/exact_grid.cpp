#include "flipfree/distortion/seams/exact_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/elements.h"
#include "flipfree/distortion/minimize/minimizer.h"
#include "flipfree/distortion/seams/eliminate/nodes.h"
#include "flipfree/distortion/seams/grid_repair.h"
#include "flipfree/distortion/seams/seam_system.h"

namespace flipfree::distortion {
namespace {

using numeric::GaussianInteger;

constexpr int kFirstGridRings = 2;  // around the vertices at fault
// Room for what rounding and repairs move points by, in steps.
constexpr double kSlack = 256;

// The largest size of a coordinate.
double half_extent(const Points2& uv) { return uv.cwiseAbs().maxCoeff(); }

Points2 centred(const Points2& uv) {
  const Eigen::RowVector2d middle = 0.5 * (uv.colwise().minCoeff() + uv.colwise().maxCoeff());
  return uv.rowwise() - middle;
}

double step_for(double extent) {
  const double numbers = static_cast<double>(kLargestGridNumber) - kSlack;
  // Floats have no finer numbers than their least.
  double step = std::max<double>(std::ldexp(1.0, std::ilogb(extent) - 24),
                                 std::numeric_limits<float>::denorm_min());
  while (extent > numbers * step) step *= 2;
  return step;
}

// Nodes rounded, vertices computed from them: no error anywhere.
GridPoints rounded_map(const SeamConstraints& constraints, const Points2& nodes, double step) {
  std::vector<GaussianInteger> whole(at(constraints.node_count()));
  for (Index n = 0; n < constraints.node_count(); ++n) {
    const std::int64_t unit = n < constraints.position_count() ? 1 : constraints.translation_step;
    const double scale = step * static_cast<double>(unit);
    whole[at(n)] = {unit * std::llround(nodes(n, 0) / scale),
                    unit * std::llround(nodes(n, 1) / scale)};
  }
  GridPoints points(static_cast<Eigen::Index>(constraints.divisor.size()), 2);
  for (std::size_t v = 0; v < constraints.divisor.size(); ++v) {
    GaussianInteger sum;
    for (Index t = constraints.begin[v]; t < constraints.begin[v + 1]; ++t) {
      const NodeTerm& term = constraints.terms[at(t)];
      sum = sum + term.factor * whole[at(term.node)];
    }
    const std::int64_t d = constraints.divisor[v];
    if (sum.re % d != 0 || sum.im % d != 0)
      throw InternalError("seams: a vertex is not on the grid of its nodes");
    points.row(static_cast<Eigen::Index>(v)) << sum.re / d, sum.im / d;
  }
  return points;
}

// Opens crowded triangles in 64 bits under the constraints: minimises the distortion of the region
// with respect to equilateral triangles of one size, its rim and all translations held.
void open_region(const SeamConstraints& constraints, const Triangles& faces,
                 const std::vector<VertexId>& region, Points2& uv, ExecutionContext& context) {
  std::vector<char> inside(at(static_cast<Index>(uv.rows())), 0);
  for (const VertexId v : region) inside[at(v)] = 1;
  std::vector<FaceId> chosen;
  std::vector<char> held(inside.size(), 0);
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    if (inside[at(faces(f, 0))] && inside[at(faces(f, 1))] && inside[at(faces(f, 2))]) {
      chosen.push_back(f);
      continue;
    }
    for (int k = 0; k < 3; ++k) held[at(faces(f, k))] = 1;
  }
  if (chosen.empty()) return;
  Triangles part(static_cast<Eigen::Index>(chosen.size()), 3);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    part.row(static_cast<Eigen::Index>(i)) = faces.row(chosen[i]);
  MinimizeOptions minimize;
  minimize.max_iterations = 60;
  minimize.tolerance = 1e-2;
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (held[v]) minimize.fixed.push_back(static_cast<VertexId>(v));
  }
  Stats ignored;
  const double before = half_extent(uv);
  SeamSystem system(constraints, part, held, context);
  uv = Minimizer(part, equilateral_rest_shapes(chosen.size()), nullptr, uv, minimize, context,
                 &system)
           .run(ignored);
  // A map opened as a whole comes back in the unit of the equilateral triangles.
  if (minimize.fixed.empty()) {
    uv *= std::ldexp(1.0, static_cast<int>(std::lround(std::log2(before / half_extent(uv)))));
  }
}

[[noreturn]] void give_up(const std::vector<FaceId>& folded) {
  throw_not_converged(
      ErrorCode::kRoundingFlips,
      std::to_string(folded.size()) +
          " triangles flip or collapse when the seamless map is rounded to a grid that 32-bit "
          "values hold, and no grid points near by avoid it. Reduce the distortion: more cones, or "
          "fewer far apart.",
      ElementKind::kFace, first_elements(folded));
}

GridMap finish(const SeamConstraints& constraints, const Triangles& faces,
               const std::vector<SeamEdge>& seams, const GridPoints& points, double step) {
  GridMap map;
  map.step = step;
  map.uv = points.cast<double>() * step;
  map.transition.resize(static_cast<Eigen::Index>(seams.size()), 2);
  const auto corner = [&](CornerId c) -> GaussianInteger {
    const VertexId v = faces(c / 3, c % 3);
    return {points(v, 0), points(v, 1)};
  };
  std::vector<GaussianInteger> of_branch(seams.size());
  for (std::size_t e = 0; e < seams.size(); ++e) {
    const auto& [h, o, r] = seams[e];
    const GaussianInteger turn = numeric::quarter_turn(r);
    const GaussianInteger t = corner(next_corner(o)) + -(turn * corner(h));
    const GaussianInteger again = corner(o) + -(turn * corner(next_corner(h)));
    // The lowest edge of a branch stands for it, so that its translation is known here.
    const std::size_t branch = at(constraints.branch[e]);
    if (branch == e) of_branch[e] = t;
    if (!(t == again) || !(t == constraints.branch_unit[e] * of_branch[branch]))
      throw InternalError("seams: the sides of a seam edge do not match on the grid");
    map.transition.row(static_cast<Eigen::Index>(e)) << static_cast<double>(t.re) * step,
        static_cast<double>(t.im) * step;
  }
  return map;
}

}  // namespace

GridMap round_to_grid(const SeamConstraints& constraints, const Triangles& faces,
                      const std::vector<SeamEdge>& seams, const Points2& uv,
                      ExecutionContext& context, Stats& stats) {
  Points2 wide = centred(uv);
  double step = step_for(half_extent(wide));
  GridPoints points;
  GridPoints nearest;
  const auto round = [&] {
    const Points2 nodes = nodes_of(constraints, faces, seams, wide);
    for (step = step_for(half_extent(wide));; step *= 2) {
      points = rounded_map(constraints, nodes, step);
      if (points.cwiseAbs().maxCoeff() <= kLargestGridNumber) break;
    }
    nearest = points;
  };
  round();
  std::vector<FaceId> folded = folded_faces(faces, points, context);
  stats["rounding.folded"] = static_cast<std::int64_t>(folded.size());
  std::int64_t opened = 0;
  if (!folded.empty()) {
    GridRepair repair(constraints, faces, points, context);
    std::vector<VertexId> region;
    folded = repair.sweep(folded);
    for (int rings = kFirstGridRings; !folded.empty(); rings *= 2) {
      for (const FaceId f : folded) {
        for (int k = 0; k < 3; ++k) region.push_back(faces(f, k));
      }
      for (int r = 0; r < rings; ++r) region = repair.grow(region);
      const bool everything = repair.grow(region).size() == region.size();
      ++opened;
      try {
        open_region(constraints, faces, region, wide, context);
      } catch (const NotConverged&) {
        give_up(std::move(folded));  // too small or too thin for doubles, let alone the grid
      }
      wide = centred(wide);
      round();
      folded = repair.sweep(folded_faces(faces, points, context));
      if (!folded.empty() && everything) give_up(std::move(folded));
    }
  }
  std::int64_t moved = 0;
  for (const VertexId v : constraints.position) moved += points.row(v) != nearest.row(v) ? 1 : 0;
  stats["rounding.repaired"] = moved;
  stats["rounding.opened"] = opened;
  stats["rounding.step"] = step;
  return finish(constraints, faces, seams, points, step);
}

std::optional<Points2> unfold_on_grid(const SeamConstraints& constraints, const Triangles& faces,
                                      const std::vector<SeamEdge>& seams, const Points2& uv,
                                      std::size_t most, ExecutionContext& context) {
  const Points2 wide = centred(uv);
  const Points2 nodes = nodes_of(constraints, faces, seams, wide);
  GridPoints points;
  double step = step_for(half_extent(wide));
  for (;; step *= 2) {
    points = rounded_map(constraints, nodes, step);
    if (points.cwiseAbs().maxCoeff() <= kLargestGridNumber) break;
  }
  std::vector<FaceId> folded = folded_faces(faces, points, context);
  if (folded.size() > most) return std::nullopt;
  if (!folded.empty()) folded = GridRepair(constraints, faces, points, context).sweep(folded);
  if (!folded.empty()) return std::nullopt;
  return Points2(points.cast<double>() * step);
}

}  // namespace flipfree::distortion
