#include "flipfree/unwrap/seams/halves.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <vector>

#include "flipfree/unwrap/chart/separate.h"

namespace flipfree::unwrap {
namespace {

// Height over length of faces that could not be stored as islands of their own.
constexpr double kThinnest = 1e-5;

bool is_thin(const mesh::Surface& chart, FaceId f) {
  const Vector3 p = chart.vertices.row(chart.faces(f, 0));
  const Vector3 a = chart.vertices.row(chart.faces(f, 1)).transpose() - p;
  const Vector3 b = chart.vertices.row(chart.faces(f, 2)).transpose() - p;
  const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
  return !(a.cross(b).norm() > kThinnest * longest);
}

}  // namespace

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
  mesh::EdgeFlags spared = uncuttable.empty() ? none : uncuttable;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(spared.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o != kInvalid && (is_thin(chart, h / 3) || is_thin(chart, o / 3)))
      spared[static_cast<std::size_t>(h)] = 1;
  }
  mesh::EdgeFlags cut = separating_cut(chart, adjacency, uv, ends, 0.0, spared, context);
  for (std::size_t h = 0; h < spared.size(); ++h) {
    if (cut[h] != 0 && spared[h] != 0) return none;
  }
  return cut;
}

}  // namespace flipfree::unwrap
