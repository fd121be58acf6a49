#include "flipfree/unwrap/chart/ease.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/certify/measures/energy.h"
#include "flipfree/distortion/minimize/boundary_grid.h"
#include "flipfree/distortion/minimize/weighted.h"
#include "flipfree/unwrap/islands/stretch.h"

namespace flipfree::unwrap {
namespace {

constexpr int kRounds = 4;
constexpr int kSteps = 4;
constexpr double kTolerance = 1e-3;
// Logarithms of ratios, over that of the bound: from here on a triangle counts more, by this for
// every unit, in every round; and what is too far to be tried.
constexpr double kEasy = 0.8;
constexpr double kMore = 10.0;
constexpr double kTooFar = 1.35;

Points2 by_corner(const mesh::Surface& chart, const Points2& uv) {
  Points2 corners(chart.faces.size(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) corners.row(c) = uv.row(chart.faces.data()[c]);
  return corners;
}

}  // namespace

Points2 eased(const mesh::Surface& chart, const Points2& uv, const Stretch& most, bool apart,
              ExecutionContext& context) {
  Points2 corners = by_corner(chart, uv);
  Stretch stretch = stretch_of(chart, corners);
  const double unit = std::log(most.ratio);
  if (!(stretch.energy <= most.energy) || stretch.ratio <= most.ratio ||
      !(std::log(stretch.ratio) <= kTooFar * unit))
    return uv;
  if (apart &&
      distortion::overlaps_itself(
          distortion::find_boundary(static_cast<Index>(uv.rows()), chart.faces), uv, context))
    return uv;
  std::vector<double> factors(static_cast<std::size_t>(chart.faces.rows()), 1.0);
  distortion::MinimizeOptions options;
  options.max_iterations = kSteps;
  options.tolerance = kTolerance;
  options.bijective = options.held_apart = apart;
  Points2 map = uv;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> ratios = ratios_of(chart, corners);
    for (std::size_t f = 0; f < factors.size(); ++f)
      factors[f] *= 1.0 + kMore * std::max(std::log(ratios[f]) / unit - kEasy, 0.0);
    Stats ignored;
    map = distortion::minimize_weighted(chart, factors, map, options, context, ignored);
    corners = by_corner(chart, map);
    stretch = stretch_of(chart, corners);
    if (stretch.within(most)) return certify::symmetric_dirichlet(chart, corners).scale * map;
  }
  return uv;
}

}  // namespace flipfree::unwrap
