#include "rational.h"

#include <algorithm>
#include <utility>

namespace flipfree::fuzz {

Rational area(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool share_area(const Corners& p, const Corners& q) {
  const int p_turn = side(p[0], p[1], p[2]);
  const int q_turn = side(q[0], q[1], q[2]);
  if (p_turn == 0 || q_turn == 0) return false;
  std::vector<Point> left(p.begin(), p.end());
  for (std::size_t k = 0; k < 3 && !left.empty(); ++k) {
    const Point& a = q[k];
    const Point& b = q[(k + 1) % 3];
    std::vector<Point> kept;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Point& from = left[i];
      const Point& to = left[(i + 1) % left.size()];
      const Rational f = q_turn * area(a, b, from);
      const Rational t = q_turn * area(a, b, to);
      if (f >= 0) kept.push_back(from);
      if ((f > 0 && t < 0) || (f < 0 && t > 0)) {
        const Rational s = f / (f - t);
        kept.push_back({from.x + s * (to.x - from.x), from.y + s * (to.y - from.y)});
      }
    }
    left = std::move(kept);
  }
  Rational sum = 0;
  for (std::size_t i = 2; i < left.size(); ++i) sum += area(left[0], left[i - 1], left[i]);
  return sum != 0;
}

Meeting meeting(const Point& a, const Point& b, const Point& c, const Point& d) {
  // a + s (b - a) = c + t (d - c)
  const Rational ux = b.x - a.x, uy = b.y - a.y;
  const Rational vx = d.x - c.x, vy = d.y - c.y;
  const Rational wx = c.x - a.x, wy = c.y - a.y;
  const Rational determinant = ux * vy - uy * vx;
  if (determinant != 0) {
    const Rational s = (wx * vy - wy * vx) / determinant;
    const Rational t = (wx * uy - wy * ux) / determinant;
    if (s < 0 || s > 1 || t < 0 || t > 1) return {};
    return {true, false, {a.x + s * ux, a.y + s * uy}};
  }
  if (wx * uy - wy * ux != 0) return {};
  // On one line: places of c and d along ab, which is no point.
  const Rational length = ux * ux + uy * uy;
  Rational low = (wx * ux + wy * uy) / length;
  Rational high = ((d.x - a.x) * ux + (d.y - a.y) * uy) / length;
  if (low > high) std::swap(low, high);
  low = std::max(low, Rational(0));
  high = std::min(high, Rational(1));
  if (low > high) return {};
  return {true, low < high, {a.x + low * ux, a.y + low * uy}};
}

}  // namespace flipfree::fuzz
