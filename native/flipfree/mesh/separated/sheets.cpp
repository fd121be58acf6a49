#include "flipfree/mesh/separated/sheets.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include "flipfree/mesh/adjacency.h"

namespace flipfree::mesh {
namespace {

class SheetMaker {
 public:
  SheetMaker(const Triangles& faces, std::vector<HalfedgeId>& opposite,
             std::vector<std::vector<HalfedgeId>> doubtful, const std::vector<Index>* polygon)
      : faces_(faces), opposite_(opposite), doubtful_(std::move(doubtful)), polygon_(polygon) {}

  Sheets run() {
    do {
      number_fans();
    } while (part_edges());
    sort_by_origin();
    std::sort(result_.parted.begin(), result_.parted.end());
    return std::move(result_);
  }

 private:
  HalfedgeId rotate_ccw(HalfedgeId h) const { return opposite_[at(previous_corner(h))]; }
  HalfedgeId rotate_cw(HalfedgeId h) const {
    const HalfedgeId o = opposite_[at(h)];
    return o == kInvalid ? kInvalid : next_corner(o);
  }

  // Outgoing half-edges of the fan around h's source, counter-clockwise.
  void collect_fan(HalfedgeId h, std::vector<HalfedgeId>& fan, bool& closed) const {
    HalfedgeId first = h;
    closed = false;
    for (HalfedgeId g = rotate_cw(h); g != kInvalid; g = rotate_cw(g)) {
      if (g == h) {
        closed = true;
        break;
      }
      first = g;
    }
    if (closed) first = h;
    fan.clear();
    for (HalfedgeId g = first; g != kInvalid;) {
      fan.push_back(g);
      g = rotate_ccw(g);
      if (g == first) break;
    }
  }

  void number_fans() {
    result_.vertex.assign(opposite_.size(), kInvalid);
    result_.origin.clear();
    std::vector<HalfedgeId> fan;
    bool closed = false;
    for (CornerId c = 0; c < static_cast<CornerId>(opposite_.size()); ++c) {
      if (result_.vertex[at(c)] != kInvalid) continue;
      collect_fan(c, fan, closed);
      for (const HalfedgeId h : fan)
        result_.vertex[at(h)] = static_cast<VertexId>(result_.origin.size());
      result_.origin.push_back(faces_(c / 3, c % 3));
    }
  }

  std::pair<VertexId, VertexId> ends(HalfedgeId h) const {
    const VertexId a = result_.vertex[at(h)];
    const VertexId b = result_.vertex[at(next_corner(h))];
    return {std::min(a, b), std::max(a, b)};
  }

  // Cuts fans where several edges have the same two ends; false if there are none.
  bool part_edges() {
    std::vector<HalfedgeId> to_cut;
    std::vector<HalfedgeId> edge;
    for (std::vector<HalfedgeId>& halfedges : doubtful_) {
      std::sort(halfedges.begin(), halfedges.end(), [&](HalfedgeId g, HalfedgeId h) {
        return std::pair(ends(g), g) < std::pair(ends(h), h);
      });
      for (std::size_t i = 0; i < halfedges.size();) {
        const auto shared = ends(halfedges[i]);
        edge.clear();
        for (; i < halfedges.size() && ends(halfedges[i]) == shared; ++i)
          edge.push_back(halfedges[i]);
        if (unit_count(edge) > 1) cut_between(edge, to_cut);
      }
    }
    bool any = false;
    for (const HalfedgeId h : to_cut) {
      const HalfedgeId o = opposite_[at(h)];
      if (o == kInvalid) continue;  // found from two edges
      opposite_[at(h)] = opposite_[at(o)] = kInvalid;
      result_.parted.push_back(std::min(h, o));
      doubtful_.push_back({h, o});
      any = true;
    }
    return any;
  }

