#include "flipfree/unwrap/repair/places/make_way.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>

#include "flipfree/certify/overlap.h"

namespace flipfree::unwrap {
namespace {

// Boxes by size and place: of each size in squares not smaller than they are, so that only few
// squares hold what may meet another box.
class BoxesByPlace {
 public:
  void add(std::size_t chart, const BoundingBox& box) {
    const int size = std::ilogb((box.high - box.low).maxCoeff()) + 1;
    Boxes& same = by_size_[size];
    same.all.push_back(chart);
    same.by_square[square(box.low, size)].push_back(chart);
  }

  // Is `wanted` true of one whose box may meet this one? Some more are asked.
  template <typename Wanted>
  bool any(const BoundingBox& box, Wanted wanted) const {
    for (const auto& [size, boxes] : by_size_) {
      const Square first = square(box.low, size);
      const Square last = square(box.high, size);
      const double squares = (static_cast<double>(last[0]) - static_cast<double>(first[0]) + 2.0) *
                             (static_cast<double>(last[1]) - static_cast<double>(first[1]) + 2.0);
      if (squares > static_cast<double>(boxes.all.size())) {
        if (std::any_of(boxes.all.begin(), boxes.all.end(), wanted)) return true;
        continue;
      }
      for (std::int64_t x = first[0] - 1; x <= last[0]; ++x) {
        for (auto own = boxes.by_square.lower_bound({x, first[1] - 1});
             own != boxes.by_square.end() && own->first <= Square{x, last[1]}; ++own) {
          if (std::any_of(own->second.begin(), own->second.end(), wanted)) return true;
        }
      }
    }
    return false;
  }

 private:
  using Square = std::array<std::int64_t, 2>;
  struct Boxes {
    std::vector<std::size_t> all;
    std::map<Square, std::vector<std::size_t>> by_square;  // of their lower left corner
  };

  // Charts have an area, so that a box is not smaller than the spacing of numbers where it is; of
  // other boxes squares far away are no more than the last ones.
  static Square square(const Eigen::RowVector2d& at, int size) {
    const auto along = [&](int k) {
      constexpr double kLast = 0x1p60;
      return static_cast<std::int64_t>(
          std::floor(std::clamp(std::ldexp(at[k], -size), -kLast, kLast)));
    };
    return {along(0), along(1)};
  }

  std::map<int, Boxes> by_size_;
};

// The corners of those faces that may meet the box, below what is there.
void append_near(const Triangles& faces, const Points2& uv, const BoundingBox& box, Index island,
                 mesh::Components& islands, std::vector<Eigen::RowVector2d>& corners) {
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector2d a = uv.row(faces(f, 0)), b = uv.row(faces(f, 1)),
                             c = uv.row(faces(f, 2));
    const Eigen::RowVector2d low = a.cwiseMin(b).cwiseMin(c), high = a.cwiseMax(b).cwiseMax(c);
    if ((low.array() > box.high.array()).any() || (box.low.array() > high.array()).any()) continue;
    corners.insert(corners.end(), {a, b, c});
    islands.of_face.push_back(island);
  }
}

bool share_area(const Triangles& faces_a, const Points2& uv_a, const Triangles& faces_b,
                const Points2& uv_b) {
  const BoundingBox a(uv_a);
  const BoundingBox b(uv_b);
  if (!a.meets(b)) return false;
  mesh::Components two;
  two.count = 2;
  std::vector<Eigen::RowVector2d> near;
  append_near(faces_a, uv_a, b, 0, two, near);
  append_near(faces_b, uv_b, a, 1, two, near);
  Points2 corners(static_cast<Eigen::Index>(near.size()), 2);
  for (std::size_t i = 0; i < near.size(); ++i) corners.row(static_cast<Eigen::Index>(i)) = near[i];
  return certify::island_overlaps(two, corners).pairs > 0;
}

}  // namespace

std::vector<char> make_way(const std::vector<StandingChart>& charts, bool all_apart,
                           const ExecutionContext& context) {
  std::vector<char> moves(charts.size(), 0);
  const auto did_before = [&](const StandingChart& a, const StandingChart& b) {
    return a.before != nullptr &&
           share_area(*a.faces, *a.before, *b.faces, b.before != nullptr ? *b.before : *b.uv);
  };
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(!charts[a].may_move, charts[a].faces->rows()) >
           std::pair(!charts[b].may_move, charts[b].faces->rows());
  });
  std::vector<BoundingBox> boxes;
  boxes.reserve(charts.size());
  for (const StandingChart& chart : charts) boxes.emplace_back(*chart.uv);
  BoxesByPlace staying;
  for (const std::size_t c : order) {
    context.check();
    const StandingChart& own = charts[c];
    moves[c] = own.may_move && staying.any(boxes[c], [&](std::size_t other) {
      const StandingChart& its = charts[other];
      return boxes[c].meets(boxes[other]) && share_area(*own.faces, *own.uv, *its.faces, *its.uv) &&
             (all_apart || !did_before(own, its));
    });
    if (moves[c] == 0) staying.add(c, boxes[c]);
  }
  return moves;
}

}  // namespace flipfree::unwrap
