#include "flipfree/distortion/minimize/boundary_barrier.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {

bool edges_meet(const std::array<VertexId, 2>& e, const std::array<VertexId, 2>& f,
                const Points2& uv) {
  const auto point = [&](VertexId v) -> Vector2 { return uv.row(v).transpose(); };
  for (const VertexId v : e) {
    for (const VertexId w : f) {
      if (v != w && point(v) == point(w)) return true;  // different vertices in one place
    }
  }
  return numeric::segments_conflict(point(e[0]), point(e[1]), point(f[0]), point(f[1]));
}

Boundary find_boundary(Index vertex_count, const Triangles& faces) {
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  Boundary boundary;
  boundary.loops = mesh::boundary_loops(faces, adjacency);
  for (const std::vector<VertexId>& loop : boundary.loops) {
    boundary.vertices.insert(boundary.vertices.end(), loop.begin(), loop.end());
    for (std::size_t i = 0; i < loop.size(); ++i)
      boundary.edges.push_back({loop[i], loop[(i + 1) % loop.size()]});
  }
  return boundary;
}

BoundaryGrid::BoundaryGrid(const Boundary& boundary, const Points2& uv)
    : boundary_(boundary), uv_(uv) {
  low_ = Vector2::Zero();
  if (boundary.edges.empty()) {
    edges_ = Lists<Index>(1, [](const auto&) {});
    return;
  }
  low_ = uv.row(boundary.vertices.front()).transpose();
  Vector2 high = low_;
  for (const VertexId v : boundary.vertices) {
    low_ = low_.cwiseMin(uv.row(v).transpose());
    high = high.cwiseMax(uv.row(v).transpose());
  }
  double length = 0;
  for (const auto& e : boundary.edges) length += (uv.row(e[0]) - uv.row(e[1])).norm();
  // Cells no shorter than the mean edge, and no more than four per edge.
  const auto count = static_cast<double>(boundary.edges.size());
  const Vector2 extent = high - low_;
  // (A closed boundary is longer than its extent, unless squares of lengths vanish among doubles.)
  cell_ = std::max({length / count, extent.maxCoeff() / count,
                    0.5 * std::sqrt(extent.x() / count) * std::sqrt(extent.y()), 1e-300});
  // A map that has left the range of doubles is one cell.
  if (!std::isfinite(cell_) || !extent.allFinite()) cell_ = std::numeric_limits<double>::infinity();
  columns_ = static_cast<Index>(extent.allFinite() ? extent.x() / cell_ : 0.0) + 1;
  rows_ = static_cast<Index>(extent.allFinite() ? extent.y() / cell_ : 0.0) + 1;
  edges_ = Lists<Index>(at(columns_) * at(rows_), [&](const auto& add) {
    for (std::size_t e = 0; e < boundary.edges.size(); ++e) {
      for_cells(uv.row(boundary.edges[e][0]).transpose(), uv.row(boundary.edges[e][1]).transpose(),
                [&](Index cell) { add(cell, static_cast<Index>(e)); });
    }
  });
}

// The cell of a coordinate that many cells from the first, of so many; NaN is in the first.
Index BoundaryGrid::clamped(double cells, Index count) {
  if (!(cells > 0.0)) return 0;
  return static_cast<Index>(std::min(cells, static_cast<double>(count - 1)));
}

Index BoundaryGrid::column(double x) const { return clamped((x - low_.x()) / cell_, columns_); }
Index BoundaryGrid::row(double y) const { return clamped((y - low_.y()) / cell_, rows_); }