  static bool contains(const std::vector<HalfedgeId>& edge, HalfedgeId h) {
    return std::find(edge.begin(), edge.end(), h) != edge.end();
  }
  // Pairs and borders among half-edges with the same ends.
  std::size_t unit_count(const std::vector<HalfedgeId>& edge) const {
    std::size_t count = 0;
    for (const HalfedgeId h : edge) {
      const HalfedgeId o = opposite_[at(h)];
      count += o == kInvalid || o > h || !contains(edge, o) ? 1 : 0;
    }
    return count;
  }
  // The pair or border of `edge` that a face of the fan has at the fan's vertex: its lower
  // half-edge; kInvalid if it has none.
  HalfedgeId unit_at(const std::vector<HalfedgeId>& edge, HalfedgeId outgoing) const {
    for (const HalfedgeId h : {outgoing, previous_corner(outgoing)}) {
      if (!contains(edge, h)) continue;
      const HalfedgeId o = opposite_[at(h)];
      return o == kInvalid ? h : std::min(h, o);
    }
    return kInvalid;
  }

  // One spoke in every gap between the pairs and borders around their common lower end.
  void cut_between(const std::vector<HalfedgeId>& edge, std::vector<HalfedgeId>& to_cut) const {
    const VertexId low = ends(edge.front()).first;
    const HalfedgeId any =
        result_.vertex[at(edge.front())] == low ? edge.front() : next_corner(edge.front());
    std::vector<HalfedgeId> fan;
    bool closed = false;
    collect_fan(any, fan, closed);
    std::vector<std::pair<std::size_t, HalfedgeId>> places;  // in the fan, and which unit
    for (std::size_t i = 0; i < fan.size(); ++i) {
      const HalfedgeId unit = unit_at(edge, fan[i]);
      if (unit != kInvalid) places.emplace_back(i, unit);
    }
    for (std::size_t p = 0; p < places.size(); ++p) {
      const bool last = p + 1 == places.size();
      if (last && !closed) break;
      const auto& [from, unit] = places[p];
      const auto& [to, next_unit] = places[last ? 0 : p + 1];
      if (unit == next_unit) continue;
      const std::size_t length = (to + fan.size() - from) % fan.size();
      to_cut.push_back(previous_corner(fan[(from + middle(fan, from, length)) % fan.size()]));
    }
  }
  bool inside_polygon(HalfedgeId h) const {
    const HalfedgeId o = opposite_[at(h)];
    return polygon_ != nullptr && o != kInvalid && (*polygon_)[at(h / 3)] == (*polygon_)[at(o / 3)];
  }
  // Of the first `length` spokes behind fan[from], the one in the middle, or the nearest to it that
  // is no diagonal if there is one.
  std::size_t middle(const std::vector<HalfedgeId>& fan, std::size_t from,
                     std::size_t length) const {
    const std::size_t half = (length - 1) / 2;
    for (std::size_t away = 0; away <= half + 1; ++away) {
      for (const std::size_t i : {half - std::min(away, half), half + away}) {
        if (i >= length) continue;
        if (!inside_polygon(previous_corner(fan[(from + i) % fan.size()]))) return i;
      }
    }
    return half;
  }

  void sort_by_origin() {
    const std::size_t count = result_.origin.size();
    std::vector<VertexId> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](VertexId a, VertexId b) {
      return result_.origin[at(a)] < result_.origin[at(b)];
    });
    std::vector<VertexId> rank(count);
    std::vector<VertexId> origin(count);
    for (std::size_t i = 0; i < count; ++i) {
      rank[at(order[i])] = static_cast<VertexId>(i);
      origin[i] = result_.origin[at(order[i])];
    }
    for (VertexId& v : result_.vertex) v = rank[at(v)];
    result_.origin = std::move(origin);
  }

  const Triangles& faces_;
  std::vector<HalfedgeId>& opposite_;
  std::vector<std::vector<HalfedgeId>> doubtful_;
  const std::vector<Index>* polygon_;
  Sheets result_;
};

}  // namespace

Sheets make_sheets(const Triangles& faces, std::vector<HalfedgeId>& opposite,
                   std::vector<std::vector<HalfedgeId>> doubtful,
                   const std::vector<Index>* polygon) {
  return SheetMaker(faces, opposite, std::move(doubtful), polygon).run();
}

}  // namespace flipfree::mesh
