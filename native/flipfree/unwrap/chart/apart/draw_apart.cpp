#include "flipfree/unwrap/chart/apart/draw_apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"

namespace flipfree::unwrap {
namespace {

// Of the map's extent; boundary vertices that are no further apart lie on each other but for
// rounding.
constexpr double kCoincident = 1e-9;

// Of the map's extent; what moves less may lie on itself again in 32 bits.
constexpr double kSeenApart = 1e-5;
// Of the way to the middle of the other corners: as little as is seen; then, where so much folds a
// face over, less.
constexpr std::array kShares = {1.0 / 64, 1.0 / 32,  1.0 / 16,  1.0 / 8,
                                1.0 / 4,  1.0 / 128, 1.0 / 256, 1.0 / 512};
constexpr std::size_t kLargest = 4;

// Marks those of the vertices (#V in all) that another one lies on, but for rounding: they share a
// cell of one of four grids. Cost: O(n log n).
std::vector<char> coincident(std::vector<VertexId> vertices, const Points2& uv) {
  std::vector<char> marks(static_cast<std::size_t>(uv.rows()), 0);
  const double width = kCoincident * (uv.colwise().maxCoeff() - uv.colwise().minCoeff()).maxCoeff();
  for (const double right : {0.0, 0.5}) {
    for (const double up : {0.0, 0.5}) {
      const auto cell = [&](VertexId v) {
        return std::pair(std::floor(uv(v, 0) / width + right), std::floor(uv(v, 1) / width + up));
      };
      std::sort(vertices.begin(), vertices.end(),
                [&](VertexId a, VertexId b) { return cell(a) < cell(b); });
      for (std::size_t i = 1; i < vertices.size(); ++i) {
        if (cell(vertices[i - 1]) != cell(vertices[i])) continue;
        marks[static_cast<std::size_t>(vertices[i - 1])] =
            marks[static_cast<std::size_t>(vertices[i])] = 1;
      }
    }
  }
  return marks;
}

}  // namespace

bool draw_apart(const Triangles& faces, Points2& uv, const ExecutionContext& context) {
  const distortion::Boundary boundary =
      distortion::find_boundary(static_cast<Index>(uv.rows()), faces);
  if (!distortion::overlaps_itself(boundary, uv, context)) return true;
  const std::vector<char> moves = coincident(boundary.vertices, uv);
  Points2 inner = Points2::Zero(uv.rows(), 2);
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(uv.rows());
  for (FaceId f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      inner.row(faces(f, k)) += uv.row(faces(f, (k + 1) % 3)) + uv.row(faces(f, (k + 2) % 3));
      weight[faces(f, k)] += 2.0;
    }
  }
  const double seen = kSeenApart * (uv.colwise().maxCoeff() - uv.colwise().minCoeff()).maxCoeff();
  for (std::size_t i = 0; i < kShares.size(); ++i) {
    Points2 apart = uv;
    double least = std::numeric_limits<double>::infinity();
    for (const VertexId v : boundary.vertices) {
      if (moves[static_cast<std::size_t>(v)] == 0) continue;
      apart.row(v) += kShares[i] * (inner.row(v) / weight[v] - uv.row(v));
      least = std::min(least, (apart.row(v) - uv.row(v)).norm());
    }
    if (i < kLargest && least < seen) continue;
    if (!distortion::is_flip_free(faces, apart, context) ||
        distortion::overlaps_itself(boundary, apart, context)) {
      continue;
    }
    uv = std::move(apart);
    return true;
  }
  return false;
}

}  // namespace flipfree::unwrap
