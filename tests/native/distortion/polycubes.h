// Surfaces of cubes put together, unfolded along a random tree of their squares: exactly seamless
// maps of any genus, with cones in quarter turns and cut graphs of every shape.
#pragma once

#include <algorithm>
#include <array>
#include <complex>
#include <random>
#include <utility>
#include <vector>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::test {

struct Unfolded {
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  mesh::EdgeFlags cuts;
  Points2 uv;  // 3 #F x 2, integers
};

// The surface of the cells (support/shapes.h), unfolded.
inline Unfolded unfold(const std::vector<Cell>& cells, int n, unsigned seed) {
  using Complex = std::complex<int>;
  Unfolded out;
  out.surface = of_cubes(cells, n);
  out.adjacency = out.surface.adjacency();
  const auto square = [&](HalfedgeId h) { return static_cast<std::size_t>(h / (6 * n * n)); };
  const auto local = [&](CornerId c) {
    constexpr std::array kX = {0, 1, 1, 0, 1, 0}, kY = {0, 0, 1, 0, 1, 1};
    const auto k = static_cast<std::size_t>(c % 6);
    return Complex(c / 6 / n % n + kX[k], c / 6 % n + kY[k]);
  };
  // A random tree of squares, unfolded as it grows.
  std::mt19937 random(seed);
  const auto count = static_cast<HalfedgeId>(out.surface.faces.size());
  const auto mate = [&](HalfedgeId h) {
    return out.adjacency.opposite[static_cast<std::size_t>(h)];
  };
  std::vector<std::pair<Complex, Complex>> placed(square(count));
  std::vector<char> known(placed.size(), 0);
  for (HalfedgeId h = 0; h < count; ++h) out.cuts.push_back(square(h) != square(mate(h)));
  const auto at = [&](CornerId c) {
    const auto& [turn, shift] = placed[square(c)];
    return turn * local(c) + shift;
  };
  known[0] = 1;
  placed[0] = {Complex(1, 0), Complex(0, 0)};
  for (;;) {
    std::vector<HalfedgeId> front;
    for (HalfedgeId h = 0; h < count; ++h) {
      if (known[square(h)] != 0 && known[square(mate(h))] == 0) front.push_back(h);
    }
    if (front.empty()) break;
    const HalfedgeId h =
        front[std::uniform_int_distribution<std::size_t>(0, front.size() - 1)(random)];
    const HalfedgeId o = mate(h);
    const std::size_t from = square(h), to = square(o);
    placed[to] = {Complex(1, 0), Complex(0, 0)};
    const Complex wanted = at(next_corner(h)) - at(h);
    while (at(o) - at(next_corner(o)) != wanted) placed[to].first *= Complex(0, 1);
    placed[to].second = at(h) - at(next_corner(o));
    known[to] = 1;
    // The whole side of the square is joined.
    for (HalfedgeId a = 0; a < count; ++a) {
      const HalfedgeId b = mate(a);
      if (std::minmax(square(a), square(b)) != std::minmax(from, to)) continue;
      if (at(a) == at(next_corner(b)) && at(next_corner(a)) == at(b))
        out.cuts[static_cast<std::size_t>(a)] = 0;
    }
  }
  out.uv.resize(count, 2);
  for (CornerId c = 0; c < count; ++c) out.uv.row(c) << at(c).real(), at(c).imag();
  return out;
}

// One cube; a bent bar; a ring (genus 1); a plate with two holes (genus 2).
inline std::vector<std::vector<Cell>> polycubes() {
  return {{{0, 0, 0}}, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}}, plate(1), plate(2)};
}

inline distortion::CutMap cut_map_of(const Unfolded& u) {
  return distortion::cut_map(u.surface, u.adjacency, u.cuts, u.uv);
}

// All of a square's inner vertices in one spot that is far narrower than the grid of 24 bits.
inline distortion::CutMap crowded() {
  distortion::CutMap map = cut_map_of(unfold(polycubes()[2], 5, 3));
  const distortion::SeamConstraints c = distortion::eliminate_seams(map, ExecutionContext());
  Points2 nodes = distortion::nodes_of(c, map, map.uv);
  for (Index n = 0; n < c.position_count(); ++n) {
    // Squares of 5 x 5 cells at multiples of 5: shrink what lies strictly inside the first one.
    const Vector2 p = nodes.row(n);
    if (p.x() > 0 && p.x() < 5 && p.y() > 0 && p.y() < 5)
      nodes.row(n) = (Vector2(2.5, 2.5) + 1e-9 * (p - Vector2(2.5, 2.5))).transpose();
  }
  map.uv = distortion::map_of(c, nodes);
  return map;
}

// The map with all nodes moved at random by at most `amount`, as long as nothing folds.
inline distortion::CutMap perturbed(distortion::CutMap map, double amount, unsigned seed) {
  const ExecutionContext context;
  const distortion::SeamConstraints c = distortion::eliminate_seams(map, context);
  const Points2 nodes = distortion::nodes_of(c, map, map.uv);
  for (;; amount *= 0.5) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> move(-amount, amount);
    Points2 moved = nodes;
    for (double& x : moved.reshaped()) x += move(random);
    map.uv = distortion::map_of(c, moved);
    if (distortion::is_flip_free(map.surface.faces, map.uv, context)) return map;
  }
}

}  // namespace flipfree::test
