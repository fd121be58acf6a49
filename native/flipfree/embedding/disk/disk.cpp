#include "flipfree/embedding/disk/disk.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding {

namespace {

constexpr double kPi = std::numbers::pi;

// Lengths with every entry raised to at least `share` of the mean, and scaled to sum 1.
std::vector<double> raised(const std::vector<double>& lengths, double share) {
  const double total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  const double mean = total / static_cast<double>(lengths.size());
  std::vector<double> result(lengths.size(), 1.0 / static_cast<double>(lengths.size()));
  if (!(total > 0) || !(share < 1)) return result;
  double sum = 0.0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    result[i] = std::max(lengths[i], share * mean);
    sum += result[i];
  }
  for (double& length : result) length /= sum;
  return result;
}

// Does the direction of the edges pass from the lower to the upper half-plane exactly once?
bool winds_once(const Points2& p) {
  const Index n = static_cast<Index>(p.rows());
  const auto upper = [&](Index i) {
    const Index j = i + 1 == n ? 0 : i + 1;
    const double dy = p(j, 1) - p(i, 1);
    return dy > 0 || (dy == 0 && p(j, 0) > p(i, 0));
  };
  int passes = 0;
  for (Index i = 0; i < n; ++i) passes += !upper(i) && upper(i + 1 == n ? 0 : i + 1);
  return passes == 1;
}

Points2 exact_circle_points(const std::vector<double>& fractions) {
  const Index n = static_cast<Index>(fractions.size());
  Points2 points(n, 2);
  double along = 0.0;
  for (Index i = 0; i < n; ++i) {
    points.row(i) << std::cos(2 * kPi * along), std::sin(2 * kPi * along);
    along += fractions[static_cast<std::size_t>(i)];
  }
  return points;
}

Points2 circle_points(const std::vector<double>& fractions) {
  return as_stored(exact_circle_points(fractions));
}

Points2 place_circle(const std::vector<double>& lengths) {
  for (const double share : {0.02, 0.1, 0.3, 0.6}) {
    Points2 points = circle_points(raised(lengths, share));
    if (is_strictly_convex(points)) return points;
  }
  return exact_circle_points(raised(lengths, 0.02));
}

// Index of the point in each corner of a polygon with equal sides: nearest by arc length, at least
// one edge per side.
std::vector<Index> choose_corners(const std::vector<double>& fractions, Index sides) {
  const Index n = static_cast<Index>(fractions.size());
  std::vector<Index> corners(static_cast<std::size_t>(sides), 0);
  double along = 0.0;
  Index point = 0;
  for (Index s = 1; s < sides; ++s) {
    const double goal = static_cast<double>(s) / sides;
    while (point < n && along + fractions[static_cast<std::size_t>(point)] / 2 < goal) {
      along += fractions[static_cast<std::size_t>(point++)];
    }
    const Index lowest = corners[static_cast<std::size_t>(s) - 1] + 1;
    corners[static_cast<std::size_t>(s)] = std::clamp(point, lowest, n - (sides - s));
  }
  return corners;
}

BoundaryPlacement place_polygon(const std::vector<double>& lengths,
                                const Points2& corner_positions) {
  const Index sides = static_cast<Index>(corner_positions.rows());
  const Index n = static_cast<Index>(lengths.size());
  BoundaryPlacement result;
  for (const double share : {0.02, 0.1, 0.5, 1e300}) {
    const std::vector<double> fractions = raised(lengths, share);
    result.corners = choose_corners(fractions, sides);
    result.positions.resize(n, 2);
    bool distinct = true;
    for (Index s = 0; s < sides; ++s) {
      const Index begin = result.corners[static_cast<std::size_t>(s)];
      const Index end = s + 1 == sides ? n : result.corners[static_cast<std::size_t>(s) + 1];
      const auto first = fractions.begin() + begin;
      const double total = std::accumulate(first, fractions.begin() + end, 0.0);
      const Vector2 a = corner_positions.row(s);
      const Vector2 b = corner_positions.row((s + 1) % sides);
      double along = 0.0;
      for (Index i = begin; i < end; ++i) {
        const double t = along / total;
        result.positions(i, 0) = as_stored((1 - t) * a.x() + t * b.x());
        result.positions(i, 1) = as_stored((1 - t) * a.y() + t * b.y());
        along += fractions[static_cast<std::size_t>(i)];
      }
    }
    for (Index i = 0; i < n; ++i) {
      distinct = distinct && result.positions.row(i) != result.positions.row((i + 1) % n);
    }
    if (distinct) break;
  }
  return result;
}

}  // namespace

Points2 spread_on_circle(const std::vector<double>& edge_lengths) {
  const Points2 exact = exact_circle_points(raised(edge_lengths, 0.02));
  const Points2 stored = as_stored(exact);
  return is_strictly_convex(stored) ? stored : exact;
}

bool is_strictly_convex(const Points2& p) {
  const Index n = static_cast<Index>(p.rows());
  if (n < 3) return false;
  for (Index i = 0; i < n; ++i) {
    const Index j = i + 1 == n ? 0 : i + 1;
    const Index k = j + 1 == n ? 0 : j + 1;
    if (numeric::orientation(p.data() + 2 * i, p.data() + 2 * j, p.data() + 2 * k) <= 0)
      return false;
  }
  return winds_once(p);
}

