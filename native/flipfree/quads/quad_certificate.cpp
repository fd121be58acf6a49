#include "flipfree/quads/quad_certificate.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

#include <Eigen/Geometry>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/quads/box_tree.h"

namespace flipfree::quads {

namespace {

// A side of a polygon of `size` corners: side `size` q + k runs from corner k to the next one.
struct QuadSide {
  std::pair<VertexId, VertexId> ends;  // the lower one first
  Index side;
  bool forth;  // from low to high
  bool operator<(const QuadSide& o) const {
    return std::tie(ends, side) < std::tie(o.ends, o.side);
  }
};

// Calls visit(sides) for those between every two vertices, ascending. vertex_of(polygon, corner).
template <typename VertexOf, typename Visit>
void for_each_edge(std::size_t polygons, Index size, const VertexOf& vertex_of,
                   const Visit& visit) {
  std::vector<QuadSide> sides;
  for (std::size_t q = 0; q < polygons; ++q) {
    for (Index k = 0; k < size; ++k) {
      const VertexId a = vertex_of(q, k), b = vertex_of(q, (k + 1) % size);
      sides.push_back({std::minmax(a, b), size * static_cast<Index>(q) + k, a < b});
    }
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t i = 0, next = 0; i < sides.size(); i = next) {
    while (next < sides.size() && sides[next].ends == sides[i].ends) ++next;
    visit(std::span<const QuadSide>(sides).subspan(i, next - i));
  }
}
template <typename Visit>
void for_each_edge(const std::vector<Quad>& quads, const Visit& visit) {
  for_each_edge(
      quads.size(), 4, [&](std::size_t q, Index k) { return quads[q][at(k)]; }, visit);
}

Index next_side(Index side) { return side % 4 == 3 ? side - 3 : side + 1; }

// Per side the one of the neighbour, kInvalid on the border. Precondition: no defects.
std::vector<Index> mates_of(const std::vector<Quad>& quads) {
  std::vector<Index> mate(4 * quads.size(), kInvalid);
  for_each_edge(quads, [&](std::span<const QuadSide> edge) {
    if (edge.size() < 2) return;
    mate[at(edge[0].side)] = edge[1].side;
    mate[at(edge[1].side)] = edge[0].side;
  });
  return mate;
}

struct Counts {
  Index components = 0, genus = 0, borders = 0;
  bool operator==(const Counts&) const = default;
};

// Of polygons, as for_each_edge() takes them.
template <typename VertexOf>
Counts counted(std::size_t polygons, Index size, Index vertices, const VertexOf& vertex_of) {
  DisjointSets parts(vertices), rims(vertices);
  std::vector<char> used(at(vertices), 0), rim(at(vertices), 0);
  Index edges = 0;
  for_each_edge(polygons, size, vertex_of, [&](std::span<const QuadSide> edge) {
    const auto [a, b] = edge[0].ends;
    ++edges;
    used[at(a)] = used[at(b)] = 1;
    parts.join(a, b);
    if (edge.size() > 1) return;
    rims.join(a, b);
    rim[at(a)] = rim[at(b)] = 1;
  });
  Counts counts;
  Index points = 0;
  for (VertexId v = 0; v < vertices; ++v) {
    points += used[at(v)];
    counts.components += used[at(v)] != 0 && parts.find(v) == v ? 1 : 0;
    counts.borders += rim[at(v)] != 0 && rims.find(v) == v ? 1 : 0;
  }
  const Index euler = points - edges + static_cast<Index>(polygons);
  counts.genus = (2 * counts.components - counts.borders - euler) / 2;
  return counts;
}

// Chains of edges: joined at vertices of four quads, and along the border at those of two.
Index count_loops(const std::vector<Quad>& quads, const std::vector<Index>& mate,
                  const std::vector<Index>& around, const std::vector<char>& rim) {
  DisjointSets chains(static_cast<Index>(mate.size()));
  for (Index s = 0; at(s) < mate.size(); ++s) {
    if (mate[at(s)] != kInvalid) chains.join(s, mate[at(s)]);
    // At the corner where s ends.
    const VertexId v = quads[at(next_side(s) / 4)][at(next_side(s) % 4)];
    if (rim[at(v)] == 0 && around[at(v)] == 4) {
      // The next side's neighbour, its next side: straight on.
      const Index m = mate[at(next_side(s))];
      chains.join(s, next_side(m));
    } else if (rim[at(v)] != 0 && around[at(v)] == 2 && mate[at(s)] == kInvalid) {
      chains.join(s, next_side(mate[at(next_side(s))]));
    }
  }
  Index count = 0;
  for (Index s = 0; at(s) < mate.size(); ++s) count += chains.find(s) == s ? 1 : 0;
  return count;
}

// The largest distance from these points to the tree.
double farthest(const BoxTree& tree, const std::vector<Vector3>& points,
                const ExecutionContext& context) {
  double most = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 256 == 0) context.check();
    most = std::max(most, tree.nearest(points[i]).distance);
  }
  return most;
}

