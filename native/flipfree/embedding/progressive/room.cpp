#include "flipfree/embedding/progressive/room.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// Floating-point numbers in order: consecutive numbers have consecutive ordinals; both zeros have
// ordinal 0.
std::int64_t to_ordinal(double value, bool float32) {
  if (float32) {
    const auto bits = std::bit_cast<std::int32_t>(static_cast<float>(value));
    return bits >= 0 ? bits : -static_cast<std::int64_t>(bits & 0x7fffffff);
  }
  const auto bits = std::bit_cast<std::int64_t>(value);
  return bits >= 0 ? bits : -(bits & 0x7fffffffffffffff);
}

double from_ordinal(std::int64_t ordinal, bool float32) {
  const bool negative = ordinal < 0;
  const std::int64_t magnitude = negative ? -ordinal : ordinal;
  const double value = float32 ? std::bit_cast<float>(static_cast<std::int32_t>(magnitude))
                               : std::bit_cast<double>(magnitude);
  return negative ? -value : value;
}

struct Interval {
  std::int64_t low = 0;
  std::int64_t high = -1;
  bool empty() const { return low > high; }
};

// From the least to the largest double there are more numbers than a signed one counts.
std::uint64_t count(const Interval& range) {
  return static_cast<std::uint64_t>(range.high) - static_cast<std::uint64_t>(range.low) + 1;
}
std::int64_t beyond(std::int64_t low, std::uint64_t steps) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + steps);
}
std::int64_t between(std::int64_t low, std::int64_t high) {
  return beyond(low, (count({low, high}) - 1) / 2);
}

class RoomFinder {
 public:
  RoomFinder(const PlanarMap& map, const Star& star) : map_(map), star_(star) {
    for (Index axis = 0; axis < 2; ++axis) {
      double low = HUGE_VAL;
      double high = -HUGE_VAL;
      for (const Vector2& q : star.at) {
        low = std::min(low, q[axis]);
        high = std::max(high, q[axis]);
      }
      // Grid values within [low, high]; the ends themselves cannot be strictly inside.
      range_[static_cast<Size>(axis)] = {to_ordinal(low, map.float32),
                                         to_ordinal(high, map.float32)};
    }
  }

  Room run(std::uint64_t budget) {
    row_axis_ = count(range_[0]) < count(range_[1]) ? 0 : 1;
    const Interval rows = range_[static_cast<Size>(row_axis_)];
    const std::uint64_t total = count(rows);
    const std::uint64_t most = std::max<std::uint64_t>(64, budget / star_.ring.size());
    Room room;
    room.exact = total <= most;
    const std::uint64_t looked = std::min(total, most);
    std::uint64_t widest = 0;
    for (std::uint64_t k = 0; k < looked; ++k) {
      const auto offset = room.exact ? static_cast<double>(k)
                                     : static_cast<double>(total) * (static_cast<double>(k) + 0.5) /
                                           static_cast<double>(looked);
      const double row =
          from_ordinal(beyond(rows.low, static_cast<std::uint64_t>(offset)), map_.float32);
      const Interval inside = admissible(row);
      if (inside.empty()) continue;
      const std::uint64_t width = count(inside);
      const auto limit = std::numeric_limits<std::uint64_t>::max() / 2;
      room.points = std::min(limit, room.points + std::min(limit, width));
      if (width > widest) {
        widest = width;
        room.middle = point(row, beyond(inside.low, width / 2));
      }
    }
    return room;
  }

 private:
  Vector2 point(double row, std::int64_t ordinal) const {
    Vector2 p;
    p[row_axis_] = row;
    p[1 - row_axis_] = from_ordinal(ordinal, map_.float32);
    return p;
  }

  // Values along the row on the positive side of all edges: orientation is linear along the row, so
  // each edge keeps a half-line.
  Interval admissible(double row) const {
    Interval inside = range_[static_cast<Size>(1 - row_axis_)];
    const Size n = star_.ring.size();
    for (Size i = 0; i < n && !inside.empty(); ++i) {
      const Size j = i + 1 == n ? 0 : i + 1;
      keep(row, star_.at[i], star_.at[j], inside);
      if (map_.stored.rows() > 0) {
        keep(row, map_.stored.row(star_.ring[i]), map_.stored.row(star_.ring[j]), inside);
      }
    }
    return inside;
  }

  void keep(double row, const Vector2& q, const Vector2& r, Interval& inside) const {
    const auto positive = [&](std::int64_t ordinal) {
      return numeric::orientation(point(row, ordinal), q, r) > 0;
    };
    // Derivative of orientation(p, q, r) along the row.
    const double slope = row_axis_ == 1 ? q.y() - r.y() : r.x() - q.x();
    if (inside.empty()) return;
    if (slope == 0.0) {
      if (!positive(inside.low)) inside.high = inside.low - 1;
      return;
    }
    // The last admissible value on the side where they end.
    const bool rises = slope > 0.0;
    std::int64_t good = rises ? inside.high : inside.low;
    std::int64_t bad = rises ? inside.low - 1 : inside.high + 1;
    if (!positive(good)) {
      inside.high = inside.low - 1;
      return;
    }
    while (count({std::min(good, bad), std::max(good, bad)}) > 2) {
      const std::int64_t middle = between(std::min(good, bad), std::max(good, bad));
      (positive(middle) ? good : bad) = middle;
    }
    (rises ? inside.low : inside.high) = good;
  }

  const PlanarMap& map_;
  const Star& star_;
  std::array<Interval, 2> range_;
  Index row_axis_ = 0;
};

}  // namespace

Room find_room(const PlanarMap& map, const Star& star, std::uint64_t budget) {
  return RoomFinder(map, star).run(budget);
}

std::string narrowest_extent(const Star& star) {
  const Size n = star.ring.size();
  const Size stride = n / 1000 + 1;
  double narrowest = HUGE_VAL;
  std::string text;
  for (Size i = 0; i < n; i += stride) {
    const Size j = i + 1 == n ? 0 : i + 1;
    const Vector2 edge = star.at[j] - star.at[i];
    double widest = 0.0;
    Size far = i;
    for (Size k = 0; k < n; ++k) {
      const Vector2 d = star.at[k] - star.at[i];
      const double distance = std::abs(cross(edge, d)) / edge.norm();
      if (distance > widest) {
        widest = distance;
        far = k;
      }
    }
    if (widest >= narrowest || !(widest > 0.0)) continue;
    narrowest = widest;
    text = "between the edge (" + vertex_id(star.ring[i]) + ", " + vertex_id(star.ring[j]) +
           ") and vertex " + vertex_id(star.ring[far]);
  }
  return text.empty() ? "between vertices that lie on one line" : text;
}

}  // namespace flipfree::embedding
