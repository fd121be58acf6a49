#include "flipfree/embedding/disk.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <numeric>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding {

namespace {

// Lengths with every entry raised to at least `share` of the mean, and scaled to sum 1.
std::vector<double> raised(const std::vector<double>& lengths, double share) {
  const double total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  const double mean = total / static_cast<double>(lengths.size());
  if (!(total > 0) || !(share < 1))
    return std::vector<double>(lengths.size(), 1.0 / static_cast<double>(lengths.size()));
  std::vector<double> result = lengths;
  for (double& length : result) length = std::max(length, share * mean);
  const double sum = std::accumulate(result.begin(), result.end(), 0.0);
  for (double& length : result) length /= sum;
  return result;
}

// On the unit circle, as stored if some of these shares of the mean keeps that strictly convex.
Points2 place_circle(const std::vector<double>& lengths, std::initializer_list<double> shares) {
  const auto place = [&](double share) {
    Points2 points(static_cast<Eigen::Index>(lengths.size()), 2);
    double along = 0.0;
    Eigen::Index row = 0;
    for (const double fraction : raised(lengths, share)) {
      const double angle = 2 * std::numbers::pi * along;
      points.row(row++) << std::cos(angle), std::sin(angle);
      along += fraction;
    }
    return points;
  };
  for (const double share : shares) {
    Points2 points = as_stored(place(share));
    if (is_strictly_convex(points)) return points;
  }
  return place(*shares.begin());
}

// Index of the point in each corner of a polygon with equal sides: nearest by arc length, at least
// one edge per side.
std::vector<Index> choose_corners(const std::vector<double>& fractions, Index sides) {
  const Index n = static_cast<Index>(fractions.size());
  std::vector<Index> corners(at(sides), 0);
  double along = 0.0;
  Index point = 0;
  for (Index s = 1; s < sides; ++s) {
    const double goal = static_cast<double>(s) / sides;
    while (point < n && along + fractions[at(point)] / 2 < goal) {
      along += fractions[at(point++)];
    }
    const Index lowest = corners[at(s) - 1] + 1;
    corners[at(s)] = std::clamp(point, lowest, n - (sides - s));
  }
  return corners;
}

Points2 place_polygon(const std::vector<double>& lengths, const Points2& corner_positions) {
  const auto sides = static_cast<Index>(corner_positions.rows());
  const auto n = static_cast<Index>(lengths.size());
  Points2 positions(n, 2);
  for (const double share : {0.02, 0.1, 0.5, 1e300}) {
    const std::vector<double> fractions = raised(lengths, share);
    std::vector<Index> corners = choose_corners(fractions, sides);
    corners.push_back(n);
    for (Index s = 0; s < sides; ++s) {
      const Index end = corners[at(s + 1)];
      const auto first = fractions.begin() + corners[at(s)];
      const double total = std::accumulate(first, fractions.begin() + end, 0.0);
      const Vector2 a = corner_positions.row(s);
      const Vector2 b = corner_positions.row((s + 1) % sides);
      double along = 0.0;
      for (Index i = corners[at(s)]; i < end; ++i) {
        const double t = along / total;
        positions.row(i) = as_stored(Vector2((1 - t) * a + t * b));
        along += fractions[at(i)];
      }
    }
    bool distinct = true;
    for (Index i = 0; i < n; ++i)
      distinct = distinct && positions.row(i) != positions.row((i + 1) % n);
    if (distinct) break;
  }
  return positions;
}

}  // namespace

Points2 spread_on_circle(const std::vector<double>& edge_lengths) {
  return place_circle(edge_lengths, {0.02});
}

int turning_number(const Points2& polygon) {
  const auto n = static_cast<Index>(polygon.rows());
  // Is the direction from a to b in [0, pi)? Comparing coordinates is exact, subtracting them is
  // not.
  const auto points_up = [](const Vector2& a, const Vector2& b) {
    return b.y() > a.y() || (b.y() == a.y() && b.x() > a.x());
  };
  int turns = 0;
  for (Index i = 0; i < n; ++i) {
    const Vector2 previous = polygon.row((i + n - 1) % n), corner = polygon.row(i);
    const Vector2 next = polygon.row((i + 1) % n);
    const bool up_before = points_up(previous, corner);
    const bool up_after = points_up(corner, next);
    if (up_before == up_after) continue;
    // The direction passes the positive x-axis counter-clockwise exactly when it turns left out of
    // the lower half circle into the upper one; clockwise when it turns right (or back) out of the
    // upper one.
    const int side = numeric::orientation(previous, corner, next);
    if (side > 0 && up_after) ++turns;
    if (side <= 0 && up_before) --turns;
  }
  return turns;
}

bool is_strictly_convex(const Points2& p) {
  const auto n = static_cast<Index>(p.rows());
  if (n < 3) return false;
  for (Index i = 0; i < n; ++i) {
    if (numeric::orientation(p.row(i), p.row((i + 1) % n), p.row((i + 2) % n)) <= 0) return false;
  }
  return turning_number(p) == 1;
}

