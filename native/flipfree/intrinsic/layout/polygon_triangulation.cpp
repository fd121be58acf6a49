#include "flipfree/intrinsic/layout/polygon_triangulation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::intrinsic {

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// Angle of a triangle at a in UV, counter-clockwise from b to c.
double corner_angle(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c) {
  return turn(b.uv - a.uv, c.uv - a.uv);
}

// The part of a polygon between vertices i and j, closed by the diagonal.
struct Chain {
  double cost = 0.0;
  double at_start = 0.0, at_end = 0.0;  // angles of its triangles at i and j
  std::size_t apex = 0;
};

// Of i to j, from all shorter chains.
template <typename Fits>
Chain best_chain(const std::vector<PolygonVertex>& p, const std::vector<double>& angles,
                 Storage storage, const std::vector<Chain>& chains, std::size_t i, std::size_t j,
                 const Fits& fits) {
  Chain best;
  best.cost = kNever;
  for (std::size_t k = i + 1; k < j; ++k) {
    const Chain &left = chains[i * p.size() + k], &right = chains[k * p.size() + j];
    const double sides = left.cost + right.cost;
    if (!(sides < best.cost) || !valid_triangle(p[i], p[k], p[j], storage)) continue;
    const double total = sides + distortion_cost(p[i], p[k], p[j]);
    if (!(total < best.cost)) continue;
    Chain chain{total, 0.0, 0.0, k};
    if (!angles.empty()) {
      if (!fits(k, left.at_end + corner_angle(p[k], p[j], p[i]) + right.at_start)) continue;
      chain.at_start = left.at_start + corner_angle(p[i], p[k], p[j]);
      chain.at_end = right.at_end + corner_angle(p[j], p[i], p[k]);
      // The ends are not complete yet, but can only grow.
      if (chain.at_start > angles[i] + kAngleSlack || chain.at_end > angles[j] + kAngleSlack)
        continue;
    }
    best = chain;
  }
  return best;
}

}  // namespace

bool valid_triangle(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c,
                    Storage storage) {
  if ((a.sides & b.sides & c.sides) != 0) return false;
  return (storage == Storage::k64Only || numeric::orientation(a.stored, b.stored, c.stored) > 0) &&
         numeric::orientation(a.uv, b.uv, c.uv) > 0 &&
         numeric::orientation(a.domain, b.domain, c.domain) > 0;
}

double distortion_cost(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c) {
  const Vector2 e1 = b.domain - a.domain, e2 = c.domain - a.domain;
  const Vector2 f1 = b.uv - a.uv, f2 = c.uv - a.uv;
  // |J|^2 = |f1 (x) e2' - f2 (x) e1'|^2 / area^2 with e' the quarter-turned edges.
  const Vector2 x = f1.x() * e2 - f2.x() * e1, y = f1.y() * e2 - f2.y() * e1;
  const double squared =
      (x.y() * x.y() + x.x() * x.x() + y.y() * y.y() + y.x() * y.x()) / cross(e1, e2);
  const double cost = squared / (2.0 * cross(f1, f2));  // |J|^2 area / (2 det J), det J = f / e
  return cost > 0.0 && cost < kNever ? cost : 1e300;
}

double distortion(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c) {
  return distortion_cost(a, b, c) / twice_area(a.domain, b.domain, c.domain);
}

