#include "flipfree/unwrap/repair/places/one_scale.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/unwrap/repair/patches/damage.h"

namespace flipfree::unwrap {
namespace {

constexpr double kSameDensity = 1.1;
constexpr double kMost = 2.0 / 3.0;

// Of those that are not remade, or of all if there are no others; 0 if they have none in common.
double common(const std::vector<ScaledChart>& charts, const std::vector<double>& densities) {
  const bool all =
      std::all_of(charts.begin(), charts.end(), [](const ScaledChart& c) { return c.remade; });
  std::vector<std::pair<double, double>> standing;  // and area
  double total = 0.0;
  for (std::size_t c = 0; c < charts.size(); ++c) {
    if ((charts[c].remade && !all) || !(densities[c] > 0.0)) continue;
    double area = 0.0;
    for (const double a : face_areas(*charts[c].surface)) area += a;
    standing.emplace_back(densities[c], area);
    total += area;
  }
  const double median = weighted_median(standing);
  double same = 0.0;
  for (const auto& [density, area] : standing) {
    if (density <= kSameDensity * median && median <= kSameDensity * density) same += area;
  }
  return same >= kMost * total ? median : 0.0;
}

}  // namespace

std::vector<double> to_one_scale(const std::vector<ScaledChart>& charts) {
  std::vector<double> densities;
  for (const ScaledChart& chart : charts)
    densities.push_back(median_density(*chart.surface, *chart.uv));
  const double density = common(charts, densities);
  std::vector<double> factors(charts.size(), 1.0);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const double factor = density / densities[c];
    if (charts[c].remade && std::isnormal(factor)) factors[c] = factor;
  }
  return factors;
}

}  // namespace flipfree::unwrap
