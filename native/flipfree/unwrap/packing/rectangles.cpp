#include "flipfree/unwrap/packing/rectangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {
namespace {

constexpr int kCells = 256;
constexpr std::size_t kMostBoxes = 64;
// Boxes of less than so many cells hold nothing worth the search.
constexpr int kLeastBoxCells = 9;

using Grid = std::vector<char>;  // kCells x kCells, rows upwards

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
      const auto c = at(column);
      if (column < kCells) height[c] = taken[at(row * kCells + column)] ? 0 : height[c] + 1;
      while (depth > 0) {
        const int tall = height[at(stack[static_cast<std::size_t>(depth - 1)])];
        if (column < kCells && tall <= height[c]) break;
        --depth;
        const int left = depth == 0 ? 0 : stack[at(depth - 1)] + 1;
        const CellBox box{left, row - tall + 1, column - left, tall};
        if (box.area() > best.area()) best = box;
      }
      stack[at(depth++)] = column;
    }
  }
  return best;
}

// Disjoint boxes in [0, 1 - margin]^2, largest first, for rectangles that bring a margin of their
// own on their left and lower sides: no obstacle is nearer to them. Obstacles (3 k x 2: triangles
// of either orientation, finite) are drawn into 256 x 256 cells; crumbs are left out. Cost:
// O(#cells touched by obstacles + #boxes #cells), at most 64 boxes.
std::vector<FreeBox> free_boxes(const Points2& obstacles, const Vector2& tile, double margin) {
  // Half the margin is around obstacles, and half of it around rectangles in their middle.
  const Vector2 origin = tile + Vector2::Constant(0.5 * margin);
  std::vector<Loop> loops;
  for (Eigen::Index i = 0; i + 2 < obstacles.rows(); i += 3)
    loops.emplace_back(triangle_of(obstacles, i).rowwise() - origin.transpose());
  const Mask drawn = draw_in_unit(std::move(loops), kCells, 0.5 * margin * kCells);
  Grid taken(at(kCells * kCells), 0);
  for (int row = 0; row < kCells; ++row) {
    for (const Run& run : drawn.row(row))
      std::fill_n(taken.begin() + row * kCells + run.first, run.last - run.first + 1, char{1});
  }
  std::vector<FreeBox> boxes;
  while (boxes.size() < kMostBoxes) {
    const CellBox box = largest_free(taken);
    if (box.area() < kLeastBoxCells) break;
    for (int row = box.row; row < box.row + box.height; ++row) {
      const auto begin = taken.begin() + row * kCells + box.column;
      std::fill(begin, begin + box.width, char{1});
    }
    const Vector2 low = Vector2(box.column, box.row) / kCells;
    const Vector2 high = low + Vector2(box.width, box.height) / kCells;
    const Vector2 size = high.cwiseMin(Vector2::Constant(1.0 - margin)) - low;
    if ((size.array() > 0.0).all()) boxes.push_back({low, size});
  }
  return boxes;
}

// Of the square's width that the gaps of a row may take.
constexpr double kMostGaps = 0.9;
constexpr double kLeastMargin = 0x1p-17;
// Share of an empty tile's scale below which a tile counts as full.
constexpr double kLeastShare = 0.125;
constexpr Index kTilesInRow = 10;
// Bisection ends within this factor.
constexpr double kFineFactor = 1.001;
constexpr double kLeastSearched = 0x1p-24;
// Above this many rectangles one order does: the waste is small then.
constexpr std::size_t kFewRectangles = 2000;

// The upper rim of what is placed in a box, as steps from left to right.
class Skyline {
 public:
  explicit Skyline(const FreeBox& box) : box_(box), steps_{{0.0, 0.0}} {}

  // Puts a rectangle where its top is lowest, leftmost of equals; its corner within the tile.
  std::optional<Vector2> put(const Vector2& size) {
    std::size_t best = steps_.size();
    double best_floor = box_.size.y() - size.y();
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const double right = steps_[i].x + size.x();
      if (right > box_.size.x()) break;
      double floor = 0.0;
      for (std::size_t k = i; k < steps_.size() && steps_[k].x < right; ++k) {
        floor = std::max(floor, steps_[k].y);
        if (floor > best_floor) break;
      }
      if (best == steps_.size() ? floor > best_floor : floor >= best_floor) continue;
      best = i;
      best_floor = floor;
    }
    if (best == steps_.size()) return std::nullopt;
    const Vector2 corner(steps_[best].x, best_floor);
    raise(best, corner.x() + size.x(), best_floor + size.y());
    return box_.low + corner;
  }

 private:
  // To the next one, or to the box's right side.
  struct Step {
    double x, y;
  };

  // From the begin of the first step on.
  void raise(std::size_t first, double right, double height) {
    const auto begin = steps_.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end =
        std::find_if(begin + 1, steps_.end(), [&](const Step& s) { return s.x > right; });
    const Step beyond{right, std::prev(end)->y};
    begin->y = height;
    const auto after = steps_.erase(begin + 1, end);
    if (right < box_.size.x()) steps_.insert(after, beyond);
  }

  FreeBox box_;
  std::vector<Step> steps_;
};

using Order = std::vector<std::size_t>;

// Corners of all rectangles, or nothing if one does not fit.
std::optional<std::vector<Vector2>> pack_at(double scale, const std::vector<Vector2>& sizes,
                                            const Order& order, const std::vector<FreeBox>& boxes,
                                            double margin) {
  std::vector<Skyline> filled(boxes.begin(), boxes.end());
  std::vector<Vector2> corners(sizes.size());
  const Vector2 gap = Vector2::Constant(margin);
  for (const std::size_t i : order) {
    std::optional<Vector2> corner;
    for (std::size_t b = 0; b < filled.size() && !corner; ++b)
      corner = filled[b].put(scale * sizes[i] + gap);
    if (!corner) return std::nullopt;
    corners[i] = *corner + gap;
  }
  return corners;
}

