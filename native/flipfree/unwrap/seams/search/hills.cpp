#include "flipfree/unwrap/seams/search/hills.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/base/disjoint_sets.h"

namespace flipfree::unwrap {
namespace {

// Moments of |u| over a hill.
struct Moments {
  double area = 0.0;
  double height = 0.0;
  double square = 0.0;

  void add(const Moments& other) {
    area += other.area;
    height += other.height;
    square += other.square;
  }
  double above(double foot) const {
    return std::max(square - 2.0 * foot * height + foot * foot * area, 0.0);
  }
};

}  // namespace

std::vector<Hill> hills(const Triangles& faces, const mesh::Adjacency& adjacency,
                        const std::vector<double>& u, const std::vector<double>& area,
                        const std::vector<char>& reach) {
  std::vector<VertexId> order;
  for (std::size_t v = 0; v < u.size(); ++v) {
    if (u[v] != 0.0) order.push_back(static_cast<VertexId>(v));
  }
  const auto height = [&](VertexId v) { return std::abs(u[at(v)]); };
  const auto lower = [&](VertexId a, VertexId b) {
    return height(a) != height(b) ? height(a) < height(b) : a > b;
  };
  std::sort(order.begin(), order.end(), [&](VertexId a, VertexId b) { return lower(b, a); });
  DisjointSets sets(static_cast<Index>(u.size()));  // the representative of a hill is its peak
  std::vector<char> seen(u.size(), 0);
  std::vector<Moments> moments(u.size());
  std::vector<VertexId> end(u.size(), kInvalid);
  std::vector<Hill> found;
  const auto finish = [&](VertexId peak, double gain) {
    if (end[at(peak)] != kInvalid) found.push_back({end[at(peak)], gain});
  };
  for (const VertexId v : order) {
    seen[at(v)] = 1;
    if (reach[at(v)] != 0) end[at(v)] = v;
    moments[at(v)] = {area[at(v)], area[at(v)] * height(v), area[at(v)] * height(v) * height(v)};
    const HalfedgeId start = adjacency.vertex_halfedge[at(v)];
    HalfedgeId h = start;
    do {  // v lies inside: the fan is closed
      const VertexId w = mesh::target(faces, h);
      h = mesh::rotate_ccw(adjacency, h);
      if (seen[at(w)] == 0 || u[at(v)] * u[at(w)] < 0.0) continue;
      VertexId a = sets.find(v);
      VertexId b = sets.find(w);
      if (a == b) continue;
      if (lower(b, a)) std::swap(a, b);
      if (a != v) finish(a, moments[at(a)].above(height(v)));
      sets.join(a, b);
      moments[at(b)].add(moments[at(a)]);
      if (end[at(b)] == kInvalid) end[at(b)] = end[at(a)];
    } while (h != start);
  }
  for (const VertexId v : order) {
    if (sets.find(v) == v) finish(v, moments[at(v)].square);
  }
  return found;
}

}  // namespace flipfree::unwrap
