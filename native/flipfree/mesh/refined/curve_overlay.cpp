#include "flipfree/mesh/refined/curve_overlay.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "flipfree/base/error.h"

namespace flipfree::mesh {
CurveOverlay::CurveOverlay(RefinedSurface& surface)
    : surface_(surface), mesh_(surface.mesh), base_vertices_(surface.mesh.vertex_count()) {
  parent_.assign(static_cast<std::size_t>(mesh_.face_slots()), kInvalid);
  for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
    if (!mesh_.alive(f)) continue;
    parent_[at(f)] = mesh_.parent(f);
    mesh_.set_parent(f, f);
  }
}

bool CurveOverlay::on_base_edge(HalfedgeId h) const {
  return mesh_.is_boundary(h) || mesh_.parent(h / 3) != mesh_.parent(mesh_.opposite(h) / 3);
}

bool CurveOverlay::borders(HalfedgeId h) const {
  return mesh_.mark(h) != EditableTriangulation::kUnmarked || on_base_edge(h);
}

// The cell of h's face, its outline from the source of h on.
CurveOverlay::Cell CurveOverlay::cell_at(HalfedgeId h) const {
  Cell cell;
  cell.faces.push_back(h / 3);
  for (std::size_t i = 0; i < cell.faces.size(); ++i) {
    for (HalfedgeId g = 3 * cell.faces[i]; g < 3 * cell.faces[i] + 3; ++g) {
      if (borders(g)) continue;
      const FaceId next = mesh_.opposite(g) / 3;
      if (std::find(cell.faces.begin(), cell.faces.end(), next) == cell.faces.end())
        cell.faces.push_back(next);
    }
  }
  HalfedgeId first = h;
  while (!borders(first)) first = mesh_.rotate_cw(first);
  HalfedgeId g = first;
  do {
    cell.outline.push_back(mesh_.source(g));
    g = next_corner(g);
    while (!borders(g)) g = next_corner(mesh_.opposite(g));
  } while (g != first);
  return cell;
}

// Divides a cell from its first corner to another one, which is not beside it.
void CurveOverlay::cut(const Cell& cell, VertexId there, Index mark) {
  const auto& loop = cell.outline;
  const auto end =
      static_cast<std::size_t>(std::find(loop.begin(), loop.end(), there) - loop.begin());
  std::vector<EditableTriangulation::Triangle> triangles;
  for (std::size_t i = 1; i + 1 < loop.size(); ++i) {
    if (i < end) triangles.push_back({loop[0], loop[i], loop[i + 1]});
    if (i > end) triangles.push_back({loop[end], loop[i], loop[i + 1]});
  }
  triangles.push_back({loop[end], loop.back(), loop[0]});
  const std::vector<FaceId> parents(triangles.size(), mesh_.parent(cell.faces.front()));
  mesh_.replace(cell.faces, triangles, parents);
  mesh_.set_mark(mesh_.find(loop[0], there), mark);
}

// The first half-edge that leaves v and of which it is true; kInvalid: none.
template <typename Test>
HalfedgeId CurveOverlay::outgoing_with(VertexId v, const Test& test) const {
  HalfedgeId found = kInvalid;
  mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
    if (found == kInvalid && test(h)) found = h;
  });
  return found;
}

// Is the vertex on the outline of the cell of h's face?
bool CurveOverlay::is_on_cell(HalfedgeId h, VertexId v) const {
  const Cell cell = cell_at(h);
  return std::find(cell.outline.begin(), cell.outline.end(), v) != cell.outline.end();
}

