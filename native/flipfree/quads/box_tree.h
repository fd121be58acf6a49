// The triangle that is nearest to a point, by Eigen's tree of boxes.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>
#include <unsupported/Eigen/BVH>

#include "flipfree/base/types.h"

namespace flipfree::quads {

class BoxTree {
 public:
  // Cost: O(#T log^2 #T).
  explicit BoxTree(const std::vector<std::array<Vector3, 3>>& triangles);

  struct Triangle {
    std::array<Vector3, 3> corners;
    std::size_t number = 0;
  };
  struct Nearest {
    double distance = 0.0;  // infinite where there are no triangles
    std::size_t triangle = 0;
    Vector3 weights = Vector3::Zero();  // of its corners, at the nearest point
  };
  Nearest nearest(const Vector3& p) const;

 private:
  bool empty_ = true;
  Eigen::KdBVH<double, 3, Triangle> tree_;
};

// Of the two triangles of each quad, triangles 2 q and 2 q + 1. place(vertex).
template <typename Quads, typename PlaceOf>
BoxTree tree_of(const Quads& quads, const PlaceOf& place) {
  std::vector<std::array<Vector3, 3>> halves;
  for (const auto& q : quads) {
    halves.push_back({place(q[0]), place(q[1]), place(q[2])});
    halves.push_back({place(q[0]), place(q[2]), place(q[3])});
  }
  return BoxTree(halves);
}

}  // namespace flipfree::quads
