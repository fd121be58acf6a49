#include "flipfree/quads/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace flipfree::quads {

namespace {

// Weights of the triangle's point that is nearest to p. Ericson, "Real-Time Collision Detection"
// (2005), 5.1.5: by the region that holds p.
Vector3 nearest_weights(const Vector3& p, const std::array<Vector3, 3>& t) {
  const Vector3 ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0.0 && d2 <= 0.0) return {1.0, 0.0, 0.0};
  const Vector3 bp = p - t[1];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0.0 && d4 <= d3) return {0.0, 1.0, 0.0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0) {
    const double w = d1 / (d1 - d3);
    return {1.0 - w, w, 0.0};
  }
  const Vector3 cp = p - t[2];
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0.0 && d5 <= d6) return {0.0, 0.0, 1.0};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0) {
    const double w = d2 / (d2 - d6);
    return {1.0 - w, 0.0, w};
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0.0, 1.0 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

// What Eigen's search asks: squares of distances from p.
struct Search {
  using Scalar = double;
  const Vector3& p;
  BoxTree::Nearest best;

  double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
    return box.squaredExteriorDistance(p);
  }
  double minimumOnObject(const BoxTree::Triangle& t) {
    const Vector3 weights = nearest_weights(p, t.corners);
    const double square =
        (weights[0] * t.corners[0] + weights[1] * t.corners[1] + weights[2] * t.corners[2] - p)
            .squaredNorm();
    if (square < best.distance) best = {square, t.number, weights};
    return square;
  }
};

}  // namespace

BoxTree::BoxTree(const std::vector<std::array<Vector3, 3>>& triangles) {
  std::vector<Triangle> numbered;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const std::array<Vector3, 3>& corners : triangles) {
    numbered.push_back({corners, numbered.size()});
    Eigen::AlignedBox3d& box = boxes.emplace_back();
    for (const Vector3& p : corners) box.extend(p);
  }
  empty_ = triangles.empty();
  tree_.init(numbered.begin(), numbered.end(), boxes.begin(), boxes.end());
}

BoxTree::Nearest BoxTree::nearest(const Vector3& p) const {
  Search search{p, {std::numeric_limits<double>::infinity()}};
  if (!empty_) Eigen::BVMinimize(tree_, search);
  search.best.distance = std::sqrt(search.best.distance);
  return search.best;
}

}  // namespace flipfree::quads