VertexId CurveOverlay::cross(VertexId here, VertexId a, VertexId b, Index mark) {
  const HalfedgeId crossed = mesh_.find(a, b);
  if (crossed == kInvalid || mesh_.is_boundary(crossed) ||
      mesh_.mark(crossed) != EditableTriangulation::kUnmarked || !on_base_edge(crossed) ||
      here == a || here == b)
    return kInvalid;
  const HalfedgeId from = outgoing_with(here, [&](HalfedgeId h) {
    const FaceId base = mesh_.parent(h / 3);
    if (base != mesh_.parent(crossed / 3) && base != mesh_.parent(mesh_.opposite(crossed) / 3))
      return false;
    const Cell cell = cell_at(h);
    const auto in = [&](HalfedgeId g) {
      return std::find(cell.faces.begin(), cell.faces.end(), g / 3) != cell.faces.end();
    };
    return in(crossed) || in(mesh_.opposite(crossed));
  });
  if (from == kInvalid) return kInvalid;
  const auto [p, q] = std::pair(mesh_.source(crossed), mesh_.target(crossed));
  surface_.support.emplace_back();
  surface_.position.emplace_back(0.5 * (surface_.position[at(p)] + surface_.position[at(q)]));
  const VertexId fresh = mesh_.split_edge(crossed);
  // Half-edges keep their sources and their faces' sides of the split edge, but `from` may have
  // been the one that was cut in two: any of here's faces in that cell will do.
  const HalfedgeId start = outgoing_with(here, [&](HalfedgeId h) { return is_on_cell(h, fresh); });
  if (start == kInvalid) throw InternalError("a cell lost the vertex on its outline");
  if (const HalfedgeId h = mesh_.find(here, fresh); h != kInvalid) {
    mesh_.set_mark(h, mark);  // a diagonal by chance
  } else {
    cut(cell_at(start), fresh, mark);
  }
  return fresh;
}

VertexId CurveOverlay::cross_at(VertexId here, VertexId a, VertexId b, double along, Index mark) {
  auto& cuts = cuts_[{a, b}];
  const auto count = static_cast<std::ptrdiff_t>(cuts.size());
  const auto found =
      std::ranges::lower_bound(cuts, along, {}, &std::pair<double, VertexId>::first) - cuts.begin();
  for (const std::ptrdiff_t i : {found, found - 1, found + 1}) {
    if (i < 0 || i > count) continue;
    const VertexId fresh =
        cross(here, i == 0 ? a : cuts[at(i - 1)].second, i == count ? b : cuts[at(i)].second, mark);
    if (fresh == kInvalid) continue;
    cuts.insert(cuts.begin() + i, {along, fresh});
    return fresh;
  }
  return kInvalid;
}

bool CurveOverlay::reach(VertexId here, VertexId there, Index mark) {
  if (const HalfedgeId h = mesh_.find(here, there); h != kInvalid) {
    if (mesh_.mark(h) != EditableTriangulation::kUnmarked) return false;
    mesh_.set_mark(h, mark);
    return true;
  }
  const HalfedgeId from = outgoing_with(here, [&](HalfedgeId h) { return is_on_cell(h, there); });
  if (from == kInvalid) return false;
  cut(cell_at(from), there, mark);
  return true;
}

// Spreads the vertices of the base edge that begins with h, if it has any.
void CurveOverlay::spread_from(HalfedgeId h) {
  std::vector<VertexId> chain;
  const VertexId begin = mesh_.source(h);
  while (mesh_.target(h) >= base_vertices_) {
    const VertexId v = mesh_.target(h);
    const VertexId before = mesh_.source(h);
    chain.push_back(v);
    HalfedgeId next = kInvalid;
    mesh_.for_each_outgoing(v, [&](HalfedgeId g) {
      if (on_base_edge(g) && mesh_.target(g) != before) next = g;
    });
    if (next == kInvalid) throw InternalError("a base edge ends inside");
    h = next;
  }
  const VertexId end = mesh_.target(h);
  if (chain.empty() || begin > end) return;
  const Support& a = surface_.support[at(begin)];
  const Support& b = surface_.support[at(end)];
  // Few bits, so that weights stay exact in later splits.
  const auto parts = static_cast<double>(chain.size() + 1);
  const double grain = std::exp2(-6.0 - std::ceil(std::log2(parts)));
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const double share = grain * std::round(static_cast<double>(i + 1) / (parts * grain));
    const auto v = static_cast<std::size_t>(chain[i]);
    if (!a.empty() && !b.empty()) {
      surface_.support[v] = rounded_between(a, b, share);
      surface_.position[v] = surface_.place(surface_.support[v]);
    } else {
      surface_.position[v] =
          (1 - share) * surface_.position[at(begin)] + share * surface_.position[at(end)];
    }
  }
}

void CurveOverlay::finish() {
  for (VertexId v = 0; v < base_vertices_; ++v) {
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      if (on_base_edge(h)) spread_from(h);
    });
  }
  for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
    if (mesh_.alive(f)) mesh_.set_parent(f, parent_[at(mesh_.parent(f))]);
  }
}

}  // namespace flipfree::mesh
