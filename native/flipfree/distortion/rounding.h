// From 64-bit UVs to the 32-bit ones that are stored, without losing what the certificate promises.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"

namespace flipfree::distortion {

struct RoundingOptions {
  // Vertices that are rounded to nearest and then never moved (pins). Their 64-bit values are
  // expected to be 32-bit numbers already.
  std::vector<VertexId> fixed;
  // The boundary may not meet itself. Precondition: it does not before rounding.
  bool bijective = false;
};

// Symmetric Dirichlet energy, times area, of face f as a map from the places `from` (#V x 2) to
// those `to`, of which `twice_area` is the determinant there: infinite unless it is positive.
template <typename Places>
double distortion_between(const Triangles& faces, FaceId f, const Points2& from, const Places& to,
                          double twice_area) {
  if (!(twice_area > 0)) return std::numeric_limits<double>::infinity();
  const Eigen::RowVector2d p = from.row(faces(f, 1)) - from.row(faces(f, 0));
  const Eigen::RowVector2d q = from.row(faces(f, 2)) - from.row(faces(f, 0));
  const Eigen::RowVector2d u = (to.row(faces(f, 1)) - to.row(faces(f, 0))).template cast<double>();
  const Eigen::RowVector2d v = (to.row(faces(f, 2)) - to.row(faces(f, 0))).template cast<double>();
  const double before = std::abs(p.x() * q.y() - p.y() * q.x());
  // (u v) = J (p q): |J|^2 is the squared length of both rows of (u v) adj(p q) over that of
  // `before`.
  const double stretch =
      (u * q.y() - v * p.y()).squaredNorm() + (v * p.x() - u * q.x()).squaredNorm();
  return stretch / before + stretch * before / (twice_area * twice_area);
}

// uv: #V x 2, every triangle positively oriented by the exact test. Every value is rounded to
// nearest; where that flips or collapses a triangle (or makes the boundary meet itself) the
// vertices around are moved to other 32-bit points, over a region that grows as far as it must.
// Guarantee: every triangle is positively oriented, exactly, on the values returned; fixed vertices
// are at their rounded places. stats: "rounding.repaired" counts the vertices that are not at their
// nearest 32-bit point. Throws NotConverged (kRoundingFlips) naming the faces if no such values
// were found: the map needs more than 24 bits. Cost: O(#F), plus the repairs.
Points2f round_to_storage(const Triangles& faces, const Points2& uv, const RoundingOptions& options,
                          ExecutionContext& context, Stats& stats);

}  // namespace flipfree::distortion
