#include "flipfree/unwrap/packing/boxes/free_boxes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "flipfree/unwrap/packing/nest/mask.h"

namespace flipfree::unwrap {
namespace {

constexpr int kCells = 256;
constexpr double kCell = 1.0 / kCells;
constexpr std::size_t kMostBoxes = 64;
// Boxes of less than so many cells hold nothing worth the search.
constexpr int kLeastBoxCells = 9;

using Grid = std::vector<char>;  // kCells x kCells, rows upwards

// The x of the triangle's points with y in [bottom, top], a little widened against rounding.
Span span_between(const std::array<Vector2, 3>& corners, double bottom, double top, double slack) {
  Span span;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector2& a = corners[k];
    const Vector2& b = corners[(k + 1) % 3];
    if (std::max(a.y(), b.y()) < bottom || std::min(a.y(), b.y()) > top) continue;
    const auto x_at = [&](double y) {
      if (a.y() == b.y()) return a.x();
      const double t = std::clamp((y - a.y()) / (b.y() - a.y()), 0.0, 1.0);
      return (1.0 - t) * a.x() + t * b.x();
    };
    if (a.y() == b.y()) {
      span.add(a.x());
      span.add(b.x());
      continue;
    }
    span.add(x_at(std::clamp(bottom, std::min(a.y(), b.y()), std::max(a.y(), b.y()))));
    span.add(x_at(std::clamp(top, std::min(a.y(), b.y()), std::max(a.y(), b.y()))));
  }
  return {span.low - slack, span.high + slack};
}

int cell_of(double x) {
  return static_cast<int>(std::clamp(std::floor(x * kCells), -1.0, static_cast<double>(kCells)));
}

void draw(const std::array<Vector2, 3>& corners, double margin, Grid& taken) {
  double bottom = std::numeric_limits<double>::infinity();
  double top = -bottom;
  double size = 1.0;
  for (const Vector2& p : corners) {
    bottom = std::min(bottom, p.y());
    top = std::max(top, p.y());
    size = std::max(size, p.cwiseAbs().maxCoeff());
  }
  const double slack = 16.0 * std::numeric_limits<double>::epsilon() * size;
  const int first = std::max(0, cell_of(bottom - margin - slack));
  const int last = std::min(kCells - 1, cell_of(top + slack));
  for (int row = first; row <= last; ++row) {
    const Span span =
        span_between(corners, row * kCell - slack, (row + 1) * kCell + margin + slack, slack);
    const int left = std::max(0, cell_of(span.low - margin));
    const int right = std::min(kCells - 1, cell_of(span.high));
    for (int column = left; column <= right; ++column)
      taken[static_cast<std::size_t>(row * kCells + column)] = 1;
  }
}

struct CellBox {
  int column = 0, row = 0, width = 0, height = 0;
  int area() const { return width * height; }
};

// The largest box of free cells: per row, the largest rectangle under the heights of the free
// columns that end there, by a stack.
CellBox largest_free(const Grid& taken) {
  std::array<int, kCells + 1> height{};
  std::array<int, kCells + 1> stack{};
  CellBox best;
  for (int row = 0; row < kCells; ++row) {
    int depth = 0;
    for (int column = 0; column <= kCells; ++column) {
      const auto c = static_cast<std::size_t>(column);
      if (column < kCells)
        height[c] = taken[static_cast<std::size_t>(row * kCells + column)] ? 0 : height[c] + 1;
      while (depth > 0) {
        const int tall =
            height[static_cast<std::size_t>(stack[static_cast<std::size_t>(depth - 1)])];
        if (column < kCells && tall <= height[c]) break;
        --depth;
        const int left = depth == 0 ? 0 : stack[static_cast<std::size_t>(depth - 1)] + 1;
        const CellBox box{left, row - tall + 1, column - left, tall};
        if (box.area() > best.area()) best = box;
      }
      stack[static_cast<std::size_t>(depth++)] = column;
    }
  }
  return best;
}

}  // namespace

std::vector<FreeBox> free_boxes(const Points2& obstacles, const Vector2& tile, double margin) {
  const double end = 1.0 - margin;
  Grid taken(static_cast<std::size_t>(kCells * kCells), 0);
  bool empty = true;
  for (Eigen::Index i = 0; i + 2 < obstacles.rows(); i += 3) {
    std::array<Vector2, 3> corners;
    for (Eigen::Index k = 0; k < 3; ++k)
      corners[static_cast<std::size_t>(k)] = obstacles.row(i + k).transpose() - tile;
    const Vector2 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
    const Vector2 high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    if ((low.array() > 1.0 + margin).any() || (high.array() < -margin).any()) continue;
    draw(corners, margin, taken);
    empty = false;
  }
  if (empty) return {{Vector2::Zero(), Vector2::Constant(end)}};
  std::vector<FreeBox> boxes;
  while (boxes.size() < kMostBoxes) {
    const CellBox box = largest_free(taken);
    if (box.area() < kLeastBoxCells) break;
    for (int row = box.row; row < box.row + box.height; ++row) {
      const auto begin = taken.begin() + row * kCells + box.column;
      std::fill(begin, begin + box.width, char{1});
    }
    const Vector2 low(box.column * kCell, box.row * kCell);
    const Vector2 high((box.column + box.width) * kCell, (box.row + box.height) * kCell);
    const Vector2 size = high.cwiseMin(Vector2::Constant(end)) - low;
    if ((size.array() > 0.0).all()) boxes.push_back({low, size});
  }
  return boxes;
}

}  // namespace flipfree::unwrap
