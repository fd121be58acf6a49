#include "flipfree/distortion/weighted.h"

#include <gtest/gtest.h>

#include <vector>

#include "flipfree/certify/measures.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::distortion::weighted_test {
namespace {

Points2 corners_of(const mesh::Surface& surface, const Points2& uv) {
  Points2 corners(surface.faces.size(), 2);
  for (CornerId c = 0; c < corners.rows(); ++c) corners.row(c) = uv.row(surface.faces.data()[c]);
  return corners;
}

TEST(MinimizeWeighted, equal_factors_change_nothing) {
  const mesh::Surface dome = test::bumpy_grid(12, 12, 0.5, 1.0);
  const Points2 start = dome.vertices.leftCols<2>();
  ExecutionContext context;
  Stats stats;
  const Points2 plain = minimize_distortion(dome, start, {}, context, stats);
  const std::vector<double> factors(static_cast<std::size_t>(dome.faces.rows()), 4.0);
  const Points2 same = minimize_weighted(dome, factors, start, {}, context, stats);
  EXPECT_LT((plain - same).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(MinimizeWeighted, what_counts_more_is_stretched_less) {
  const mesh::Surface dome = test::bumpy_grid(12, 12, 0.8, 1.0);
  const Points2 start = dome.vertices.leftCols<2>();
  ExecutionContext context;
  Stats stats;
  const Points2 plain = minimize_distortion(dome, start, {}, context, stats);
  const certify::EnergyFigures before = certify::symmetric_dirichlet(dome, corners_of(dome, plain));
  const Points3 parts = certify::symmetric_dirichlet_parts(dome, corners_of(dome, plain));
  std::vector<double> factors;
  for (Eigen::Index f = 0; f < parts.rows(); ++f)
    factors.push_back(0.25 * (parts(f, 0) + parts(f, 1)) > 1.2 * before.mean ? 5.0 : 1.0);
  const Points2 weighted = minimize_weighted(dome, factors, start, {}, context, stats);
  const certify::EnergyFigures after =
      certify::symmetric_dirichlet(dome, corners_of(dome, weighted));
  EXPECT_LT(after.percentile99, before.percentile99);
  EXPECT_GT(after.mean, before.mean);
}

}  // namespace
}  // namespace flipfree::distortion::weighted_test
