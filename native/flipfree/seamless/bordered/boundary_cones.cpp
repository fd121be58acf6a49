#include "flipfree/seamless/bordered/boundary_cones.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/conformal/cones/boundary_angles.h"
#include "flipfree/mesh/own_unit.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/seamless/bordered/corners.h"

namespace flipfree::seamless {
namespace {

// Sum of the curvatures inside a surface that is as good as flat, quarter turns.
constexpr double kNearlyFlat = 0.2;

struct Border {
  std::vector<std::vector<VertexId>> loops;
  std::vector<char> on_boundary;
  Index euler = 0;
};

Border border_of(const mesh::Surface& surface) {
  const auto count = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(count, surface.faces);
  Border border{mesh::boundary_loops(surface.faces, adjacency), std::vector<char>(at(count), 0),
                mesh::topology(surface.faces, adjacency).euler()};
  for (const auto& loop : border.loops) {
    for (const VertexId v : loop) border.on_boundary[at(v)] = 1;
  }
  return border;
}

[[noreturn]] void throw_too_sharp(Index v, Index k) {
  throw_invalid(ErrorCode::kBadAngles,
                "The cone at vertex " + std::to_string(v) + " has " + std::to_string(k) +
                    " quarter turns. Give every cone at least 1 (4 is flat inside, 2 is straight "
                    "at the boundary).",
                ElementKind::kVertex, {v});
}

// What the boundary has to turn in all, quarter turns: 4 chi less the curvature inside.
Index needed_turning(const Border& border, const std::vector<Index>& cones) {
  Index needed = 4 * border.euler;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (border.on_boundary[v]) continue;
    if (cones[v] < 1) throw_too_sharp(static_cast<Index>(v), cones[v]);
    needed -= 4 - cones[v];
  }
  return needed;
}

// Quarter turns.
double corner_angle(const mesh::Surface& surface, Eigen::Index f, Eigen::Index k) {
  const Vector3 p = surface.vertices.row(surface.faces(f, k));
  const Vector3 a = surface.vertices.row(surface.faces(f, (k + 1) % 3)).transpose() - p;
  const Vector3 b = surface.vertices.row(surface.faces(f, (k + 2) % 3)).transpose() - p;
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kQuarterTurn;
}

// Total angles of the surface at its vertices, quarter turns.
std::vector<double> own_angles(const mesh::Surface& surface) {
  std::vector<double> angle(at(static_cast<Index>(surface.vertices.rows())), 0.0);
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) angle[at(surface.faces(f, k))] += corner_angle(surface, f, k);
  }
  return angle;
}

// Whole numbers near to the given ones with a given sum.
std::vector<Index> whole_with_sum(const std::vector<double>& values, Index sum) {
  std::vector<Index> whole;
  for (const double x : values) whole.push_back(static_cast<Index>(std::lround(x)));
  Index missing = sum - std::accumulate(whole.begin(), whole.end(), Index{0});
  const Index step = missing < 0 ? -1 : 1;
  for (; missing != 0; missing -= step) {
    std::size_t best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < whole.size(); ++i) {
      const double lacks = step * (values[i] - whole[i]);
      if (lacks > most) {
        most = lacks;
        best = i;
      }
    }
    whole[best] += step;
  }
  return whole;
}

// Directions of the half-edges of a connected surface, quarter turns: unfolded face after face, so
// that where it is flat they are those in the plane.
std::vector<double> unfolded_directions(const mesh::Surface& surface,
                                        const mesh::Adjacency& adjacency) {
  std::vector<double> direction(adjacency.opposite.size(), 0.0);
  const auto unfold = [&](HalfedgeId h) {
    for (int k = 0; k < 2; ++k, h = next_corner(h)) {
      const HalfedgeId next = next_corner(h);
      const double turning = 2.0 - corner_angle(surface, next / 3, next % 3);
      direction[at(next)] = direction[at(h)] + turning;
    }
  };
  std::vector<char> reached(static_cast<std::size_t>(surface.faces.rows()), 0);
  std::vector<FaceId> queue = {0};
  reached[0] = 1;
  unfold(0);
  for (std::size_t i = 0; i < queue.size(); ++i) {
    for (HalfedgeId h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o == kInvalid || reached[at(o / 3)] != 0) continue;
      reached[at(o / 3)] = 1;
      direction[at(o)] = direction[at(h)] + 2.0;
      unfold(o);
      queue.push_back(o / 3);
    }
  }
  return direction;
}

