// A disk's boundary as it is seen from a point inside, with vertices where a star (star_map.h)
// needs them.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/refined/refined_map.h"

namespace flipfree::matchmaker {

constexpr double kTurn = 2 * std::numbers::pi;

inline double angle_of(const Vector2& p) { return std::atan2(p.y(), p.x()); }
// The angle from a to b, counter-clockwise, in (0, 2 pi].
inline double turn_from(double a, double b) {
  const double turn = std::fmod(b - a, kTurn);
  return turn > 0 ? turn : turn + kTurn;
}

class Shore {
 public:
  // `map`, which outlives this, has a convex boundary with `centre` inside; its edges are split.
  Shore(mesh::RefinedMap& map, const Vector2& centre);

  // A vertex strictly between two directions, `turn` apart, near the middle. kInvalid if there can
  // be none in doubles.
  VertexId between(double from, double turn);

  // The vertices strictly between two of the boundary, at least so many: edges are halved for it.
  // Empty if they cannot be.
  std::vector<VertexId> inside(VertexId from, VertexId to, std::size_t count);

 private:
  VertexId next(VertexId v) const;
  Vector2 place(VertexId v) const { return map_.uv.row(v).transpose(); }
  double angle_at(VertexId v) const { return angle_of(place(v) - centre_); }
  double length(VertexId v) const { return (place(next(v)) - place(v)).norm(); }
  std::size_t first_after(double angle) const;
  VertexId split_at(double angle);
  VertexId split(VertexId v, double share);

  mesh::RefinedMap& map_;
  Vector2 centre_;
  std::vector<std::pair<double, VertexId>> rim_;  // direction and vertex, ascending
};

}  // namespace flipfree::matchmaker
