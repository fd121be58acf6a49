#include "flipfree/unwrap/seams/halves.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>
#include <vector>

#include "flipfree/unwrap/chart/separate.h"

namespace flipfree::unwrap {

mesh::EdgeFlags halving_cut(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                            const Points2& corner_uv, const mesh::EdgeFlags& uncuttable,
                            ExecutionContext& context) {
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const auto count = static_cast<std::size_t>(chart.faces.rows());
  if (count < 2) return none;
  Points2 centre(chart.faces.rows(), 2);
  for (FaceId f = 0; f < chart.faces.rows(); ++f)
    centre.row(f) = corner_uv.middleRows(3 * f, 3).colwise().mean();
  const Points2 offset = centre.rowwise() - centre.colwise().mean();
  const Eigen::Matrix2d spread = offset.transpose() * offset;
  const Vector2 axis = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread).eigenvectors().col(1);
  std::vector<FaceId> order(count);
  std::iota(order.begin(), order.end(), FaceId{0});
  std::stable_sort(order.begin(), order.end(), [&](FaceId a, FaceId b) {
    return offset.row(a).dot(axis) < offset.row(b).dot(axis);
  });
  std::vector<FacePair> ends;
  for (std::size_t i = 0; i < std::max<std::size_t>(count / 4, 1); ++i)
    ends.push_back(
        {std::min(order[i], order[count - 1 - i]), std::max(order[i], order[count - 1 - i]), 1.0});
  Points2 uv(chart.vertices.rows(), 2);
  for (CornerId c = 0; c < corner_uv.rows(); ++c) uv.row(chart.faces.data()[c]) = corner_uv.row(c);
  mesh::EdgeFlags cut = separating_cut(chart, adjacency, uv, ends, 0.0, uncuttable, context);
  for (std::size_t h = 0; h < uncuttable.size(); ++h) {
    if (cut[h] != 0 && uncuttable[h] != 0) return none;
  }
  return cut;
}

}  // namespace flipfree::unwrap