// Orders in which the rectangles are packed.
std::vector<Order> orders_of(const std::vector<Vector2>& sizes) {
  std::vector<Order> orders;
  const auto add = [&](auto&& key) {
    Order order(sizes.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return key(sizes[a]) > key(sizes[b]); });
    orders.push_back(std::move(order));
  };
  add([](const Vector2& s) { return s.y(); });
  if (sizes.size() > kFewRectangles) return orders;
  add([](const Vector2& s) { return s.x(); });
  add([](const Vector2& s) { return s.prod(); });
  add([](const Vector2& s) { return s.sum(); });
  add([](const Vector2& s) { return s.maxCoeff(); });
  return orders;
}

// No scale above it fits: by the longest sides, and by area.
double scale_bound(const std::vector<Vector2>& sizes, const std::vector<FreeBox>& boxes,
                   double margin) {
  Vector2 room = Vector2::Zero();
  double free = 0.0;
  for (const FreeBox& box : boxes) {
    room = room.cwiseMax(box.size);
    free += box.size.prod();
  }
  double bound = std::numeric_limits<double>::infinity();
  double area = 0.0;
  double sides = 0.0;
  for (const Vector2& size : sizes) {
    bound = std::min(bound, ((room.array() - margin) / size.array()).minCoeff());
    area += size.prod();
    sides += size.sum();
  }
  // area s^2 + sides margin s + n margin^2 <= free
  const double left = free - static_cast<double>(sizes.size()) * margin * margin;
  if (!(left > 0.0)) return 0.0;
  const double half = 0.5 * sides * margin;
  const double root = half + std::sqrt(half * half + area * left);
  // A little less, so that the rounding of sums refuses nothing.
  return (1.0 - 1e-12) * (root > 0.0 ? std::min(bound, left / root) : bound);
}

// The largest scale up to `most` that the search finds; 0 if nothing fits.
Placement pack_into(const std::vector<Vector2>& sizes, const std::vector<Order>& orders,
                    const std::vector<FreeBox>& boxes, double margin, double most) {
  Placement best{{}, 0.0};
  if (boxes.empty()) return best;
  const double bound = std::min(most, scale_bound(sizes, boxes, margin));
  if (!(bound > 0.0)) return best;
  const auto attempt = [&](double scale, const Order& order) {
    auto corners = pack_at(scale, sizes, order, boxes, margin);
    if (!corners) return false;
    if (scale > best.scale) best = {std::move(*corners), scale};
    return true;
  };
  if (!std::isfinite(bound)) {
    attempt(1.0, orders.front());
    return best;
  }
  for (const Order& order : orders) {
    if (attempt(bound, order)) return best;
    // Above the best so far, or from where something fits at all.
    double low = best.scale * kFineFactor;
    if (best.scale == 0.0) {
      for (low = 0.5 * bound; low > bound * kLeastSearched; low *= 0.5)
        if (attempt(low, order)) break;
    } else if (!attempt(low, order)) {
      continue;
    }
    if (best.scale < low) continue;
    double high = bound;
    while (high > low * kFineFactor) {
      const double middle = std::sqrt(low) * std::sqrt(high);  // their product may overflow
      (attempt(middle, order) ? low : high) = middle;
    }
  }
  return best;
}

}  // namespace

Vector2 tile_corner(Index tile) { return Vector2(tile % kTilesInRow, tile / kTilesInRow); }

double fitting_margin(double margin, std::size_t count) {
  // Of n rectangles, some sqrt(n) stand side by side; their gaps leave them room.
  const double side_by_side = std::ceil(std::sqrt(static_cast<double>(count)));
  return std::max(kLeastMargin, std::min(margin, kMostGaps / (side_by_side + 1.0)));
}

Placement pack_rectangles(const std::vector<Vector2>& sizes, const RoomOptions& options) {
  if (sizes.empty()) return {};
  if (!std::ranges::all_of(sizes, [](const Vector2& size) { return size.allFinite(); }))
    throw_not_converged(ErrorCode::kCertificateFailed, "The map of an island has no finite size.");
  const double margin = fitting_margin(options.margin, sizes.size());
  const double wanted =
      options.scale > 0.0 ? options.scale : std::numeric_limits<double>::infinity();
  const std::vector<Order> orders = orders_of(sizes);
  const Points2 none(0, 2);
  const Points2& obstacles = options.obstacles == nullptr ? none : *options.obstacles;
  const FreeBox whole{Vector2::Zero(), Vector2::Constant(1.0 - margin)};
  // With nothing in the way the first tile is as good as any.
  const double least =
      obstacles.rows() == 0
          ? 0.0
          : kLeastShare * std::min(wanted, pack_into(sizes, orders, {whole}, margin, wanted).scale);
  for (Index number = options.first_tile; number < kTiles; ++number) {
    const Vector2 tile = tile_corner(number);
    Placement packed =
        pack_into(sizes, orders, free_boxes(obstacles, tile, margin), margin, wanted);
    if (!(packed.scale > 0.0 && packed.scale >= least)) continue;
    for (Vector2& corner : packed.corner) corner += tile;
    packed.tile = number;
    return packed;
  }
  throw_invalid(ErrorCode::kBadOption,
                "There is no room for the islands in any of 100 tiles: others lie everywhere. Move "
                "those out of the way, or pack everything together.");
}

}  // namespace flipfree::unwrap
