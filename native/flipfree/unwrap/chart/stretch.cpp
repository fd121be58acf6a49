#include "flipfree/unwrap/chart/stretch.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/islands/corners.h"
#include "flipfree/unwrap/packing/layout.h"

namespace flipfree::unwrap {
namespace {

// The most stretched that a bound leaves out.
constexpr double kShare = 0.01;

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

}  // namespace flipfree::unwrap