// Is the surface so flat inside that one unfolding of it is like another, and is its map to be?
bool is_flat_inside(const Border& border, const std::vector<double>& angles,
                    const std::vector<Index>& cones) {
  double curved = 0.0;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (border.on_boundary[v]) continue;
    if (cones[v] != 4) return false;
    curved += std::abs(4.0 - angles[v]);
  }
  return curved < kNearlyFlat;
}

// Curves of the boundary, as long and as bent as they are, that turn as they are wanted to.
std::vector<BorderCurve> border_curves(const mesh::Surface& surface,
                                       const std::vector<double>& angles,
                                       const std::vector<Index>& wanted, bool flat) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(angles.size()), surface.faces);
  const std::vector<double> direction = unfolded_directions(surface, adjacency);
  std::vector<BorderCurve> curves;
  for (const auto& loop : mesh::boundary_halfedge_loops(surface.faces, adjacency)) {
    BorderCurve curve;
    curve.direction = direction[at(loop.front())];
    curve.part = flat ? 0 : static_cast<Index>(curves.size());
    curve.wanted = wanted[curves.size()];
    for (const HalfedgeId h : loop) {
      const VertexId from = mesh::source(surface.faces, h), to = mesh::target(surface.faces, h);
      curve.length.push_back((surface.vertices.row(from) - surface.vertices.row(to)).stableNorm());
      curve.turning.push_back(2.0 - angles[at(from)]);
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

[[noreturn]] void throw_sum(Index sum, Index needed) {
  throw_infeasible(ErrorCode::kGaussBonnet,
                   "The corners at the boundary turn by " + std::to_string(sum) +
                       " quarter turns (2 - k each), but the surface and its cones need " +
                       std::to_string(needed) + " (Gauss-Bonnet). " +
                       (sum > needed ? "Add " + std::to_string(sum - needed) + " to"
                                     : "Take " + std::to_string(needed - sum) + " from") +
                       " the sum of the quarter turns k.",
                   {"angle sum",
                    {{"sum", {static_cast<double>(sum) * kQuarterTurn}},
                     {"needed", {static_cast<double>(needed) * kQuarterTurn}}}});
}

[[noreturn]] void throw_too_few(std::size_t vertices, Index wanted) {
  throw_infeasible(ErrorCode::kGaussBonnet,
                   "A boundary of " + std::to_string(vertices) + " vertices cannot turn by " +
                       std::to_string(wanted) +
                       " quarter turns: a corner turns by one. Subdivide its edges, or add cones "
                       "of 3 quarter turns inside.",
                   {"corner turning",
                    {{"vertices", {static_cast<double>(vertices)}},
                     {"turning", {static_cast<double>(wanted) * kQuarterTurn}}}});
}

}  // namespace

std::vector<Index> flat_inside(std::vector<Index> cones, const mesh::Adjacency& adjacency) {
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const HalfedgeId h = adjacency.vertex_halfedge[v];
    if (cones[v] == kNotGiven && adjacency.opposite[at(h)] != kInvalid) cones[v] = 4;
  }
  return cones;
}

std::vector<Index> aligned_cones(const mesh::Surface& surface, const std::vector<Index>& cones,
                                 ExecutionContext& context) {
  const Border border = border_of(surface);
  if (border.loops.empty()) return cones;
  const Index needed = needed_turning(border, cones);
  std::vector<Index> all = cones;
  Index sum = 0;
  bool any = false;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (!border.on_boundary[v]) continue;
    if (cones[v] < kNotGiven) throw_too_sharp(static_cast<Index>(v), cones[v]);
    any = any || cones[v] != kNotGiven;
    if (cones[v] == kNotGiven) all[v] = 2;
    sum += 2 - all[v];
  }
  if (any) {
    if (sum != needed) throw_sum(sum, needed);
    return all;
  }
  const mesh::InOwnUnit own(surface);
  const std::vector<double> angles = own_angles(own.surface());
  std::vector<double> turning;
  for (const auto& loop : border.loops) {
    turning.push_back(0.0);
    for (const VertexId v : loop) turning.back() += 2.0 - angles[at(v)];
  }
  const std::vector<Index> wanted = whole_with_sum(turning, needed);
  const bool flat = is_flat_inside(border, angles, cones);
  const auto corners = choose_corners(border_curves(own.surface(), angles, wanted, flat), context);
  for (std::size_t i = 0; i < border.loops.size(); ++i) {
    if (corners[i].empty()) throw_too_few(border.loops[i].size(), wanted[i]);
    for (std::size_t j = 0; j < corners[i].size(); ++j) all[at(border.loops[i][j])] = corners[i][j];
  }
  return all;
}

