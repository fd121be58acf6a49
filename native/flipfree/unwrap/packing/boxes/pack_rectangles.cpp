#include "flipfree/unwrap/packing/boxes/pack_rectangles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "flipfree/base/error.h"
#include "flipfree/unwrap/packing/boxes/free_boxes.h"

namespace flipfree::unwrap {
namespace {

// Of the square's width that the gaps of a row may take.
constexpr double kMostGaps = 0.9;
constexpr double kLeastMargin = 0x1p-17;
// Share of an empty tile's scale below which a tile counts as full.
constexpr double kLeastShare = 0.125;
constexpr Index kTilesInRow = 10;
// Bisection ends within this factor; what is packed is not monotone in the scale, so that a few
// scales above are tried as well.
constexpr double kFineFactor = 1.001;
constexpr double kLeastSearched = 0x1p-24;
constexpr int kScalesAbove = 6;
// Above this many rectangles shelves do: their waste is small then, and they take no time.
constexpr std::size_t kFewRectangles = 2000;

// The upper rim of what is placed in a box, as steps from left to right.
class Skyline {
 public:
  explicit Skyline(const FreeBox& box) : box_(box), steps_{{0.0, 0.0, box.size.x()}} {}

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
    raise(best, size.x(), best_floor + size.y());
    return box_.low + corner;
  }

 private:
  struct Step {
    double x, y, width;
  };

  void raise(std::size_t first, double width, double height) {
    const double left = steps_[first].x;
    const double right = left + width;
    std::size_t end = first;
    while (end < steps_.size() && steps_[end].x + steps_[end].width <= right) ++end;
    if (end < steps_.size() && steps_[end].x < right) {
      steps_[end].width -= right - steps_[end].x;
      steps_[end].x = right;
    }
    const auto step_at = [&](std::size_t i) {
      return steps_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    const Step step{left, height, width};
    if (end == first) {
      steps_.insert(step_at(first), step);
      return;
    }
    steps_[first] = step;
    steps_.erase(step_at(first + 1), step_at(end));
  }

  FreeBox box_;
  std::vector<Step> steps_;
};

// Rows of rectangles side by side, each as high as its first: for the highest first.
class Shelves {
 public:
  explicit Shelves(const FreeBox& box) : box_(box) {}

  std::optional<Vector2> put(const Vector2& size) {
    if (size.x() > box_.size.x()) return std::nullopt;
    const bool beside = at_.x() + size.x() <= box_.size.x();
    const Vector2 corner = beside ? at_ : Vector2(0.0, at_.y() + height_);
    if (corner.y() + size.y() > box_.size.y()) return std::nullopt;
    height_ = beside ? std::max(height_, size.y()) : size.y();
    at_ = corner + Vector2(size.x(), 0.0);
    return box_.low + corner;
  }