BoundaryPlacement place_boundary(BoundaryShape shape, const std::vector<double>& edge_lengths) {
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
      return {place_circle(edge_lengths), {}};
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
  const auto name = [&](Index i) {
    return static_cast<std::size_t>(i) < loop.size() ? loop[static_cast<std::size_t>(i)] : i;
  };
  const auto at = [&](Index i) {
    return std::to_string(i) + " (vertex " + vertex_id(name(i)) + ")";
  };
  if (n < 3) throw_invalid(ErrorCode::kBadBoundary, "A polygon needs at least 3 points.");
  if (!p.allFinite())
    throw_invalid(ErrorCode::kNotFinite, "A boundary position is not finite. Give finite numbers.");
  const double scale = p.cwiseAbs().maxCoeff();
  double twice_area = 0.0;
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    if (p.row(i) == p.row(j)) {
      throw_invalid(
          ErrorCode::kBadBoundary,
          "Boundary points " + at(i) + " and " + at(j) + " coincide. Give them distinct positions.",
          ElementKind::kVertex, {name(i), name(j)});
    }
    const Vector2 u = (p.row(i) - p.row(0)).transpose();
    const Vector2 w = (p.row(j) - p.row(0)).transpose();
    twice_area += cross(u, w);
  }
  for (Index i = 0; i < n; ++i) {
    const Vector2 a = p.row((i + n - 1) % n);
    const Vector2 b = p.row(i);
    const Vector2 c = p.row((i + 1) % n);
    if (numeric::orientation(a, b, c) >= 0) continue;
    const double height =
        std::abs((b - a).x() * (c - a).y() - (b - a).y() * (c - a).x()) / (c - a).norm();
    if (twice_area > 0 && height <= 4 * 0x1p-24 * scale && (b - a).dot(c - b) > 0) continue;
    throw_invalid(
        ErrorCode::kNotConvex,
        twice_area < 0
            ? std::string("The polygon runs clockwise. Reverse it, or reverse the boundary loop.")
            : "The polygon is not convex at point " + at(i) +
                  ". Give a convex polygon, or use match.",
        ElementKind::kVertex, {name(i)});
  }
  if (!(twice_area > 0)) {
    throw_invalid(ErrorCode::kNotConvex,
                  "All boundary points lie on one line. Give a polygon with an interior.");
  }
  if (!winds_once(p)) {
    throw_invalid(ErrorCode::kNotConvex,
                  "The polygon winds more than once. Give a simple convex polygon.");
  }
}

using Size = std::size_t;

void require_disk_with_boundary(const Triangles& faces, Index vertex_count,
                                const std::vector<VertexId>& loop, const Points2& boundary) {
  if (static_cast<Index>(loop.size()) != boundary.rows()) {
    throw_invalid(ErrorCode::kBadBoundary,
                  "The boundary loop has " + std::to_string(loop.size()) + " vertices, but " +
                      std::to_string(boundary.rows()) +
                      " positions were given. Give one position per vertex.");
  }
  std::vector<Index> place(static_cast<Size>(vertex_count), kInvalid);
  for (Size i = 0; i < loop.size(); ++i) {
    if (loop[i] < 0 || loop[i] >= vertex_count) {
      throw_invalid(ErrorCode::kIndexOutOfRange,
                    "The boundary loop names vertex " + vertex_id(loop[i]) +
                        ", which does not exist. List vertices of the mesh.");
    }
    if (place[static_cast<Size>(loop[i])] != kInvalid) {
      throw_invalid(
          ErrorCode::kBadBoundary,
          "The boundary loop passes vertex " + vertex_id(loop[i]) + " twice. List it once.",
          ElementKind::kVertex, {loop[i]});
    }
    place[static_cast<Size>(loop[i])] = static_cast<Index>(i);
  }
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  Index edges = 0;
  Index used = 0;
  Index boundary_edges = 0;
  for (const HalfedgeId h : adjacency.vertex_halfedge) used += h != kInvalid;
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<Size>(h)];
    edges += o < h;  // also counts boundary edges: kInvalid < h
    if (o != kInvalid) continue;
    ++boundary_edges;
    const Index i = place[static_cast<Size>(mesh::source(faces, h))];
    const Index j = place[static_cast<Size>(mesh::target(faces, h))];
    if (i != kInvalid && j == (i + 1) % static_cast<Index>(loop.size())) continue;
    throw_invalid(
        ErrorCode::kBadBoundary,
        "The boundary edge from vertex " + vertex_id(mesh::source(faces, h)) + " to " +
            vertex_id(mesh::target(faces, h)) +
            " is not in the boundary loop. List the whole boundary in order, surface on the left.",
        ElementKind::kEdge, {mesh::source(faces, h), mesh::target(faces, h)});
  }
  if (boundary_edges != static_cast<Index>(loop.size()) ||
      used - edges + static_cast<Index>(faces.rows()) != 1 ||
      mesh::face_components(adjacency).count != 1) {
    throw_invalid(ErrorCode::kNotADisk,
                  "The mesh is not a disk with this boundary. Cut it open to a disk first.");
  }
}

}  // namespace flipfree::embedding
