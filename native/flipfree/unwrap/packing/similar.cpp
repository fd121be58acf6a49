#include "flipfree/unwrap/packing/similar.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

constexpr double kSameOutline = 1e-3;

Points2 outline_of(const mesh::Chart& chart, const Points2& uv) {
  const distortion::Boundary boundary =
      distortion::find_boundary(static_cast<Index>(uv.rows()), chart.surface.faces);
  if (boundary.loops.size() != 1) return Points2(0, 2);
  const std::vector<VertexId>& loop = boundary.loops.front();
  Points2 outline(static_cast<Eigen::Index>(loop.size()), 2);
  for (std::size_t i = 0; i < loop.size(); ++i)
    outline.row(static_cast<Eigen::Index>(i)) = uv.row(loop[i]);
  return outline;
}

double outline_area(const Points2& outline) {
  double area = 0.0;
  for (Eigen::Index i = 0; i < outline.rows(); ++i)
    area += 0.5 * cross(outline.row(i), outline.row((i + 1) % outline.rows()));
  return area;
}

Points2 from_corner(const Points2& outline, Eigen::Index first) {
  Points2 result(outline.rows(), 2);
  for (Eigen::Index i = 0; i < outline.rows(); ++i)
    result.row(i) = outline.row((first + i) % outline.rows());
  return result;
}

// Turn and shift only, at a scale that is given.
Similarity fit_motion_at_scale(const Points2& from, const Points2& to, double scale) {
  Similarity fitted = fit_similarity(from, to);
  const double size = fitted.linear.norm();
  fitted.linear = size > 0.0 ? Vector2(fitted.linear * (scale / size)) : Vector2(scale, 0.0);
  fitted.translation = Vector2::Zero();
  const Vector2 middle = from.colwise().mean().transpose();
  fitted.translation = to.colwise().mean().transpose() - fitted(middle);
  return fitted;
}

bool same(const Points2& from, const Points2& to, double tolerance) {
  const Similarity motion = fit_motion_at_scale(from, to, 1.0);
  for (Eigen::Index i = 0; i < from.rows(); ++i) {
    if (!((motion(from.row(i).transpose()) - to.row(i).transpose()).norm() <= tolerance))
      return false;
  }
  return true;
}

}  // namespace

std::vector<Stacked> similar_charts(const std::vector<mesh::Chart>& charts,
                                    const std::vector<Points2>& uv,
                                    const std::vector<char>& moved) {
  struct Kind {
    std::size_t chart;
    Points2 outline;
    double area;
  };
  std::map<Eigen::Index, std::vector<Kind>> kinds;
  std::vector<Stacked> found;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if (!moved[c]) continue;
    Points2 outline = outline_of(charts[c], uv[c]);
    if (outline.rows() < 3) continue;
    const double area = outline_area(outline);
    const double size = (outline.colwise().maxCoeff() - outline.colwise().minCoeff()).maxCoeff();
    std::vector<Kind>& own = kinds[outline.rows()];
    const std::size_t before = found.size();
    for (const Kind& kind : own) {
      if (!(std::abs(kind.area - area) <= 4.0 * kSameOutline * std::abs(area))) continue;
      for (Eigen::Index first = 0; first < outline.rows() && found.size() == before; ++first) {
        if (same(from_corner(outline, first), kind.outline, kSameOutline * size))
          found.push_back({c, kind.chart, static_cast<std::size_t>(first)});
      }
      if (found.size() > before) break;
    }
    if (found.size() == before) own.push_back({c, std::move(outline), area});
  }
  return found;
}

void put_on(const std::vector<mesh::Chart>& charts, const Stacked& stacked,
            const std::vector<Points2>& before, std::vector<Points2>& uv) {
  const Points2 own = from_corner(outline_of(charts[stacked.chart], before[stacked.chart]),
                                  static_cast<Eigen::Index>(stacked.first));
  const Points2 then = outline_of(charts[stacked.on], before[stacked.on]);
  const Points2 now = outline_of(charts[stacked.on], uv[stacked.on]);
  const Similarity motion = fit_motion_at_scale(own, now, fit_similarity(then, now).linear.norm());
  const Points2& from = before[stacked.chart];
  Points2& into = uv[stacked.chart];
  for (Eigen::Index v = 0; v < from.rows(); ++v)
    into.row(v) = motion(from.row(v).transpose()).transpose();
}

}  // namespace flipfree::unwrap
