#include "flipfree/unwrap/islands/normalised.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "flipfree/base/disjoint_sets.h"

namespace flipfree::unwrap {

Points3 normalised(const Points3& positions, const Triangles& faces) {
  const auto count = static_cast<std::size_t>(positions.rows());
  DisjointSets components(static_cast<Index>(count));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    components.join(faces(f, 0), faces(f, 1));
    components.join(faces(f, 1), faces(f, 2));
  }
  const Vector3 infinite = Vector3::Constant(std::numeric_limits<double>::infinity());
  std::vector<Vector3> low(count, infinite);
  std::vector<Vector3> high(count, -infinite);
  for (const VertexId v : faces.reshaped()) {
    const auto c = static_cast<std::size_t>(components.find(v));
    low[c] = low[c].cwiseMin(positions.row(v).transpose());
    high[c] = high[c].cwiseMax(positions.row(v).transpose());
  }
  double size = 0.0;
  for (std::size_t c = 0; c < count; ++c) {
    // Halves first: the difference of two huge coordinates may not be finite.
    if (low[c].x() <= high[c].x()) size = std::max(size, (0.5 * high[c] - 0.5 * low[c]).maxCoeff());
  }
  int exponent = 0;
  std::frexp(size, &exponent);
  Points3 result = positions;
  for (VertexId v = 0; v < static_cast<VertexId>(count); ++v) {
    const auto c = static_cast<std::size_t>(components.find(v));
    if (low[c].x() <= high[c].x()) result.row(v) -= (0.5 * low[c] + 0.5 * high[c]).transpose();
  }
  for (double& x : result.reshaped()) x = std::ldexp(x, -exponent);
  return result;
}

}  // namespace flipfree::unwrap