// Visits every cell that the segment passes through, widened by far more than the rounding of the
// arithmetic here, so that two segments with a common point always share a cell.
template <typename Visit>
void BoundaryGrid::for_cells(const Vector2& a, const Vector2& b, Visit visit) const {
  const double slack = 1e-6 * cell_;
  const Vector2& bottom = a.y() <= b.y() ? a : b;
  const Vector2& top = a.y() <= b.y() ? b : a;
  const double rise = top.y() - bottom.y();
  const Index first = row(bottom.y() - slack);
  const Index last = row(top.y() + slack);
  for (Index r = first; r <= last; ++r) {
    double from = bottom.x();
    double to = top.x();
    if (first != last && rise > 0) {
      // Part of the segment within this row; clamped, so that steep and flat segments are the same
      // case.
      const double y = low_.y() + r * cell_;
      const double s = std::clamp((y - slack - bottom.y()) / rise, 0.0, 1.0);
      const double t = std::clamp((y + cell_ + slack - bottom.y()) / rise, 0.0, 1.0);
      from = bottom.x() + s * (top.x() - bottom.x());
      to = bottom.x() + t * (top.x() - bottom.x());
    }
    const Index left = column(std::min(from, to) - slack);
    const Index right = column(std::max(from, to) + slack);
    for (Index c = left; c <= right; ++c) visit(r * columns_ + c);
  }
}

std::vector<std::array<Index, 2>> BoundaryGrid::conflicts(std::size_t most,
                                                          const ExecutionContext& context) const {
  std::vector<std::array<Index, 2>> found;
  for (Index cell = 0; cell < edges_.size(); ++cell) {
    if (cell % 4096 == 0) context.check();
    const std::span<const Index> own = edges_[cell];
    for (std::size_t i = 0; i < own.size(); ++i) {
      for (std::size_t j = i + 1; j < own.size(); ++j) {
        if (!edges_meet(boundary_.edges[at(own[i])], boundary_.edges[at(own[j])], uv_)) continue;
        found.push_back({own[i], own[j]});
        if (found.size() == most) return found;
      }
    }
  }
  return found;
}

void BoundaryGrid::near(const Vector2& point, double radius, std::vector<Index>& edges) const {
  edges.clear();
  const Index left = column(point.x() - radius);
  const Index right = column(point.x() + radius);
  const Index top = row(point.y() + radius);
  for (Index r = row(point.y() - radius); r <= top; ++r) {
    for (Index c = left; c <= right; ++c) {
      const std::span<const Index> own = edges_[r * columns_ + c];
      edges.insert(edges.end(), own.begin(), own.end());
    }
  }
  sort_unique(edges);
}

std::vector<std::size_t> turned_loops(const Boundary& boundary, const Points2& uv) {
  const auto less = [&](VertexId p, VertexId q) {
    return uv(p, 0) != uv(q, 0) ? uv(p, 0) < uv(q, 0) : uv(p, 1) < uv(q, 1);
  };
  std::vector<std::size_t> turned;
  if (boundary.loops.size() < 2) return turned;
  std::size_t outermost = 0;
  VertexId leftmost = kInvalid;
  for (std::size_t l = 0; l < boundary.loops.size(); ++l) {
    // A simple polygon turns as it does in its leftmost corner.
    const std::vector<VertexId>& loop = boundary.loops[l];
    const auto i =
        static_cast<std::size_t>(std::min_element(loop.begin(), loop.end(), less) - loop.begin());
    const Vector2 before = uv.row(loop[(i + loop.size() - 1) % loop.size()]).transpose();
    const Vector2 here = uv.row(loop[i]).transpose();
    const Vector2 after = uv.row(loop[(i + 1) % loop.size()]).transpose();
    if (numeric::orientation(before, here, after) >= 0) turned.push_back(l);
    if (leftmost == kInvalid || less(loop[i], leftmost)) {
      leftmost = loop[i];
      outermost = l;
    }
  }
  std::erase(turned, outermost);
  return turned;
}

bool overlaps_itself(const Boundary& boundary, const Points2& uv, const ExecutionContext& context) {
  return !BoundaryGrid(boundary, uv).conflicts(1, context).empty() ||
         !turned_loops(boundary, uv).empty();
}

