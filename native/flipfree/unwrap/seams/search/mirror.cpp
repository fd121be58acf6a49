#include "flipfree/unwrap/seams/search/mirror.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

namespace flipfree::unwrap {
namespace {

// Distance of a vertex from its image, over the largest extent.
constexpr double kMirrorTolerance = 1e-5;
// Costs of mirrored edges that differ by more than this factor are meant to differ.
constexpr double kSameCost = 2.5;
// What a seam on the plane costs: there it stays a single one.
constexpr double kOnPlane = 0.8;

class Matcher {
 public:
  Matcher(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
          const std::vector<double>& cost)
      : chart_(chart), adjacency_(adjacency), cost_(cost) {
    for (std::size_t v = 0; v < adjacency.vertex_halfedge.size(); ++v) {
      if (adjacency.vertex_halfedge[v] == kInvalid) continue;
      used_.push_back(static_cast<VertexId>(v));
      middle_ += place(used_.back());
    }
    middle_ /= std::max(static_cast<double>(used_.size()), 1.0);
    double size = 0.0;
    for (const VertexId v : used_) {
      const Vector3 p = place(v) - middle_;
      size = std::max(size, p.cwiseAbs().maxCoeff());
      spread_ += p * p.transpose();
    }
    tolerance_ = kMirrorTolerance * size;
  }

  Mirror run() {
    if (used_.empty() || !(tolerance_ > 0.0)) return {};
    for (const VertexId v : used_) cells_[key(cell(place(v)))].push_back(v);
    std::vector<Vector3> normals = {Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ()};
    const Eigen::Matrix3d axes =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread_).eigenvectors();
    for (Index k = 0; k < 3; ++k) normals.emplace_back(axes.col(k));
    for (const Vector3& normal : normals) {
      Mirror mirror = across(normal);
      if (!mirror.empty()) return mirror;
    }
    return {};
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Spoke {
    HalfedgeId halfedge;
    VertexId end;  // that it is to have
  };

  Vector3 place(VertexId v) const { return chart_.vertices.row(v).transpose(); }

  // Cells are some tolerances wide: whatever is near lies in the same one or beside it.
  Cell cell(const Vector3& p) const {
    const Vector3 scaled = (p - middle_) / (4.0 * tolerance_);
    return {std::llround(scaled.x()), std::llround(scaled.y()), std::llround(scaled.z())};
  }
  static std::uint64_t key(const Cell& c) {
    std::uint64_t hash = 0;
    for (const std::int64_t x : c)
      hash = (hash ^ static_cast<std::uint64_t>(x)) * 0x9E3779B97F4A7C15ULL;
    return hash;
  }

  // The only vertex that is there, of those on the border or of the others.
  VertexId vertex_at(const Vector3& p, bool border) const {
    VertexId found = kInvalid;
    const Cell home = cell(p);
    for (std::int64_t i = 0; i < 27; ++i) {
      const Cell c = {home[0] + i % 3 - 1, home[1] + i / 3 % 3 - 1, home[2] + i / 9 - 1};
      const auto entry = cells_.find(key(c));
      if (entry == cells_.end()) continue;
      for (const VertexId v : entry->second) {
        if (cell(place(v)) != c || is_border(v) != border) continue;
        if ((place(v) - p).cwiseAbs().maxCoeff() > tolerance_) continue;
        if (found != kInvalid) return kInvalid;
        found = v;
      }
    }
    return found;
  }

  bool is_border(VertexId v) const {
    return mesh::rotate_cw(adjacency_, adjacency_.vertex_halfedge[at(v)]) == kInvalid;
  }

  // In either direction. Around both ends in turn: one of them may be a hub.
  HalfedgeId edge_between(VertexId a, VertexId b) const {
    std::array<Spoke, 2> spokes = {Spoke{adjacency_.vertex_halfedge[at(a)], b},
                                   Spoke{adjacency_.vertex_halfedge[at(b)], a}};
    const std::array<HalfedgeId, 2> first = {spokes[0].halfedge, spokes[1].halfedge};
    for (;;) {
      for (std::size_t i = 0; i < 2; ++i) {
        auto& [h, end] = spokes[i];
        if (mesh::target(chart_.faces, h) == end) return h;
        const HalfedgeId before = previous_corner(h);
        if (mesh::source(chart_.faces, before) == end) return before;
        h = mesh::rotate_ccw(adjacency_, h);
        if (h == kInvalid || h == first[i]) return kInvalid;
      }
    }
  }

  bool may_be_seam(HalfedgeId h) const {
    return adjacency_.opposite[at(h)] != kInvalid &&
           cost_[at(h)] < std::numeric_limits<double>::infinity();
  }

  Mirror across(const Vector3& normal) const {
    Mirror mirror;
    mirror.image.assign(adjacency_.vertex_halfedge.size(), kInvalid);
    bool moves = false;
    for (const VertexId v : used_) {
      const Vector3 p = place(v);
      const VertexId image = vertex_at(p - 2.0 * normal.dot(p - middle_) * normal, is_border(v));
      if (image == kInvalid) return {};
      mirror.image[at(v)] = image;
      moves = moves || image != v;
    }
    if (!moves) return {};
    for (const VertexId v : used_) {
      if (mirror.image[at(mirror.image[at(v)])] != v) return {};
    }
    mirror.edge.assign(cost_.size(), kInvalid);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      const bool border = adjacency_.opposite[at(h)] == kInvalid;
      if (!border && !may_be_seam(h)) continue;
      const HalfedgeId image = edge_between(mirror.image[at(mesh::source(chart_.faces, h))],
                                            mirror.image[at(mesh::target(chart_.faces, h))]);
      if (image == kInvalid || border != (adjacency_.opposite[at(image)] == kInvalid) ||
          (!border && !may_be_seam(image)))
        return {};
      const double own = cost_[at(h)];
      const double other = cost_[at(image)];
      if (!border && !(std::max(own, other) <= kSameCost * std::min(own, other))) return {};
      mirror.edge[at(h)] = image;
    }
    return mirror;
  }

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  std::vector<VertexId> used_;
  Vector3 middle_ = Vector3::Zero();
  Eigen::Matrix3d spread_ = Eigen::Matrix3d::Zero();
  double tolerance_ = 0.0;
  std::unordered_map<std::uint64_t, std::vector<VertexId>> cells_;
};

}  // namespace

Mirror find_mirror(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                   const std::vector<double>& cost) {
  return Matcher(chart, adjacency, cost).run();
}

std::vector<double> mirrored_costs(const Triangles& faces, const Mirror& mirror,
                                   std::vector<double> cost) {
  const std::vector<double> own = cost;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    if (mirror.edge[at(h)] == kInvalid) continue;
    cost[at(h)] = 0.5 * (own[at(h)] + own[at(mirror.edge[at(h)])]);
    const VertexId a = mesh::source(faces, h);
    const VertexId b = mesh::target(faces, h);
    if (mirror.image[at(a)] == a && mirror.image[at(b)] == b) cost[at(h)] *= kOnPlane;
  }
  return cost;
}

}  // namespace flipfree::unwrap