// Least-cost triangulation by dynamic programming over diagonals (Klincsek 1980). A vertex is
// complete when the triangle that joins the two chains ending in it is chosen; its angles must then
// sum to the prescribed one.
bool triangulate_polygon(const std::vector<PolygonVertex>& polygon,
                         const std::vector<double>& angles, Storage storage,
                         std::vector<PolygonTriangle>& triangles, const ExecutionContext& context) {
  triangles.clear();
  const std::size_t n = polygon.size();
  if (n < 3 || n > kLargestPolygon) return false;
  std::vector<Chain> chains(n * n);
  const auto fits = [&](std::size_t i, double sum) {
    return angles.empty() || std::abs(sum - angles[i]) < kAngleSlack;
  };
  for (std::size_t span = 2; span < n; ++span) {
    context.check();
    for (std::size_t i = 0; i + span < n; ++i)
      chains[i * n + i + span] = best_chain(polygon, angles, storage, chains, i, i + span, fits);
  }
  const Chain& whole = chains[n - 1];
  if (!(whole.cost < kNever) || !fits(0, whole.at_start) || !fits(n - 1, whole.at_end))
    return false;
  std::vector<std::array<std::size_t, 2>> stack{{0, n - 1}};
  while (!stack.empty()) {
    const auto [i, j] = stack.back();
    stack.pop_back();
    if (j < i + 2) continue;
    const std::size_t k = chains[i * n + j].apex;
    triangles.push_back({polygon[i].id, polygon[k].id, polygon[j].id});
    stack.push_back({i, k});
    stack.push_back({k, j});
  }
  return true;
}

std::vector<std::array<Index, 2>> face_chords(const std::array<Index, 3>& count,
                                              const std::vector<PolygonVertex>& polygon) {
  // Per side, the position in the polygon of every corner and point; kInvalid where it is missing.
  std::array<std::vector<Index>, 3> position;
  for (std::size_t k = 0; k < 3; ++k) position[k].assign(at(count[k]) + 1, kInvalid);
  for (std::size_t i = 0; i < polygon.size(); ++i)
    position[at(polygon[i].place.side)][at(polygon[i].place.place)] = static_cast<Index>(i);
  std::vector<std::array<Index, 2>> chords;
  const auto add = [&](Index a, Index b) {
    if (a != kInvalid && b != kInvalid) chords.push_back({std::min(a, b), std::max(a, b)});
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t out = k, across = (k + 1) % 3, in = (k + 2) % 3;
    const Index n_out = count[out], n_across = count[across], n_in = count[in];
    // Around the corner where `in` ends and `out` begins.
    const Index around = std::clamp((n_out + n_in - n_across) / 2, Index{0}, std::min(n_out, n_in));
    for (Index i = 1; i <= around; ++i) add(position[out][at(i)], position[in][at(n_in + 1 - i)]);
    // From that corner to the side opposite to it, between those around its ends.
    for (Index i = n_out + 1; i <= n_across - n_in; ++i)
      add(position[out][0], position[across][at(i)]);
  }
  return chords;
}

bool triangulate_cells(const std::vector<PolygonVertex>& polygon,
                       const std::vector<std::array<Index, 2>>& chords, Storage storage,
                       std::vector<PolygonTriangle>& triangles, const ExecutionContext& context) {
  triangles.clear();
  std::vector<std::array<Index, 2>> sorted = chords;
  // By the later end; of one end, the shortest first.
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a[1] != b[1] ? a[1] < b[1] : a[0] > b[0]; });
  std::vector<Index> open;  // what no chord has cut off yet
  std::vector<PolygonVertex> cell;
  std::vector<PolygonTriangle> local;
  const auto close = [&](std::size_t first) {
    if (open.size() - first < 3) return true;
    cell.clear();
    for (std::size_t i = first; i < open.size(); ++i) cell.push_back(polygon[at(open[i])]);
    if (!triangulate_polygon(cell, {}, storage, local, context)) return false;
    triangles.insert(triangles.end(), local.begin(), local.end());
    return true;
  };
  std::size_t next = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    open.push_back(static_cast<Index>(i));
    for (; next < sorted.size() && at(sorted[next][1]) == i; ++next) {
      std::size_t first = open.size();
      while (first > 0 && open[first - 1] != sorted[next][0]) --first;
      if (first-- == 0) return false;
      if (!close(first)) return false;
      open.resize(first + 1);
      open.push_back(static_cast<Index>(i));
    }
  }
  return close(0);
}

}  // namespace flipfree::intrinsic