void add_middles(std::vector<std::pair<VertexId, VertexId>> sides, const Points3& vertices,
                 std::vector<Vector3>& points) {
  sort_unique(sides);
  for (const auto& [a, b] : sides) points.emplace_back(0.5 * (vertices.row(a) + vertices.row(b)));
}

void measure_distances(const mesh::Surface& surface, const QuadArrays& mesh,
                       const ExecutionContext& context, QuadCertificate& c) {
  std::vector<std::array<Vector3, 3>> of_surface;
  std::vector<Vector3> on_surface, on_quads;
  // What faces share is sampled once.
  std::vector<std::pair<VertexId, VertexId>> sides;
  std::vector<char> known(at(surface.vertices.rows()), 0);
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    const std::array<Vector3, 3> t = surface.corners(f);
    for (int k = 0; k < 3; ++k) {
      const VertexId v = surface.faces(f, k);
      if (known[at(v)] == 0) on_surface.push_back(t[at(k)]);
      known[at(v)] = 1;
      sides.push_back(std::minmax(v, surface.faces(f, (k + 1) % 3)));
    }
    of_surface.push_back(t);
    on_surface.emplace_back((t[0] + t[1] + t[2]) / 3.0);
  }
  add_middles(std::move(sides), surface.vertices, on_surface);
  sides = {};
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
    on_quads.emplace_back(mesh.vertices.row(v));
  const auto place = [&](VertexId v) -> Vector3 { return mesh.vertices.row(v); };
  for (const Quad& quad : mesh.quads) {
    for (std::size_t k = 0; k < 4; ++k) sides.push_back(std::minmax(quad[k], quad[(k + 1) % 4]));
    on_quads.emplace_back(0.25 *
                          (place(quad[0]) + place(quad[1]) + place(quad[2]) + place(quad[3])));
  }
  add_middles(std::move(sides), mesh.vertices, on_quads);
  Eigen::AlignedBox3d box;
  for (const auto& t : of_surface)
    for (const Vector3& p : t) box.extend(p);
  const double diagonal = box.diagonal().norm();
  c.to_surface = farthest(BoxTree(of_surface), on_quads, context) / diagonal;
  c.to_quads = farthest(tree_of(mesh.quads, place), on_surface, context) / diagonal;
}

std::string several(std::size_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

// "<n> <one or many><what>", if there are any.
void note(std::size_t n, const std::string& one, const std::string& many, const std::string& what,
          std::vector<std::string>& failures) {
  if (n > 0) failures.push_back(several(n, one, many) + what);
}

// Vertices that do not lie where their face and weights say, by more than rounding.
std::size_t misplaced(const mesh::Surface& surface, const QuadArrays& mesh) {
  const double size = surface.vertices.cwiseAbs().maxCoeff();
  std::size_t count = 0;
  for (VertexId v = 0; v < static_cast<VertexId>(mesh.vertices.rows()); ++v) {
    const FaceId f = mesh.parent_face[at(v)];
    Vector3 p = Vector3::Zero();
    const Vector3 weight = mesh.barycentric.row(v);
    for (int k = 0; k < 3; ++k) p += weight[k] * Vector3(surface.vertices.row(surface.faces(f, k)));
    const double off = (p - Vector3(mesh.vertices.row(v))).norm();
    if (!(weight.minCoeff() >= 0.0) || !(std::abs(weight.sum() - 1.0) < 1e-9) ||
        !(off <= 1e-9 * size))
      ++count;
  }
  return count;
}

std::string described(const Counts& c) {
  return several(at(c.components), "component", "components") + ", genus " +
         std::to_string(c.genus) + ", " + several(at(c.borders), "border", "borders");
}

}  // namespace

