#include "flipfree/certify/measures/seamless.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace flipfree::certify {
namespace {

// a - b as an unevaluated sum of two doubles, exact and unique (Knuth's two-sum): equal differences
// give equal pairs.
struct Difference {
  double head;
  double tail;
  bool operator==(const Difference&) const = default;
  Difference operator-() const { return {-head, -tail}; }
};

Difference exact_difference(double a, double b) {
  const double head = a - b;
  const double b_part = head - a;
  const double a_part = head - b_part;
  return {head, (a - a_part) + (-b - b_part)};
}

// A vector between two corners.
struct Vector {
  Difference x;
  Difference y;
  bool operator==(const Vector&) const = default;
};
Vector vector(const Points2& uv, CornerId from, CornerId to) {
  return {exact_difference(uv(to, 0), uv(from, 0)), exact_difference(uv(to, 1), uv(from, 1))};
}
Vector turned(const Vector& a) { return {-a.y, a.x}; }

double distance(const Vector& a, const Vector& b) {
  return std::hypot((a.x.head - b.x.head) + (a.x.tail - b.x.tail),
                    (a.y.head - b.y.head) + (a.y.tail - b.y.tail));
}

// R^turns of a point.
Vector2 turned(double x, double y, Index turns) {
  if (turns == 0) return {x, y};
  if (turns == 1) return {-y, x};
  if (turns == 2) return {-x, -y};
  return {y, -x};
}

}  // namespace

std::vector<SeamMeasure> measure_seams(const mesh::Adjacency& adjacency,
                                       const mesh::EdgeFlags& cuts, const Points2& corner_uv) {
  std::vector<SeamMeasure> measures;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o < h || !cuts[static_cast<std::size_t>(h)]) continue;
    Vector here = vector(corner_uv, h, next_corner(h));
    // The same edge seen from the other side, in the same direction.
    const Vector there = vector(corner_uv, next_corner(o), o);
    SeamMeasure best{h, 0, {}, std::numeric_limits<double>::infinity()};
    for (Index turns = 0; turns < 4; ++turns, here = turned(here)) {
      const double off = here == there ? 0.0
                                       : std::max(distance(here, there),
                                                  std::numeric_limits<double>::denorm_min());
      if (off >= best.deviation) continue;
      best.deviation = off;
      best.quarter_turns = turns;
    }
    const CornerId end = next_corner(o);
    const Vector2 image = turned(corner_uv(h, 0), corner_uv(h, 1), best.quarter_turns);
    best.translation = corner_uv.row(end).transpose() - image;
    measures.push_back(best);
  }
  return measures;
}

std::vector<HalfedgeId> seam_failures(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                                      const Points2& corner_uv) {
  std::vector<HalfedgeId> failures;
  for (const SeamMeasure& seam : measure_seams(adjacency, cuts, corner_uv)) {
    if (seam.deviation != 0) failures.push_back(seam.h);
  }
  return failures;
}

}  // namespace flipfree::certify