Points2 place_boundary(BoundaryShape shape, const std::vector<double>& edge_lengths) {
  const Index corners = shape == BoundaryShape::kSquare ? 4 : 3;
  if (static_cast<Index>(edge_lengths.size()) < corners) {
    throw_invalid(ErrorCode::kBadBoundary,
                  "The boundary has " + std::to_string(edge_lengths.size()) +
                      " vertices, the shape needs " + std::to_string(corners) +
                      ". Choose the triangle, or subdivide the boundary.");
  }
  for (const double length : edge_lengths) {
    if (!(length >= 0.0) || !std::isfinite(length)) {
      throw_invalid(ErrorCode::kNotFinite,
                    "A boundary edge has no finite length. Check its vertex positions.");
    }
  }
  switch (shape) {
    case BoundaryShape::kCircle:
      return place_circle(edge_lengths, {0.02, 0.1, 0.3, 0.6});
    case BoundaryShape::kSquare: {
      Points2 square(4, 2);
      square << -1, -1, 1, -1, 1, 1, -1, 1;
      return place_polygon(edge_lengths, square);
    }
    case BoundaryShape::kTriangle: {
      Points2 triangle(3, 2);
      const double half = as_stored(std::sqrt(3.0) / 2);
      triangle << -half, -0.5, half, -0.5, 0.0, 1.0;
      return place_polygon(edge_lengths, triangle);
    }
  }
  throw InternalError("unknown boundary shape");
}

void require_convex(const Points2& p, const std::vector<VertexId>& loop) {
  const Index n = static_cast<Index>(p.rows());
  const auto name = [&](Index i) { return at(i) < loop.size() ? loop[at(i)] : i; };
  const auto where = [&](Index i) {
    return std::to_string(i) + " (vertex " + vertex_id(name(i)) + ")";
  };
  if (n < 3) throw_invalid(ErrorCode::kBadBoundary, "A polygon needs at least 3 points.");
  if (!p.allFinite())
    throw_invalid(ErrorCode::kNotFinite, "A boundary position is not finite. Give finite numbers.");
  const double scale = p.cwiseAbs().maxCoeff();
  double twice = 0.0;
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    if (p.row(i) == p.row(j)) {
      throw_invalid(ErrorCode::kBadBoundary,
                    "Boundary points " + where(i) + " and " + where(j) +
                        " coincide. Give them distinct positions.",
                    ElementKind::kVertex, {name(i), name(j)});
    }
    twice += twice_area(p.row(0), p.row(i), p.row(j));
  }
  for (Index i = 0; i < n; ++i) {
    const Vector2 a = p.row((i + n - 1) % n);
    const Vector2 b = p.row(i);
    const Vector2 c = p.row((i + 1) % n);
    if (numeric::orientation(a, b, c) >= 0) continue;
    const double height = std::abs(twice_area(a, b, c)) / (c - a).norm();
    if (twice > 0 && height <= 4 * 0x1p-24 * scale && (b - a).dot(c - b) > 0) continue;
    throw_invalid(
        ErrorCode::kNotConvex,
        twice < 0
            ? std::string("The polygon runs clockwise. Reverse it, or reverse the boundary loop.")
            : "The polygon is not convex at point " + where(i) +
                  ". Give a convex polygon, or use match.",
        ElementKind::kVertex, {name(i)});
  }
  if (!(twice > 0)) {
    throw_invalid(ErrorCode::kNotConvex,
                  "All boundary points lie on one line. Give a polygon with an interior.");
  }
  if (turning_number(p) != 1) {
    throw_invalid(ErrorCode::kNotConvex,
                  "The polygon winds more than once. Give a simple convex polygon.");
  }
}

void require_vertices(const std::vector<VertexId>& loop, Index vertex_count) {
  for (const VertexId v : loop) {
    if (v >= 0 && v < vertex_count) continue;
    throw_invalid(ErrorCode::kIndexOutOfRange,
                  "The boundary loop names vertex " + vertex_id(v) +
                      ", which does not exist. List vertices of the mesh.");
  }
}

void require_disk(const Disk& disk) {
  const auto& loop = disk.loop;
  if (static_cast<Eigen::Index>(loop.size()) != disk.boundary.rows()) {
    throw_invalid(ErrorCode::kBadBoundary,
                  "The boundary loop has " + std::to_string(loop.size()) + " vertices, but " +
                      std::to_string(disk.boundary.rows()) +
                      " positions were given. Give one position per vertex.");
  }
  require_vertices(loop, disk.vertex_count);
  const std::vector<Index> place = places_in(loop, disk.vertex_count);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    if (at(place[at(loop[i])]) == i) continue;
    throw_invalid(ErrorCode::kBadBoundary,
                  "The boundary loop passes vertex " + vertex_id(loop[i]) + " twice. List it once.",
                  ElementKind::kVertex, {loop[i]});
  }
  const mesh::Adjacency adjacency = mesh::build_adjacency(disk.vertex_count, disk.faces);
  Index boundary_edges = 0;
  for (HalfedgeId h = 0; h < disk.faces.size(); ++h) {
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    ++boundary_edges;
    const VertexId a = mesh::source(disk.faces, h), b = mesh::target(disk.faces, h);
    const Index i = place[at(a)];
    if (i != kInvalid && place[at(b)] == (i + 1) % static_cast<Index>(loop.size())) continue;
    throw_invalid(
        ErrorCode::kBadBoundary,
        "The boundary edge from vertex " + vertex_id(a) + " to " + vertex_id(b) +
            " is not in the boundary loop. List the whole boundary in order, surface on the left.",
        ElementKind::kEdge, {a, b});
  }
  if (boundary_edges != static_cast<Index>(loop.size()) ||
      !mesh::topology(disk.faces, adjacency).is_disk()) {
    throw_invalid(ErrorCode::kNotADisk,
                  "The mesh is not a disk with this boundary. Cut it open to a disk first.");
  }
}

std::vector<Index> places_in(const std::vector<VertexId>& loop, Index vertex_count) {
  std::vector<Index> place(at(vertex_count), kInvalid);
  for (std::size_t i = 0; i < loop.size(); ++i) place[at(loop[i])] = static_cast<Index>(i);
  return place;
}

}  // namespace flipfree::embedding
