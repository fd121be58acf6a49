#include "flipfree/unwrap/chart/stretch.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/weighted.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

// The most stretched that a bound leaves out.
constexpr double kShare = 0.01;

// Of eased().
constexpr int kEasingRounds = 4;
constexpr int kEasingSteps = 4;
constexpr double kEasingTolerance = 1e-3;
// Logarithms of ratios, over that of the bound: from here on a triangle counts more, by this for
// every unit, in every round; and what is too far to be tried.
constexpr double kEasy = 0.8;
constexpr double kMore = 10.0;
constexpr double kTooFar = 1.35;

double mean_and_unit(const Points3& parts, double& area, double& unit) {
  double direct = 0.0;
  double inverse = 0.0;
  area = 0.0;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    direct += parts(f, 2) * parts(f, 0);
    inverse += parts(f, 2) * parts(f, 1);
    area += parts(f, 2);
  }
  unit = std::sqrt(inverse) / std::sqrt(direct);  // the best scale's square
  return area > 0.0 ? 0.5 * std::sqrt(direct) * std::sqrt(inverse) / area : 1.0;
}

struct Factors {
  double length = 1.0;
  double area = 1.0;
};

Factors factors(double direct, double inverse, double unit) {
  // The squares' sum of the singular values, and their product.
  const double sum = direct * unit;
  const double product = std::sqrt(direct / inverse) * unit;
  const double larger =
      std::sqrt(0.5 * (sum + std::sqrt(std::max(sum * sum - 4.0 * product * product, 0.0))));
  return {std::max(larger, larger / product), std::max(product, 1.0 / product)};
}

}  // namespace

std::vector<double> ratios_of(const mesh::Surface& surface, const Points2& corner_uv) {
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, corner_uv);
  double area = 0.0;
  double unit = 1.0;
  const double mean = mean_and_unit(parts, area, unit);
  std::vector<double> ratios(static_cast<std::size_t>(parts.rows()), 1.0);
  if (!(mean < kInfinite)) return ratios;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    const Factors own = factors(parts(f, 0), parts(f, 1), unit);
    ratios[static_cast<std::size_t>(f)] = std::max(own.length, own.area);
  }
  return ratios;
}

Stretch stretch_of(const mesh::Surface& surface, const Points2& corner_uv) {
  const Points3 parts = certify::symmetric_dirichlet_parts(surface, corner_uv);
  double area = 0.0;
  double unit = 1.0;
  Stretch result;
  result.energy = mean_and_unit(parts, area, unit);
  if (!(result.energy < kInfinite)) return {kInfinite, kInfinite};
  std::vector<std::pair<double, double>> lengths;  // ratio, area
  std::vector<std::pair<double, double>> areas;
  for (Eigen::Index f = 0; f < parts.rows(); ++f) {
    if (!(parts(f, 2) > 0.0)) continue;
    const Factors own = factors(parts(f, 0), parts(f, 1), unit);
    lengths.emplace_back(own.length, parts(f, 2));
    areas.emplace_back(own.area, parts(f, 2));
  }
  for (auto* ratios : {&lengths, &areas}) {
    if (ratios->empty()) continue;
    std::sort(ratios->begin(), ratios->end());
    double above = 0.0;
    std::size_t last = ratios->size() - 1;
    while (last > 0 && above + (*ratios)[last].second < kShare * area)
      above += (*ratios)[last--].second;
    result.ratio = std::max(result.ratio, (*ratios)[last].first);
  }
  return result;
}

Points2 eased(const mesh::Surface& chart, const Points2& uv, const Stretch& most, bool apart,
              ExecutionContext& context) {
  Points2 corners = by_corner(chart.faces, uv);
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
  options.max_iterations = kEasingSteps;
  options.tolerance = kEasingTolerance;
  options.bijective = options.held_apart = apart;
  Points2 map = uv;
  for (int round = 0; round < kEasingRounds; ++round) {
    const std::vector<double> ratios = ratios_of(chart, corners);
    for (std::size_t f = 0; f < factors.size(); ++f)
      factors[f] *= 1.0 + kMore * std::max(std::log(ratios[f]) / unit - kEasy, 0.0);
    Stats ignored;
    map = distortion::minimize_weighted(chart, factors, map, options, context, ignored);
    corners = by_corner(chart.faces, map);
    stretch = stretch_of(chart, corners);
    if (stretch.within(most)) return certify::symmetric_dirichlet(chart, corners).scale * map;
  }
  return uv;
}

}  // namespace flipfree::unwrap
