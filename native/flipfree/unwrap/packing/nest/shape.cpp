#include "flipfree/unwrap/packing/nest/shape.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/plane.h"

namespace flipfree::unwrap {
namespace {

// The corner strictly between first and last (cyclic) that is farthest from their line.
std::pair<std::size_t, double> farthest(const Loop& loop, std::size_t first, std::size_t last) {
  const std::size_t n = loop.size();
  std::pair<std::size_t, double> found{first, -1.0};
  for (std::size_t i = first + 1; i < last; ++i) {
    const double d = distance_to_segment(loop[i % n], loop[first % n], loop[last % n]);
    if (d > found.second) found = {i, d};
  }
  return found;
}

}  // namespace

Loop simplified(const Loop& loop, double tolerance) {
  const std::size_t n = loop.size();
  if (n <= 3) return loop;
  // Two corners far apart stay in any case.
  std::size_t start = 0;
  for (std::size_t i = 1; i < n; ++i) {
    if (loop[i].x() < loop[start].x()) start = i;
  }
  std::size_t other = start;
  for (std::size_t i = 0; i < n; ++i) {
    if ((loop[i] - loop[start]).squaredNorm() > (loop[other] - loop[start]).squaredNorm())
      other = i;
  }
  if (other == start) return {loop[start]};
  if (other < start) other += n;
  std::vector<char> kept(n, 0);
  kept[start] = kept[other % n] = 1;
  std::vector<std::pair<std::size_t, std::size_t>> open = {{start, other}, {other, start + n}};
  std::pair<std::size_t, double> third{start, -1.0};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    const auto [corner, d] = farthest(loop, first, last);
    if (d > tolerance) {
      kept[corner % n] = 1;
      open.emplace_back(first, corner);
      open.emplace_back(corner, last);
    } else if (d > third.second) {
      third = {corner, d};
    }
  }
  if (std::count(kept.begin(), kept.end(), 1) < 3) kept[third.first % n] = 1;
  Loop result;
  for (std::size_t i = 0; i < n; ++i)
    if (kept[i] != 0) result.push_back(loop[i]);
  return result;
}

Shape make_shape(const std::vector<Loop>& outlines, double tolerance, Vector2& middle) {
  Vector2 low = Vector2::Constant(std::numeric_limits<double>::infinity());
  Vector2 high = -low;
  for (const Loop& loop : outlines) {
    for (const Vector2& p : loop) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  middle = 0.5 * (low + high);
  Shape shape;
  shape.slack = tolerance;
  for (const Loop& outline : outlines) {
    Loop loop = simplified(outline, tolerance);
    for (Vector2& p : loop) {
      p -= middle;
      shape.radius = std::max(shape.radius, p.norm());
    }
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vector2 a = outline[i] - middle;
      const Vector2 b = outline[(i + 1) % outline.size()] - middle;
      shape.area += 0.5 * cross(a, b);
    }
    shape.loops.push_back(std::move(loop));
  }
  return shape;
}

Vector2 straight_axis(const std::vector<Loop>& outlines) {
  // Four times the angle of a side is the same for all directions of one cross.
  constexpr double kStraight = 0.9;
  std::complex<double> sum = 0.0;
  double length = 0.0;
  for (const Loop& loop : outlines) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vector2 side = loop[(i + 1) % loop.size()] - loop[i];
      const double own = side.norm();
      if (!(own > 0.0)) continue;
      const std::complex<double> direction(side.x() / own, side.y() / own);
      sum += own * direction * direction * direction * direction;
      length += own;
    }
  }
  if (!(std::abs(sum) > kStraight * length)) return Vector2::Zero();
  const double angle = -0.25 * std::arg(sum);
  return {std::cos(angle), std::sin(angle)};
}

Vector2 squarest_turn(const Shape& shape) {
  constexpr int kTurns = 360;
  double least = std::numeric_limits<double>::infinity();
  Vector2 best(1.0, 0.0);
  for (int i = 0; i < kTurns; ++i) {
    const double angle = kQuarterTurn * i / kTurns;
    const Pose pose{Vector2::Zero(), {std::cos(angle), std::sin(angle)}};
    Vector2 low = Vector2::Constant(std::numeric_limits<double>::infinity());
    Vector2 high = -low;
    for (const Loop& loop : shape.loops) {
      for (const Vector2& p : loop) {
        low = low.cwiseMin(pose(p, 1.0));
        high = high.cwiseMax(pose(p, 1.0));
      }
    }
    if (!((high - low).maxCoeff() < least)) continue;
    least = (high - low).maxCoeff();
    best = pose.turn;
  }
  return best;
}

bool is_straight(const Shape& shape) {
  constexpr double kAlong = 1e-3;
  const Vector2 turn = straight_axis(shape.loops);
  return turn.x() > 0.0 && std::abs(turn.y()) < kAlong;
}

}  // namespace flipfree::unwrap
