// The triangle that is nearest to a point: triangles in boxes in boxes.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::quads {

class BoxTree {
 public:
  // Cost: O(#T log #T).
  explicit BoxTree(std::vector<std::array<Vector3, 3>> triangles);

  struct Nearest {
    double distance = 0.0;  // infinite where there are no triangles
    std::size_t triangle = 0;
    Vector3 weights = Vector3::Zero();  // of its corners, at the nearest point
  };
  Nearest nearest(const Vector3& p) const;

 private:
  struct Node {
    Vector3 low, high;
    std::size_t begin, end;  // of the order, in leaves
    std::size_t second;      // child; the first one is the next node. 0: a leaf
  };

  std::size_t build(std::size_t begin, std::size_t end);
  double to_box(std::size_t node, const Vector3& p) const;
  void search(std::size_t n, const Vector3& p, Nearest& best) const;

  std::vector<std::array<Vector3, 3>> triangles_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace flipfree::quads