bool overlaps_itself(const Triangles& faces, const Points2& uv, const ExecutionContext& context) {
  return overlaps_itself(find_boundary(static_cast<Index>(uv.rows()), faces), uv, context);
}

BoundaryBarrier::BoundaryBarrier(const mesh::Surface& chart)
    : boundary_(find_boundary(static_cast<Index>(chart.vertices.rows()), chart.faces)) {
  // Reach of the barrier as a share of the surface's edge length: small enough that at low
  // distortion a vertex is out of reach of the edges next to its own.
  constexpr double kReach = 0.3;
  for (const std::vector<VertexId>& loop : boundary_.loops) {
    double length = 0;
    double before = (chart.vertices.row(loop.back()) - chart.vertices.row(loop.front())).norm();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const VertexId a = loop[i], b = loop[(i + 1) % loop.size()];
      const double own = (chart.vertices.row(a) - chart.vertices.row(b)).norm();
      stations_.push_back({kReach * own, kReach * std::min(own, before), length,
                           static_cast<Index>(loop_length_.size())});
      length += own;
      before = own;
    }
    loop_length_.push_back(length);
  }
}

// Surface length along the boundary between a vertex and an edge's first end; infinite between
// different loops.
double BoundaryBarrier::along_boundary(const Station& vertex, const Station& edge) const {
  if (vertex.loop != edge.loop) return std::numeric_limits<double>::infinity();
  const double apart = std::abs(vertex.place - edge.place);
  return std::min(apart, loop_length_[static_cast<std::size_t>(edge.loop)] - apart);
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
    grid.near(point, reach_scale * stations_[i].of_vertex, near);
    for (const Index e : near) {
      const auto& [a, b] = boundary_.edges[at(e)];
      if (a == p || b == p) continue;
      const double ordinary =
          wider * reach.unit * std::min(stations_[i].of_vertex, stations_[at(e)].of_edge);
      const double far = reach.factor * ordinary;
      const bool neighbours =
          along_boundary(stations_[i], stations_[at(e)]) * reach.unit < 2 * far / wider;
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

bool BoundaryBarrier::add_to(NewtonSystem& system, const Points2& uv, const Reach& reach,
                             double& energy) const {
  bool fits = true;
  for_contacts(uv, reach, 1.0, [&](const Contact& contact) {
    energy += contact.value;
    const double factor[3] = {1.0, contact.t - 1.0, -contact.t};
    const Vector2& n = contact.normal;
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) {
        const double c = contact.curvature * factor[i] * factor[j];
        const double xx = c * n.x() * n.x(), xy = c * n.x() * n.y(), yy = c * n.y() * n.y();
        const VertexId v = contact.vertices[at(i)];
        if (i != j) {
          const double block[4] = {xx, xy, xy, yy};
          fits = system.add_block(v, contact.vertices[at(j)], block) && fits;
          continue;
        }
        const double block[3] = {xx, xy, yy};
        const double gradient[2] = {contact.slope * factor[i] * n.x(),
                                    contact.slope * factor[i] * n.y()};
        system.add(v, gradient, block);
      }
    }
  });
  return fits;
}

std::vector<std::array<VertexId, 2>> BoundaryBarrier::couplings(const Points2& uv,
                                                                const Reach& reach) const {
  std::vector<std::array<VertexId, 2>> pairs;
  for_contacts(uv, reach, 2.0, [&](const Contact& contact) {
    for (const VertexId end : {contact.vertices[1], contact.vertices[2]}) {
      pairs.push_back({std::min(contact.vertices[0], end), std::max(contact.vertices[0], end)});
    }
  });
  sort_unique(pairs);
  return pairs;
}

double BoundaryBarrier::value(const Points2& uv, const Reach& reach) const {
  double sum = 0;
  for_contacts(uv, reach, 1.0, [&](const Contact& contact) { sum += contact.value; });
  return sum;
}

}  // namespace flipfree::distortion
