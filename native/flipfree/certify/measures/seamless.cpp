#include "flipfree/certify/measures/seamless.h"

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

Difference difference(double a, double b) {
  const double head = a - b;
  const double b_part = head - a;
  const double a_part = head - b_part;
  return {head, (a - a_part) + (-b - b_part)};
}

}  // namespace

std::vector<HalfedgeId> seam_failures(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                                      const Points2& corner_uv) {
  std::vector<HalfedgeId> failures;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cuts.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    if (o < h || !cuts[static_cast<std::size_t>(h)]) continue;
    const HalfedgeId n = next_corner(h);
    const HalfedgeId m = next_corner(o);
    const Difference x = difference(corner_uv(n, 0), corner_uv(h, 0));
    const Difference y = difference(corner_uv(n, 1), corner_uv(h, 1));
    // The same edge seen from the other side, in the same direction.
    const Difference s = difference(corner_uv(o, 0), corner_uv(m, 0));
    const Difference t = difference(corner_uv(o, 1), corner_uv(m, 1));
    const bool quarter_turn =
        (s == x && t == y) || (s == -y && t == x) || (s == -x && t == -y) || (s == y && t == -x);
    if (!quarter_turn) failures.push_back(h);
  }
  return failures;
}

}  // namespace flipfree::certify
