#include "flipfree/certify/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/tolerances.h"

namespace flipfree::certify {
namespace {

using EdgeEnds = std::pair<VertexId, VertexId>;

// A side of an edge of the map's surface that lies on a feature.
struct Piece {
  Index feature = kInvalid;
  double from = 0.0, to = 0.0;  // shares of the way along the feature
  HalfedgeId h = kInvalid;
};

class Tracer {
 public:
  Tracer(const IndexPairs& features, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
         const Provenance& parent)
      : surface_(surface), adjacency_(adjacency), parent_(parent) {
    for (Eigen::Index i = 0; i < features.rows(); ++i)
      wanted_.emplace_back(std::minmax(features(i, 0), features(i, 1)), static_cast<Index>(i));
    std::sort(wanted_.begin(), wanted_.end());
  }

  std::vector<Piece> pieces() const {
    std::vector<Piece> found;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(3 * surface_.faces.rows()); ++h) {
      if (parent_.parent == nullptr) {
        add({mesh::source(surface_.faces, h), mesh::target(surface_.faces, h)}, 0.0, 1.0, h, found);
        continue;
      }
      const FaceId f = (*parent_.parent_face)[at(h / 3)];
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o != kInvalid && (*parent_.parent_face)[at(o / 3)] == f) continue;
      for (int k = 0; k < 3; ++k) {
        const VertexId a = parent_.parent->faces(f, k), b = parent_.parent->faces(f, (k + 1) % 3);
        const auto [from, on] = place(mesh::source(surface_.faces, h), a, b);
        const auto [to, also_on] = place(mesh::target(surface_.faces, h), a, b);
        if (on && also_on && from < to) add({a, b}, from, to, h, found);
      }
    }
    std::sort(found.begin(), found.end(), [](const Piece& a, const Piece& b) {
      return std::pair(a.feature, a.from) < std::pair(b.feature, b.from);
    });
    return found;
  }

 private:
  // Every row that names the edge; its direction is that of the lower vertex first.
  void add(EdgeEnds edge, double from, double to, HalfedgeId h, std::vector<Piece>& found) const {
    if (edge.first > edge.second) {
      std::swap(edge.first, edge.second);
      from = 1.0 - from;
      to = 1.0 - to;
    }
    for (auto i = std::lower_bound(wanted_.begin(), wanted_.end(), std::pair(edge, Index{0}));
         i != wanted_.end() && i->first == edge; ++i)
      found.push_back({i->second, std::min(from, to), std::max(from, to), h});
  }

  // How far along the parent's edge a vertex lies, and whether it does.
  std::pair<double, bool> place(VertexId v, VertexId a, VertexId b) const {
    const FaceId f = (*parent_.vertex_parent)[at(v)];
    double to_a = 0.0, to_b = 0.0;
    for (int k = 0; k < 3; ++k) {
      const VertexId corner = parent_.parent->faces(f, k);
      if (corner == a) to_a = (*parent_.vertex_barycentric)(v, k);
      if (corner == b) to_b = (*parent_.vertex_barycentric)(v, k);
    }
    return {to_b, to_a + to_b >= 1.0 - kProvenanceTolerance};
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const Provenance& parent_;
  std::vector<std::pair<EdgeEnds, Index>> wanted_;
};

// Whether the corners on the left between two sides of one boundary, the first of which ends where
// the second begins, make half a turn.
bool goes_straight(HalfedgeId in, HalfedgeId out, const mesh::Adjacency& adjacency,
                   const Points2& uv) {
  double turned = 0.0;
  const HalfedgeId first = next_corner(in);
  HalfedgeId h = first;
  do {
    const Vector2 p = uv.row(h);
    turned += turn(Vector2(uv.row(next_corner(h)).transpose() - p),
                   Vector2(uv.row(previous_corner(h)).transpose() - p));
    if (h == out) return std::lround(turned / (0.5 * std::numbers::pi)) == 2;
    const HalfedgeId o = adjacency.opposite[at(h)];
    h = o == kInvalid ? kInvalid : next_corner(o);
  } while (h != kInvalid && h != first);
  return false;
}

}  // namespace

void throw_no_edge(VertexId a, VertexId b, Eigen::Index vertex_count) {
  std::vector<Index> existing;
  for (const VertexId v : {a, b}) {
    if (v >= 0 && v < vertex_count) existing.push_back(v);
  }
  throw_invalid(ErrorCode::kNotAnEdge,
                "Feature " + vertex_id(a) + "-" + vertex_id(b) +
                    " is no edge of the mesh. Name pairs of vertices that an edge joins.",
                ElementKind::kVertex, std::move(existing));
}

std::vector<Index> missed_features(const IndexPairs& features, const mesh::Surface& surface,
                                   const mesh::Adjacency& adjacency, const Provenance& parent,
                                   const Points2& corner_uv) {
  std::vector<char> found(static_cast<std::size_t>(features.rows()), 0);
  std::vector<char> bent(found.size(), 0);
  const std::vector<Piece> pieces = Tracer(features, surface, adjacency, parent).pieces();
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    found[at(piece.feature)] = 1;
    const auto from = corner_uv.row(piece.h), to = corner_uv.row(next_corner(piece.h));
    if (from.x() != to.x() && from.y() != to.y()) bent[at(piece.feature)] = 1;
    // The next piece of this side begins where this one ends.
    for (std::size_t k = i + 1; k < pieces.size() && pieces[k].feature == piece.feature &&
                                pieces[k].from <= piece.to + kProvenanceTolerance;
         ++k) {
      const HalfedgeId h = piece.h, n = pieces[k].h;
      const bool goes_on = mesh::target(surface.faces, h) == mesh::source(surface.faces, n);
      const bool goes_back = mesh::target(surface.faces, n) == mesh::source(surface.faces, h);
      if (goes_on == goes_back) continue;
      if (!goes_straight(goes_on ? h : n, goes_on ? n : h, adjacency, corner_uv))
        bent[at(piece.feature)] = 1;
    }
  }
  std::vector<Index> missed;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (found[i] == 0)
      throw_no_edge(features(row, 0), features(row, 1),
                    (parent.parent == nullptr ? surface : *parent.parent).vertices.rows());
    if (bent[i] != 0) missed.push_back(static_cast<Index>(i));
  }
  return missed;
}

}  // namespace flipfree::certify
