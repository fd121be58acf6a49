// Surfaces of cubes put together, unfolded along a random tree of their squares: exactly seamless
// maps of any genus, with cones in quarter turns and cut graphs of every shape.
#pragma once

#include <array>
#include <complex>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/seams/constraints.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::test {

using Cell = std::array<int, 3>;

struct Unfolded {
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  mesh::EdgeFlags cuts;
  Points2 uv;  // 3 #F x 2, integers
};

// The boundary of the cells, each unit square divided into n x n, unfolded. No two cells may touch
// in an edge or a corner only.
inline Unfolded unfold(const std::vector<Cell>& cells, int n, unsigned seed) {
  using Complex = std::complex<int>;
  const std::set<Cell> solid(cells.begin(), cells.end());
  std::map<Cell, Index> vertex;  // in units of 1/n
  std::vector<Vector3> positions;
  std::vector<std::array<Index, 3>> faces;
  std::vector<std::array<Complex, 3>> local;
  std::vector<int> square;
  int squares = 0;
  for (const Cell& cell : solid) {
    for (int side = 0; side < 6; ++side) {
      const int axis = side / 2;
      const int up = side % 2;
      Cell other = cell;
      other[static_cast<std::size_t>(axis)] += 2 * up - 1;
      if (solid.count(other) != 0) continue;
      // Two axes that turn counter-clockwise seen from outside.
      const auto first = static_cast<std::size_t>((axis + (up != 0 ? 1 : 2)) % 3);
      const auto second = static_cast<std::size_t>((axis + (up != 0 ? 2 : 1)) % 3);
      const auto id = [&](int x, int y) {
        Cell p = {cell[0] * n, cell[1] * n, cell[2] * n};
        p[static_cast<std::size_t>(axis)] += up * n;
        p[first] += x;
        p[second] += y;
        const auto [at, added] = vertex.try_emplace(p, static_cast<Index>(positions.size()));
        if (added) positions.emplace_back(Vector3(p[0], p[1], p[2]) / n);
        return at->second;
      };
      for (int x = 0; x < n; ++x) {
        for (int y = 0; y < n; ++y) {
          faces.push_back({id(x, y), id(x + 1, y), id(x + 1, y + 1)});
          local.push_back({Complex(x, y), Complex(x + 1, y), Complex(x + 1, y + 1)});
          faces.push_back({id(x, y), id(x + 1, y + 1), id(x, y + 1)});
          local.push_back({Complex(x, y), Complex(x + 1, y + 1), Complex(x, y + 1)});
          square.insert(square.end(), 2, squares);
        }
      }
      ++squares;
    }
  }
  Unfolded out;
  out.surface.vertices.resize(static_cast<Eigen::Index>(positions.size()), 3);
  for (std::size_t v = 0; v < positions.size(); ++v)
    out.surface.vertices.row(static_cast<Eigen::Index>(v)) = positions[v].transpose();
  out.surface.faces = Triangles(Eigen::Map<const Triangles>(
      faces.data()->data(), static_cast<Eigen::Index>(faces.size()), 3));
  out.adjacency = out.surface.adjacency();
  // A random tree of squares, unfolded as it grows.
  std::mt19937 random(seed);
  std::vector<std::pair<Complex, Complex>> placed(static_cast<std::size_t>(squares));
  std::vector<char> known(placed.size(), 0);
  out.cuts.assign(3 * faces.size(), 0);
  for (std::size_t h = 0; h < out.cuts.size(); ++h) {
    const auto o = static_cast<std::size_t>(out.adjacency.opposite[h]);
    out.cuts[h] = square[h / 3] != square[o / 3];
  }
  const auto at = [&](HalfedgeId c) {
    const auto f = static_cast<std::size_t>(c / 3);
    const auto& [turn, shift] = placed[static_cast<std::size_t>(square[f])];
    return turn * local[f][static_cast<std::size_t>(c % 3)] + shift;
  };
  known[0] = 1;
  placed[0] = {Complex(1, 0), Complex(0, 0)};
  for (;;) {
    std::vector<HalfedgeId> front;
    for (std::size_t h = 0; h < out.cuts.size(); ++h) {
      const auto o = static_cast<std::size_t>(out.adjacency.opposite[h]);
      if (known[static_cast<std::size_t>(square[h / 3])] != 0 &&
          known[static_cast<std::size_t>(square[o / 3])] == 0)
        front.push_back(static_cast<HalfedgeId>(h));
    }
    if (front.empty()) break;
    const HalfedgeId h =
        front[std::uniform_int_distribution<std::size_t>(0, front.size() - 1)(random)];
    const HalfedgeId o = out.adjacency.opposite[static_cast<std::size_t>(h)];
    const auto to = static_cast<std::size_t>(square[static_cast<std::size_t>(o / 3)]);
    const int from = square[static_cast<std::size_t>(h / 3)];
    placed[to] = {Complex(1, 0), Complex(0, 0)};
    const Complex wanted = at(next_corner(h)) - at(h);
    while (at(o) - at(next_corner(o)) != wanted) placed[to].first *= Complex(0, 1);
    placed[to].second = at(h) - at(next_corner(o));
    known[to] = 1;
    // The whole side of the square is joined.
    for (std::size_t e = 0; e < out.cuts.size(); ++e) {
      const auto mate = static_cast<std::size_t>(out.adjacency.opposite[e]);
      const bool same = (square[e / 3] == from && square[mate / 3] == static_cast<int>(to)) ||
                        (square[e / 3] == static_cast<int>(to) && square[mate / 3] == from);
      if (!same) continue;
      const auto a = static_cast<HalfedgeId>(e);
      const auto b = static_cast<HalfedgeId>(mate);
      if (at(a) == at(next_corner(b)) && at(next_corner(a)) == at(b)) out.cuts[e] = 0;
    }
  }
  out.uv.resize(static_cast<Eigen::Index>(out.cuts.size()), 2);
  for (std::size_t c = 0; c < out.cuts.size(); ++c) {
    const Complex p = at(static_cast<HalfedgeId>(c));
    out.uv.row(static_cast<Eigen::Index>(c)) << p.real(), p.imag();
  }
  return out;
}

// One cube; a bent bar; a ring (genus 1); a plate with two holes (genus 2).
inline std::vector<std::vector<Cell>> polycubes() {
  std::vector<std::vector<Cell>> out{{{0, 0, 0}}, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}}};
  for (const int holes : {1, 2}) {
    out.emplace_back();
    for (int x = 0; x < 2 * holes + 1; ++x) {
      for (int y = 0; y < 3; ++y) {
        if (x % 2 == 0 || y != 1) out.back().push_back({x, y, 0});
      }
    }
  }
  return out;
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
