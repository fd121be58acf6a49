#include "flipfree/embedding/progressive/insert.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flipfree/base/plane.h"
#include "flipfree/embedding/progressive/simplify.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

constexpr double kStep = 0.8;   // thesis 3.2.2
constexpr int kMaxSteps = 75;   // thesis 3.2.2
constexpr Size kMaxGoals = 24;  // rays tried around vertices of high degree, evenly spread

// Angle from direction u counter-clockwise to w, in [0, 2 pi).
double positive_turn(const Vector2& u, const Vector2& w) {
  const double angle = turn(u, w);
  return angle < 0 ? angle + 2 * std::numbers::pi : angle;
}

// Largest energy over the closed star with its centre at p.
double worst_energy(const Star& star, const Vector2& p) {
  double worst = 0.0;
  for (Size i = 0; i < star.ring.size(); ++i) {
    const Size j = i + 1 == star.ring.size() ? 0 : i + 1;
    worst = std::max(worst, triangle_energy(p, star.at[i], star.at[j], star.target[i] / 2));
  }
  return worst;
}

// Places `mover`, one end of the edge of the half-edge g = (mover -> stayer), whose ends both lie
// at p0 = the stayer's position.
bool place_mover(PlanarMap& map, HalfedgeId g, InsertScratch& scratch) {
  const VertexId mover = map.mesh.source(g);
  const VertexId stayer = map.mesh.target(g);
  const Vector2 p0 = map.at(stayer);
  // Ring of the mover in counter-clockwise order, starting with the stayer.
  Star& star = scratch.star;
  star.ring.clear();
  star.at.clear();
  star.target.clear();
  HalfedgeId h = g;
  do {
    const VertexId w = map.mesh.target(h);
    star.ring.push_back(w);
    star.at.push_back(w == stayer ? p0 : map.at(w));
    star.target.push_back(2 * map.unit * map.share[static_cast<Size>(h / 3)]);
    h = map.mesh.rotate(h);
  } while (h != g);

  // Goals: inner vertices of the fan and midpoints of its edges; its ends lie on the border of the
  // sector.
  const Size n = star.ring.size();
  const Size last =
      2 * n - 4;  // goals 0 .. last - 1: midpoint of (1, 2), vertex 2, midpoint of (2, 3), ...
  const Size goals = n >= 3 ? last - 1 : 0;
  const Size stride = (goals + kMaxGoals - 1) / kMaxGoals;
  double best_energy = HUGE_VAL;
  Vector2 best = p0;
  const auto try_goal = [&](const Vector2& goal) {
    const Vector2 d = goal - p0;
    // Largest step that keeps the triangles with p0 in place positive, in floating point.
    double bound = 1.0;
    for (Size i = 1; i + 1 < n; ++i) {
      const Vector2 q = star.at[i] - p0;
      const Vector2 r = star.at[i + 1] - p0;
      const double area = cross(q, r);
      const double slope = -(d.x() * (r.y() - q.y()) - d.y() * (r.x() - q.x()));
      if (slope < 0 && area > 0) bound = std::min(bound, area / -slope);
    }
    double t = 1.0;
    int k = 0;
    if (bound < 1.0 && bound > 0.0) {
      k = std::max(0, static_cast<int>(std::ceil(std::log(bound) / std::log(kStep))) - 1);
      t = std::pow(kStep, k);
    }
    // The thesis takes the first valid step. It lies close to the far side of the ring; going on
    // while the energy falls costs two or three evaluations and saves many smoothing steps.
    double here = HUGE_VAL;
    for (; k < kMaxSteps; ++k, t *= kStep) {
      const Vector2 p = map.snap(p0 + t * d);
      if (p == p0) break;
      const double energy = worst_energy(star, p);
      if (energy >= here && here < HUGE_VAL) break;
      if (!(energy < HUGE_VAL) || !star_positive(map, star, p)) continue;
      here = energy;
      if (energy < best_energy) {
        best_energy = energy;
        best = p;
      }
    }
  };
  for (Size k = 0; k < goals; k += stride) {
    const Size i = 1 + k / 2;
    try_goal(k % 2 == 0 ? Vector2((star.at[i] + star.at[i + 1]) / 2) : star.at[i + 1]);
  }
  if (!(best_energy < HUGE_VAL)) return false;
  map.move(mover, best);
  return true;
}

}  // namespace

bool insert_vertex(PlanarMap& map, HalfedgeId h, InsertScratch& scratch) {
  const VertexId m = map.mesh.source(h);
  const HalfedgeId g = map.mesh.opposite(h);
  const VertexId v0 = map.mesh.target(h);
  const Vector2 p0 = map.at(v0);
  const Vector2 before = map.at(m);
  const double angle = positive_turn(map.at(map.mesh.apex(h)) - p0, map.at(map.mesh.apex(g)) - p0);
  split_vertex(map, h);
  map.move(m, p0);
  // m's fan runs from a counter-clockwise to b.
  const bool m_moves = angle < std::numbers::pi;
  if (place_mover(map, m_moves ? h : g, scratch)) return true;
  if (place_mover(map, m_moves ? g : h, scratch)) return true;
  map.move(v0, p0);
  map.move(m, before);
  collapse_vertex(map, h);
  return false;
}

}  // namespace flipfree::embedding
