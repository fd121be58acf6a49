#include "flipfree/seamless/bordered/symmetric_changes.h"

#include <cmath>
#include <numbers>

namespace flipfree::seamless {

using intrinsic::EdgeLabel;
using intrinsic::IntrinsicMesh;

namespace {

// Per edge its column, and with what factor; none for diagonals.
struct Columns {
  std::vector<Index> of;
  std::vector<double> factor;
  Index count = 0;
};

Columns number_columns(const IntrinsicMesh& mesh) {
  Columns columns{std::vector<Index>(mesh.edge_count(), kInvalid),
                  std::vector<double>(mesh.edge_count(), 0.0)};
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const EdgeLabel label = mesh.label_of_edge(static_cast<EdgeId>(e));
    if (label == EdgeLabel::kDiagonal || label == EdgeLabel::kTwo) continue;
    columns.of[e] = columns.count++;
    columns.factor[e] = 1.0;
    if (label != EdgeLabel::kOne) continue;
    const std::size_t mirror = at(mesh.reflection[2 * e] >> 1);
    columns.of[mirror] = columns.of[e];
    columns.factor[e] = columns.factor[mirror] = 1.0 / std::numbers::sqrt2;
  }
  return columns;
}

}  // namespace

numeric::SparseMatrix symmetric_changes(const IntrinsicMesh& mesh,
                                        const std::vector<double>& cotangent) {
  const Columns columns = number_columns(mesh);
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(2 * mesh.edge_count());
  const auto add = [&](std::size_t row, EdgeId side, double share) {
    entries.emplace_back(static_cast<Index>(row), columns.of[at(side)],
                         share * columns.factor[at(side)]);
  };
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    const auto edge = static_cast<EdgeId>(e);
    if (mesh.label_of_edge(edge) != EdgeLabel::kDiagonal) {
      add(e, edge, 1.0);
      continue;
    }
    for (const HalfedgeId d : {2 * edge, 2 * edge + 1}) {
      HalfedgeId leg = mesh.next_of(d), across = mesh.previous(d);
      if (mesh.label_of_edge(leg >> 1) == EdgeLabel::kPerpendicular) std::swap(leg, across);
      // (leg / diagonal)^2 by the law of sines.
      const double c = cotangent[at(d)], l = cotangent[at(leg)];
      const double share = (1.0 + c * c) / (1.0 + l * l);
      add(e, leg >> 1, 0.5 * share);
      add(e, across >> 1, 0.5 * (1.0 - share));
    }
  }
  numeric::SparseMatrix matrix(static_cast<Index>(mesh.edge_count()), columns.count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace flipfree::seamless
