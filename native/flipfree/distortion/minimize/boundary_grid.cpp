#include "flipfree/distortion/minimize/boundary_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::distortion {
namespace {

// Exact: do two boundary edges have a point in common other than a vertex that both end in?
bool conflict(const std::array<VertexId, 2>& e, const std::array<VertexId, 2>& f,
              const Points2& uv) {
  const auto point = [&](VertexId v) -> Vector2 { return uv.row(v).transpose(); };
  for (const VertexId v : e) {
    for (const VertexId w : f) {
      if (v != w && point(v) == point(w)) return true;  // different vertices in one place
    }
  }
  return numeric::segments_conflict(point(e[0]), point(e[1]), point(f[0]), point(f[1]));
}

}  // namespace

Boundary find_boundary(Index vertex_count, const Triangles& faces) {
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
  Boundary boundary;
  boundary.loops = mesh::boundary_loops(faces, adjacency);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    boundary.edges.push_back({mesh::source(faces, h), mesh::target(faces, h)});
    boundary.vertices.push_back(mesh::source(faces, h));
  }
  std::sort(boundary.vertices.begin(), boundary.vertices.end());
  boundary.vertices.erase(std::unique(boundary.vertices.begin(), boundary.vertices.end()),
                          boundary.vertices.end());
  return boundary;
}

BoundaryGrid::BoundaryGrid(const Boundary& boundary, const Points2& uv)
    : boundary_(boundary), uv_(uv) {
  low_ = Vector2::Zero();
  if (boundary.edges.empty()) {
    begin_.assign(2, 0);
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
  begin_.assign(at(columns_) * at(rows_) + 1, 0);
  const auto for_edges = [&](auto visit) {
    for (std::size_t e = 0; e < boundary.edges.size(); ++e) {
      for_cells(uv.row(boundary.edges[e][0]).transpose(), uv.row(boundary.edges[e][1]).transpose(),
                [&](std::size_t cell) { visit(cell, static_cast<Index>(e)); });
    }
  };
  for_edges([&](std::size_t cell, Index) { ++begin_[cell + 1]; });
  for (std::size_t cell = 0; cell + 1 < begin_.size(); ++cell) begin_[cell + 1] += begin_[cell];
  edges_.resize(at(begin_.back()));
  std::vector<Index> next(begin_.begin(), begin_.end() - 1);
  for_edges([&](std::size_t cell, Index e) { edges_[at(next[cell]++)] = e; });
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
    for (Index c = left; c <= right; ++c) visit(at(r) * at(columns_) + at(c));
  }
}

std::array<Index, 2> BoundaryGrid::first_conflict(const ExecutionContext& context) const {
  for (std::size_t cell = 0; cell + 1 < begin_.size(); ++cell) {
    if (cell % 4096 == 0) context.check();
    for (Index i = begin_[cell]; i < begin_[cell + 1]; ++i) {
      for (Index j = i + 1; j < begin_[cell + 1]; ++j) {
        const Index e = edges_[at(i)];
        const Index f = edges_[at(j)];
        if (conflict(boundary_.edges[at(e)], boundary_.edges[at(f)], uv_)) return {e, f};
      }
    }
  }
  return {kInvalid, kInvalid};
}

void BoundaryGrid::near(const Vector2& point, double radius, std::vector<Index>& edges) const {
  edges.clear();
  const Index left = column(point.x() - radius);
  const Index right = column(point.x() + radius);
  const Index top = row(point.y() + radius);
  for (Index r = row(point.y() - radius); r <= top; ++r) {
    for (Index c = left; c <= right; ++c) {
      const std::size_t cell = at(r) * at(columns_) + at(c);
      edges.insert(edges.end(), edges_.begin() + begin_[cell], edges_.begin() + begin_[cell + 1]);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
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
  return BoundaryGrid(boundary, uv).first_conflict(context)[0] != kInvalid ||
         !turned_loops(boundary, uv).empty();
}

}  // namespace flipfree::distortion
