#include "flipfree/unwrap/islands/cut_around.h"

#include <algorithm>

namespace flipfree::unwrap {
namespace {

class Region {
 public:
  Region(const mesh::Chart& chart, const mesh::Surface& surface, const mesh::Adjacency& adjacency,
         const mesh::EdgeFlags& cut, const mesh::EdgeFlags& uncuttable)
      : chart_(chart),
        adjacency_(adjacency),
        cut_(cut),
        uncuttable_(uncuttable),
        in_chart_(at(static_cast<Index>(surface.faces.rows())), kInvalid),
        inside_(chart.faces.size(), 0) {
    for (std::size_t i = 0; i < chart.faces.size(); ++i)
      in_chart_[at(chart.faces[i])] = static_cast<Index>(i);
  }

  void add(const std::vector<FaceId>& faces) {
    for (const FaceId f : faces) {
      if (in_chart_[at(f)] != kInvalid) inside_[at(in_chart_[at(f)])] = 1;
    }
  }

  void grow() {
    std::vector<char> touched(at(static_cast<Index>(chart_.surface.vertices.rows())), 0);
    const Triangles& faces = chart_.surface.faces;
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      if (inside_[i] == 0) continue;
      for (const VertexId v : faces.row(static_cast<Eigen::Index>(i))) touched[at(v)] = 1;
    }
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      const auto corners = faces.row(static_cast<Eigen::Index>(i));
      if (std::any_of(corners.begin(), corners.end(), [&](VertexId v) { return touched[at(v)]; }))
        inside_[i] = 1;
    }
  }

  // The first half of the faces in the order of a breadth-first walk.
  void halve() {
    std::fill(inside_.begin(), inside_.end(), 0);
    std::vector<Index> order = {0};
    std::vector<char> seen(inside_.size(), 0);
    seen[0] = 1;
    for (std::size_t next = 0; next < order.size(); ++next) {
      for (const Index i : neighbours(order[next], false)) {
        if (seen[at(i)] != 0) continue;
        seen[at(i)] = 1;
        order.push_back(i);
      }
    }
    for (std::size_t i = 0; i < order.size() / 2; ++i) inside_[at(order[i])] = 1;
  }

  // Polygons are in it as a whole.
  void complete() {
    std::vector<Index> waiting;
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      if (inside_[i] != 0) waiting.push_back(static_cast<Index>(i));
    }
    while (!waiting.empty()) {
      const Index last = waiting.back();
      waiting.pop_back();
      for (const Index i : neighbours(last, true)) {
        if (inside_[at(i)] != 0) continue;
        inside_[at(i)] = 1;
        waiting.push_back(i);
      }
    }
  }

  bool is_part() const {
    const auto count = static_cast<std::size_t>(std::count(inside_.begin(), inside_.end(), 1));
    return count > 0 && count < inside_.size();
  }

  mesh::EdgeFlags border() const {
    mesh::EdgeFlags flags(adjacency_.opposite.size(), 0);
    if (!is_part()) return flags;
    for (std::size_t i = 0; i < inside_.size(); ++i) {
      for (Index k = 0; k < 3 && inside_[i] != 0; ++k) {
        const HalfedgeId h = 3 * chart_.faces[i] + k;
        const Index beyond = across(h);
        if (beyond == kInvalid || inside_[at(beyond)] != 0) continue;
        flags[at(h)] = flags[at(adjacency_.opposite[at(h)])] = 1;
      }
    }
    return flags;
  }

 private:
  // The chart's face on the other side; kInvalid on its border.
  Index across(HalfedgeId h) const {
    const HalfedgeId o = adjacency_.opposite[at(h)];
    return o == kInvalid || cut_[at(h)] != 0 ? kInvalid : in_chart_[at(o / 3)];
  }

  std::vector<Index> neighbours(Index i, bool only_uncuttable) const {
    std::vector<Index> found;
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId h = 3 * chart_.faces[at(i)] + k;
      if (only_uncuttable && (uncuttable_.empty() || uncuttable_[at(h)] == 0)) continue;
      if (const Index other = across(h); other != kInvalid) found.push_back(other);
    }
    return found;
  }

  const mesh::Chart& chart_;
  const mesh::Adjacency& adjacency_;
  const mesh::EdgeFlags& cut_;
  const mesh::EdgeFlags& uncuttable_;
  std::vector<Index> in_chart_;  // per face of the surface
  std::vector<char> inside_;     // per face of the chart
};

}  // namespace

mesh::EdgeFlags cut_around(const Islands& islands, std::size_t c, const std::vector<FaceId>& faces,
                           Index rings, const mesh::Surface& surface,
                           const mesh::Adjacency& adjacency, const mesh::EdgeFlags& uncuttable) {
  Region region(islands.charts[c], surface, adjacency, islands.cut, uncuttable);
  region.add(faces);
  for (Index ring = 0; ring < rings; ++ring) region.grow();
  region.complete();
  if (!region.is_part()) {
    region.halve();
    region.complete();
  }
  return region.border();
}

}  // namespace flipfree::unwrap
