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

}  // namespace flipfree::quads