 private:
  FreeBox box_;
  Vector2 at_ = Vector2::Zero();
  double height_ = 0.0;
};

using Order = std::vector<std::size_t>;

// Corners of all rectangles, or nothing if one does not fit.
template <typename Filling>
std::optional<std::vector<Vector2>> pack_at(double scale, const std::vector<Vector2>& sizes,
                                            const Order& order, const std::vector<FreeBox>& boxes,
                                            double margin) {
  std::vector<Filling> filled(boxes.begin(), boxes.end());
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

// A way to pack: which rectangle is next, and where it goes.
struct Way {
  bool shelves = false;
  Order order;
};

std::vector<Way> ways_to_pack(const std::vector<Vector2>& sizes) {
  std::vector<Way> ways;
  const auto add = [&](bool shelves, auto&& key) {
    Way way;
    way.shelves = shelves;
    way.order.resize(sizes.size());
    std::iota(way.order.begin(), way.order.end(), std::size_t{0});
    std::stable_sort(way.order.begin(), way.order.end(),
                     [&](std::size_t a, std::size_t b) { return key(sizes[a]) > key(sizes[b]); });
    ways.push_back(std::move(way));
  };
  const auto height = [](const Vector2& s) { return s.y(); };
  add(true, height);
  if (sizes.size() > kFewRectangles) return ways;
  add(false, height);
  add(false, [](const Vector2& s) { return s.x(); });
  add(false, [](const Vector2& s) { return s.prod(); });
  add(false, [](const Vector2& s) { return s.sum(); });
  add(false, [](const Vector2& s) { return s.maxCoeff(); });
  return ways;
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

struct Packed {
  std::vector<Vector2> corner;
  double scale = 0.0;  // 0: nothing fits
};

// The largest scale up to `most` that the search finds.
Packed pack_into(const std::vector<Vector2>& sizes, const std::vector<Way>& ways,
                 const std::vector<FreeBox>& boxes, double margin, double most) {
  Packed best;
  if (boxes.empty()) return best;
  const double bound = std::min(most, scale_bound(sizes, boxes, margin));
  if (!(bound > 0.0)) return best;
  const auto attempt = [&](double scale, const Way& way) {
    auto corners = way.shelves ? pack_at<Shelves>(scale, sizes, way.order, boxes, margin)
                               : pack_at<Skyline>(scale, sizes, way.order, boxes, margin);
    if (!corners) return false;
    if (scale > best.scale) best = {std::move(*corners), scale};
    return true;
  };
  if (!std::isfinite(bound)) {
    attempt(1.0, ways.front());
    return best;
  }
  for (const Way& way : ways) {
    if (attempt(bound, way)) return best;
    // Above the best so far, or from where something fits at all.
    double low = best.scale * kFineFactor;
    if (best.scale == 0.0) {
      for (low = 0.5 * bound; low > bound * kLeastSearched; low *= 0.5)
        if (attempt(low, way)) break;
    } else if (!attempt(low, way)) {
      continue;
    }
    if (best.scale < low) continue;
    double high = bound;
    while (high > low * kFineFactor) {
      const double middle = std::sqrt(low) * std::sqrt(high);  // their product may overflow
      (attempt(middle, way) ? low : high) = middle;
    }
    for (int i = 0; i < kScalesAbove; ++i) attempt(std::min(bound, low *= kFineFactor), way);
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
  Placement placement;
  placement.corner.assign(sizes.size(), Vector2::Zero());
  if (sizes.empty()) return placement;
  const double margin = fitting_margin(options.margin, sizes.size());
  const double wanted =
      options.scale > 0.0 ? options.scale : std::numeric_limits<double>::infinity();
  const std::vector<Way> ways = ways_to_pack(sizes);
  const std::vector<FreeBox> whole = {{Vector2::Zero(), Vector2::Constant(1.0 - margin)}};
  placement.tile = options.first_tile;
  Packed packed;
  if (options.obstacles == nullptr || options.obstacles->rows() == 0) {
    packed = pack_into(sizes, ways, whole, margin, wanted);
    const Vector2 tile = tile_corner(placement.tile);
    for (Vector2& corner : packed.corner) corner += tile;
  } else {
    const double least =
        kLeastShare * std::min(wanted, pack_into(sizes, ways, whole, margin, wanted).scale);
    for (; placement.tile < kTiles && !(packed.scale > 0.0); ++placement.tile) {
      const Vector2 tile = tile_corner(placement.tile);
      packed = pack_into(sizes, ways, free_boxes(*options.obstacles, tile, margin), margin, wanted);
      if (!(packed.scale >= least)) packed.scale = 0.0;
      if (packed.scale > 0.0) {
        for (Vector2& corner : packed.corner) corner += tile;
        break;
      }
    }
  }
  if (!(packed.scale > 0.0)) {
    throw_invalid(
        ErrorCode::kBadOption,
        "There is no room for the islands in any of 100 tiles: others lie everywhere. Move "
        "those out of the way, or pack everything together.");
  }
  placement.corner = std::move(packed.corner);
  placement.scale = packed.scale;
  return placement;
}

}  // namespace flipfree::unwrap