std::vector<VertexId> inner_cones(const std::vector<Index>& cones, const Triangles& faces,
                                  const mesh::Adjacency& adjacency) {
  std::vector<VertexId> vertices;
  for (const auto& [v, angle] : prescribed_angles(cones, faces, adjacency, false))
    vertices.push_back(v);
  return vertices;
}

std::vector<std::pair<VertexId, double>> prescribed_angles(const std::vector<Index>& cones,
                                                           const Triangles& faces,
                                                           const mesh::Adjacency& adjacency,
                                                           bool aligned) {
  std::vector<char> border(cones.size(), 0);
  for (const auto& loop : mesh::boundary_loops(faces, adjacency)) {
    for (const VertexId v : loop) border[at(v)] = 1;
  }
  std::vector<std::pair<VertexId, double>> angles;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (border[v] != 0 ? aligned && cones[v] != kNotGiven : cones[v] != 4)
      angles.emplace_back(static_cast<VertexId>(v), cones[v] * kQuarterTurn);
  }
  return angles;
}

void check_free(const mesh::Surface& surface, const std::vector<Index>& cones) {
  const Border border = border_of(surface);
  for (std::size_t v = 0; v < cones.size(); ++v) {
    if (border.on_boundary[v] && cones[v] != kNotGiven) {
      throw_invalid(ErrorCode::kBadAngles,
                    "Vertex " + std::to_string(v) +
                        " lies on the boundary, which is free: its angle cannot be given. Leave "
                        "it out, or take the aligned boundary.",
                    ElementKind::kVertex, {static_cast<Index>(v)});
    }
  }
}

std::vector<double> free_angles(const mesh::Surface& surface, const std::vector<Index>& cones,
                                Boundary boundary, ExecutionContext& context) {
  if (boundary == Boundary::kFree) check_free(surface, cones);
  const Border border = border_of(surface);
  const Index needed = needed_turning(border, cones);
  conformal::BoundaryAnglesOptions options;
  options.shape = conformal::BoundaryGoal::kFree;
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const auto id = static_cast<VertexId>(v);
    if (!border.on_boundary[v] && cones[v] != 4)
      options.cones.emplace_back(id, cones[v] * kQuarterTurn);
  }
  std::vector<double> angles = conformal::boundary_angles(surface, options, context);
  std::vector<double> sum, turning;
  for (const auto& loop : border.loops) {
    sum.push_back(0.0);
    for (const VertexId v : loop) sum.back() += angles[at(v)];
    turning.push_back(2.0 * static_cast<double>(loop.size()) - sum.back() / kQuarterTurn);
  }
  std::vector<Index> wanted;
  if (boundary == Boundary::kTurning) {
    for (const auto& loop : border.loops) {
      wanted.push_back(0);
      for (const VertexId v : loop) wanted.back() += 2 - cones[at(v)];
    }
    const Index sum = std::accumulate(wanted.begin(), wanted.end(), Index{0});
    if (sum != needed) throw_sum(sum, needed);
  } else {
    wanted = whole_with_sum(turning, needed);
  }
  for (std::size_t i = 0; i < border.loops.size(); ++i) {
    const double whole =
        (2.0 * static_cast<double>(border.loops[i].size()) - wanted[i]) * kQuarterTurn;
    for (const VertexId v : border.loops[i]) angles[at(v)] *= whole / sum[i];
  }
  return angles;
}

}  // namespace flipfree::seamless
