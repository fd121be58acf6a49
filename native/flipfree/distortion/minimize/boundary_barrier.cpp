#include "flipfree/distortion/minimize/boundary_barrier.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flipfree::distortion {
namespace {

// Reach of the barrier as a share of the surface's edge length: small enough that at low distortion
// a vertex is out of reach of the edges next to its own.
constexpr double kReach = 0.3;

}  // namespace

BoundaryBarrier::BoundaryBarrier(const mesh::Surface& chart)
    : boundary_(find_boundary(static_cast<Index>(chart.vertices.rows()), chart.faces)) {
  vertex_reach_.assign(boundary_.vertices.size(), std::numeric_limits<double>::infinity());
  edge_reach_.reserve(boundary_.edges.size());
  for (const auto& e : boundary_.edges) {
    const double reach = kReach * (chart.vertices.row(e[0]) - chart.vertices.row(e[1])).norm();
    edge_reach_.push_back(reach);
    for (const VertexId v : e) {
      const auto at = std::lower_bound(boundary_.vertices.begin(), boundary_.vertices.end(), v) -
                      boundary_.vertices.begin();
      double& own = vertex_reach_[static_cast<std::size_t>(at)];
      own = std::min(own, reach);
    }
  }

  // Walk every loop once.
  const auto at = [&](VertexId v) {
    return static_cast<std::size_t>(
        std::lower_bound(boundary_.vertices.begin(), boundary_.vertices.end(), v) -
        boundary_.vertices.begin());
  };
  std::vector<std::size_t> leaving(boundary_.vertices.size());
  for (std::size_t e = 0; e < boundary_.edges.size(); ++e) leaving[at(boundary_.edges[e][0])] = e;
  edge_place_.resize(boundary_.edges.size());
  vertex_place_.resize(boundary_.vertices.size());
  edge_loop_.assign(boundary_.edges.size(), kInvalid);
  vertex_loop_.assign(boundary_.vertices.size(), kInvalid);
  for (std::size_t start = 0; start < boundary_.edges.size(); ++start) {
    if (edge_loop_[start] != kInvalid) continue;
    double length = 0;
    for (std::size_t e = start; edge_loop_[e] == kInvalid; e = leaving[at(boundary_.edges[e][1])]) {
      const auto& [a, b] = boundary_.edges[e];
      edge_loop_[e] = vertex_loop_[at(a)] = static_cast<Index>(loop_length_.size());
      edge_place_[e] = vertex_place_[at(a)] = length;
      length += (chart.vertices.row(a) - chart.vertices.row(b)).norm();
    }
    loop_length_.push_back(length);
  }
}

// Surface length along the boundary between a vertex and an edge's first end; infinite between
// different loops.
double BoundaryBarrier::along_boundary(std::size_t vertex, std::size_t edge) const {
  if (vertex_loop_[vertex] != edge_loop_[edge]) return std::numeric_limits<double>::infinity();
  const double apart = std::abs(vertex_place_[vertex] - edge_place_[edge]);
  return std::min(apart, loop_length_[static_cast<std::size_t>(edge_loop_[edge])] - apart);
}

template <typename Visit>
void BoundaryBarrier::for_contacts(const Points2& uv, const Reach& reach, double wider,
                                   Visit visit) const {
  const double reach_scale = wider * reach.factor * reach.unit;
  const BoundaryGrid grid(boundary_, uv);
  std::vector<Index> near;
  for (std::size_t i = 0; i < boundary_.vertices.size(); ++i) {
    const VertexId p = boundary_.vertices[i];
    const Vector2 point = uv.row(p).transpose();
    grid.near(point, reach_scale * vertex_reach_[i], near);
    for (const Index e : near) {
      const auto& [a, b] = boundary_.edges[static_cast<std::size_t>(e)];
      if (a == p || b == p) continue;
      const double ordinary =
          wider * reach.unit * std::min(vertex_reach_[i], edge_reach_[static_cast<std::size_t>(e)]);
      const double far = reach.factor * ordinary;
      const bool neighbours =
          along_boundary(i, static_cast<std::size_t>(e)) * reach.unit < 2 * far / wider;
      const double h = neighbours ? ordinary : far;
      const Vector2 start = uv.row(a).transpose();
      const Vector2 along = uv.row(b).transpose() - start;
      const double square = along.squaredNorm();
      const double t = square > 0 ? std::clamp((point - start).dot(along) / square, 0.0, 1.0) : 0.0;
      const Vector2 offset = point - (start + t * along);
      const double d = std::max(offset.norm(), std::numeric_limits<double>::min());
      if (!(d < h)) continue;
      Contact contact;
      contact.vertices = {p, a, b};
      contact.normal = offset / d;
      contact.t = t;
      const double weight = reach.weight;
      const double x = h / d;
      contact.value = weight * (x - 1) * (x - 1);
      contact.slope = -weight * 2 * (x - 1) * x / d;
      contact.curvature = weight * (2 * x * x + 4 * (x - 1) * x) / (d * d);
      visit(contact);
    }
  }
}

std::vector<BoundaryBarrier::Contact> BoundaryBarrier::contacts(const Points2& uv,
                                                                const Reach& reach) const {
  std::vector<Contact> all;
  for_contacts(uv, reach, 1.0, [&](const Contact& contact) { all.push_back(contact); });
  return all;
}

std::vector<std::array<VertexId, 2>> BoundaryBarrier::couplings(const Points2& uv,
                                                                const Reach& reach) const {
  std::vector<std::array<VertexId, 2>> pairs;
  for_contacts(uv, reach, 2.0, [&](const Contact& contact) {
    for (const VertexId end : {contact.vertices[1], contact.vertices[2]}) {
      pairs.push_back({std::min(contact.vertices[0], end), std::max(contact.vertices[0], end)});
    }
  });
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

double BoundaryBarrier::value(const Points2& uv, const Reach& reach) const {
  double sum = 0;
  for_contacts(uv, reach, 1.0, [&](const Contact& contact) { sum += contact.value; });
  return sum;
}

}  // namespace flipfree::distortion