std::vector<std::string> quad_defects(const std::vector<Quad>& quads, Index vertices) {
  std::size_t twice = 0;
  for (const Quad& q : quads) {
    bool repeated = false;
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t j = 0; j < k; ++j) repeated = repeated || q[k] == q[j];
    twice += repeated ? 1 : 0;
  }
  std::vector<std::string> defects;
  note(twice, "quad uses", "quads use", " a vertex twice", defects);
  std::size_t doubled = 0;
  for_each_edge(quads, [&](std::span<const QuadSide> edge) {
    if (edge.size() > 2 || (edge.size() == 2 && edge[0].forth == edge[1].forth)) ++doubled;
  });
  note(doubled, "pair of vertices is", "pairs of vertices are", " joined by more than one edge",
       defects);
  if (!defects.empty()) return defects;
  // One fan of quads around every vertex: its corners are joined across sides.
  const std::vector<Index> mate = mates_of(quads);
  DisjointSets fans(static_cast<Index>(mate.size()));
  for (Index s = 0; at(s) < mate.size(); ++s)
    if (mate[at(s)] != kInvalid) fans.join(s, next_side(mate[at(s)]));
  std::vector<Index> fan(at(vertices), kInvalid);
  std::vector<char> is_pinched(at(vertices), 0);
  for (Index s = 0; at(s) < mate.size(); ++s) {
    const std::size_t v = at(quads[at(s / 4)][at(s % 4)]);
    if (fan[v] == kInvalid) fan[v] = fans.find(s);
    if (fan[v] != fans.find(s)) is_pinched[v] = 1;
  }
  const auto pinched = at(std::count(is_pinched.begin(), is_pinched.end(), 1));
  note(pinched, "vertex has", "vertices have", " more than one fan of quads", defects);
  return defects;
}

std::vector<std::pair<VertexId, VertexId>> border_sides(const std::vector<Quad>& quads) {
  std::vector<std::pair<VertexId, VertexId>> alone;
  for_each_edge(quads, [&](std::span<const QuadSide> edge) {
    if (edge.size() == 1) alone.push_back(edge[0].ends);
  });
  return alone;
}

QuadCertificate certify_quads(const mesh::Surface& surface, const QuadArrays& mesh,
                              const std::vector<Index>* expected, std::int64_t count,
                              const ExecutionContext& context) {
  const std::vector<Quad>& quads = mesh.quads;
  const auto vertices = static_cast<Index>(mesh.vertices.rows());
  QuadCertificate c;
  c.vertices = vertices;
  c.quads = static_cast<Index>(quads.size());
  c.failures = quad_defects(quads, vertices);
  if (count >= 0 && count != static_cast<std::int64_t>(quads.size()))
    c.failures.push_back("there are " + std::to_string(quads.size()) +
                         " quads, but the area of the map is " + std::to_string(count));
  note(misplaced(surface, mesh), "vertex does", "vertices do",
       " not lie where its parent face and weights say", c.failures);
  context.check();
  std::vector<Index> around(at(vertices), 0);
  for (const Quad& q : quads)
    for (const VertexId v : q) ++around[at(v)];
  if (const auto unused = std::count(around.begin(), around.end(), 0); unused > 0)
    c.failures.push_back(std::to_string(unused) + " vertices have no quad");
  if (c.failures.empty()) {
    const Counts of_quads =
        counted(quads.size(), 4, vertices, [&](std::size_t f, Index k) { return quads[f][at(k)]; });
    const Counts of_surface = counted(
        at(surface.faces.rows()), 3, static_cast<Index>(surface.vertices.rows()),
        [&](std::size_t f, Index k) { return surface.faces(static_cast<Eigen::Index>(f), k); });
    c.components = of_quads.components;
    c.genus = of_quads.genus;
    c.borders = of_quads.borders;
    if (!(of_quads == of_surface))
      c.failures.push_back("the quads have " + described(of_quads) + ", the surface " +
                           described(of_surface));
    const std::vector<Index> mate = mates_of(quads);
    std::vector<char> rim(at(vertices), 0);
    for (const auto& [a, b] : border_sides(quads)) rim[at(a)] = rim[at(b)] = 1;
    for (VertexId v = 0; v < vertices; ++v) {
      if (around[at(v)] == (rim[at(v)] != 0 ? 2 : 4)) continue;
      c.irregular.push_back(v);
      c.valence.push_back(around[at(v)]);
    }
    c.edge_loops = count_loops(quads, mate, around, rim);
  }
  if (expected != nullptr) {
    std::size_t wrong = 0;
    for (std::size_t v = 0; v < around.size(); ++v) wrong += around[v] != (*expected)[v] ? 1 : 0;
    note(wrong, "vertex has", "vertices have",
         " another number of quads than the map has quarter turns there", c.failures);
  }
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto p = [&](std::size_t k) { return Vector3(mesh.vertices.row(quads[q][k])); };
    const Vector3 normal = surface.area_vector(mesh.quad_parent[q]);
    if (!((p(2) - p(0)).cross(p(3) - p(1)).dot(normal) > 0.0))
      c.turned.push_back(static_cast<Index>(q));
  }
  if (!quads.empty()) measure_distances(surface, mesh, context, c);
  c.ok = c.failures.empty();
  return c;
}

}  // namespace flipfree::quads
