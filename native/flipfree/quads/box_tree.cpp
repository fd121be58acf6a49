#include "flipfree/quads/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <Eigen/Geometry>

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

}  // namespace

BoxTree::BoxTree(std::vector<std::array<Vector3, 3>> triangles)
    : triangles_(std::move(triangles)), order_(triangles_.size()) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  if (!order_.empty()) build(0, order_.size());
}

BoxTree::Nearest BoxTree::nearest(const Vector3& p) const {
  Nearest best;
  best.distance = std::numeric_limits<double>::infinity();
  if (!nodes_.empty()) search(0, p, best);
  best.distance = std::sqrt(best.distance);
  return best;
}

std::size_t BoxTree::build(std::size_t begin, std::size_t end) {
  constexpr std::size_t kLeaf = 4;
  const std::size_t own = nodes_.size();
  nodes_.push_back({triangles_[order_[begin]][0], triangles_[order_[begin]][0], begin, end, 0});
  for (std::size_t i = begin; i < end; ++i) {
    for (const Vector3& p : triangles_[order_[i]]) {
      nodes_[own].low = nodes_[own].low.cwiseMin(p);
      nodes_[own].high = nodes_[own].high.cwiseMax(p);
    }
  }
  if (end - begin <= kLeaf) return own;
  Eigen::Index axis = 0;
  (nodes_[own].high - nodes_[own].low).maxCoeff(&axis);
  const auto place = [&](std::size_t i) {
    return triangles_[i][0][axis] + triangles_[i][1][axis] + triangles_[i][2][axis];
  };
  const std::size_t middle = begin + (end - begin) / 2;
  const auto from = order_.begin();
  std::nth_element(from + static_cast<std::ptrdiff_t>(begin),
                   from + static_cast<std::ptrdiff_t>(middle),
                   from + static_cast<std::ptrdiff_t>(end),
                   [&](std::size_t a, std::size_t b) { return place(a) < place(b); });
  build(begin, middle);
  const std::size_t second = build(middle, end);
  nodes_[own].second = second;
  return own;
}

double BoxTree::to_box(std::size_t node, const Vector3& p) const {
  const Vector3 off = (nodes_[node].low - p).cwiseMax(p - nodes_[node].high).cwiseMax(0.0);
  return off.squaredNorm();
}

void BoxTree::search(std::size_t n, const Vector3& p, Nearest& best) const {
  const Node& node = nodes_[n];
  if (node.second == 0) {
    for (std::size_t i = node.begin; i < node.end; ++i) {
      const auto& t = triangles_[order_[i]];
      const Vector3 weights = nearest_weights(p, t);
      const Vector3 off = weights[0] * t[0] + weights[1] * t[1] + weights[2] * t[2] - p;
      const double distance = off.squaredNorm();
      if (distance < best.distance) best = {distance, order_[i], weights};
    }
    return;
  }
  std::array<std::pair<double, std::size_t>, 2> children = {
      std::pair{to_box(n + 1, p), n + 1}, std::pair{to_box(node.second, p), node.second}};
  if (children[1] < children[0]) std::swap(children[0], children[1]);
  for (const auto& [distance, child] : children)
    if (distance < best.distance) search(child, p, best);
}

}  // namespace flipfree::quads
