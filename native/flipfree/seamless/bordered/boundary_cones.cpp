#include "flipfree/seamless/bordered/boundary_cones.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/conformal/cones/boundary_angles.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::seamless {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

constexpr double kQuarterTurn = 0.5 * std::numbers::pi;

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

// Total angles of the surface at its vertices, quarter turns.
std::vector<double> own_angles(const mesh::Surface& surface) {
  std::vector<double> angle(at(static_cast<Index>(surface.vertices.rows())), 0.0);
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Vector3 p = surface.vertices.row(surface.faces(f, k));
      const Vector3 a = surface.vertices.row(surface.faces(f, (k + 1) % 3)).transpose() - p;
      const Vector3 b = surface.vertices.row(surface.faces(f, (k + 2) % 3)).transpose() - p;
      angle[at(surface.faces(f, k))] += std::atan2(a.cross(b).norm(), a.dot(b)) / kQuarterTurn;
    }
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

// One curve of the boundary: corners where it is sharp, then more or fewer until it turns as it has
// to.
class Curve {
 public:
  Curve(const mesh::Surface& surface, const std::vector<VertexId>& loop,
        const std::vector<double>& angles)
      : loop_(loop) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const VertexId v = loop[i], next = loop[(i + 1) % loop.size()];
      place_.push_back(length_);
      length_ += (surface.vertices.row(v) - surface.vertices.row(next)).norm();
      angle_.push_back(angles[at(v)]);
    }
    // A corner turns together with its neighbours: a jagged edge does not.
    const std::size_t n = loop.size();
    for (std::size_t i = 0; i < n; ++i) {
      const double own = 2.0 - angle_[i];
      const double near = own + 4.0 - angle_[(i + 1) % n] - angle_[(i + n - 1) % n];
      const bool sharp = own * near > 0.0 && std::abs(near) > 0.5;
      k_.push_back(sharp ? std::max<Index>(1, static_cast<Index>(std::lround(angle_[i]))) : 2);
    }
  }

  bool turn_by(Index wanted) {
    Index turning = 0;
    for (const Index k : k_) turning += 2 - k;
    for (; turning < wanted; ++turning) {
      if (!change_sharp(-1) && !add_corner(-1)) return false;
    }
    for (; turning > wanted; --turning) {
      if (!change_sharp(1)) add_corner(1);
    }
    return true;
  }

  void write(std::vector<Index>& cones) const {
    for (std::size_t i = 0; i < loop_.size(); ++i) cones[at(loop_[i])] = k_[i];
  }

 private:
  // Straightens by `step` the corner that asks most for it, if there is one the other way.
  bool change_sharp(Index step) {
    std::size_t best = k_.size();
    for (std::size_t i = 0; i < k_.size(); ++i) {
      if ((step < 0 ? k_[i] <= 2 : k_[i] >= 2)) continue;
      const auto asks = [&](std::size_t j) { return step * (angle_[j] - k_[j]); };
      if (best == k_.size() || asks(i) > asks(best)) best = i;
    }
    if (best == k_.size()) return false;
    k_[best] += step;
    return true;
  }

  // Makes a straight vertex, the one farthest from all corners, a corner; the sharpest if there is
  // none yet. False if all are.
  bool add_corner(Index step) {
    std::size_t best = k_.size();
    double most = -1.0;
    for (std::size_t i = 0; i < k_.size(); ++i) {
      if (step < 0 ? k_[i] != 2 : k_[i] > 2 && !all_bent()) continue;
      const double far = distance_to_corner(i);
      const bool same = best < k_.size() && std::abs(far - most) <= 1e-9 * length_;
      const bool sharper = same && step * (angle_[i] - angle_[best]) > 0.0;
      if (best < k_.size() && !sharper && (same || far < most)) continue;
      best = i;
      most = far;
    }
    if (best == k_.size()) return false;
    k_[best] += step;
    return true;
  }
  bool all_bent() const {
    return std::none_of(k_.begin(), k_.end(), [](Index k) { return k == 2; });
  }
  double distance_to_corner(std::size_t i) const {
    double nearest = length_;
    for (std::size_t j = 0; j < k_.size(); ++j) {
      if (k_[j] == 2) continue;
      const double along = std::abs(place_[i] - place_[j]);
      nearest = std::min({nearest, along, length_ - along});
    }
    return nearest;
  }

  const std::vector<VertexId>& loop_;
  std::vector<double> place_;
  double length_ = 0.0;
  std::vector<double> angle_;
  std::vector<Index> k_;
};

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

}  // namespace

std::vector<Index> flat_inside(std::vector<Index> cones, const mesh::Adjacency& adjacency) {
  for (std::size_t v = 0; v < cones.size(); ++v) {
    const HalfedgeId h = adjacency.vertex_halfedge[v];
    if (cones[v] == kNotGiven && adjacency.opposite[at(h)] != kInvalid) cones[v] = 4;
  }
  return cones;
}

std::vector<Index> aligned_cones(const mesh::Surface& surface, const std::vector<Index>& cones) {
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
  const std::vector<double> angles = own_angles(surface);
  std::vector<double> turning;
  for (const auto& loop : border.loops) {
    turning.push_back(0.0);
    for (const VertexId v : loop) turning.back() += 2.0 - angles[at(v)];
  }
  const std::vector<Index> wanted = whole_with_sum(turning, needed);
  for (std::size_t i = 0; i < border.loops.size(); ++i) {
    Curve curve(surface, border.loops[i], angles);
    if (!curve.turn_by(wanted[i])) {
      throw_infeasible(
          ErrorCode::kGaussBonnet,
          "A boundary of " + std::to_string(border.loops[i].size()) + " vertices cannot turn by " +
              std::to_string(wanted[i]) +
              " quarter turns: a corner turns by one. Subdivide its edges, or add cones of 3 "
              "quarter turns inside.",
          {"corner turning",
           {{"vertices", {static_cast<double>(border.loops[i].size())}},
            {"turning", {wanted[i] * kQuarterTurn}}}});
    }
    curve.write(all);
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
    if (border[v] != 0 ? aligned : cones[v] != 4)
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
