#include "flipfree/quads/quad_certificate.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include <Eigen/Geometry>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/quads/box_tree.h"

namespace flipfree::quads {

namespace {

// A side of a quad: side 4 q + k runs from corner k to the next one.
struct QuadSide {
  std::pair<VertexId, VertexId> ends;  // the lower one first
  Index side;
  bool forth;  // from low to high
  bool operator<(const QuadSide& o) const {
    return std::tie(ends, side) < std::tie(o.ends, o.side);
  }
};

std::vector<QuadSide> sorted_sides(const std::vector<Quad>& quads) {
  std::vector<QuadSide> sides;
  for (std::size_t q = 0; q < quads.size(); ++q) {
    for (std::size_t k = 0; k < 4; ++k) {
      const VertexId a = quads[q][k], b = quads[q][(k + 1) % 4];
      sides.push_back({std::minmax(a, b), static_cast<Index>(4 * q + k), a < b});
    }
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

// Per side the one of the neighbour, kInvalid on the border. Precondition: no defects.
std::vector<Index> mates_of(const std::vector<Quad>& quads) {
  std::vector<Index> mate(4 * quads.size(), kInvalid);
  const std::vector<QuadSide> sides = sorted_sides(quads);
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    const QuadSide &a = sides[i], &b = sides[i + 1];
    if (a.ends != b.ends) continue;
    mate[at(a.side)] = b.side;
    mate[at(b.side)] = a.side;
  }
  return mate;
}

struct Counts {
  Index components = 0, genus = 0, borders = 0;
  bool operator==(const Counts&) const = default;
};

// Of polygons of `size` corners each: corner c's next one is its polygon's.
template <typename VertexOf>
Counts counted(std::size_t polygons, Index size, Index vertices, const VertexOf& vertex_of) {
  DisjointSets parts(vertices), rims(vertices);
  std::map<std::pair<VertexId, VertexId>, int> edges;
  std::vector<char> used(at(vertices), 0);
  for (std::size_t f = 0; f < polygons; ++f) {
    for (Index k = 0; k < size; ++k) {
      const VertexId a = vertex_of(f, k), b = vertex_of(f, (k + 1) % size);
      used[at(a)] = 1;
      parts.join(a, b);
      ++edges[{std::min(a, b), std::max(a, b)}];
    }
  }
  std::vector<char> rim(at(vertices), 0);
  for (const auto& [ends, faces] : edges) {
    if (faces != 1) continue;
    rims.join(ends.first, ends.second);
    rim[at(ends.first)] = rim[at(ends.second)] = 1;
  }
  Counts counts;
  Index points = 0;
  for (VertexId v = 0; v < vertices; ++v) {
    points += used[at(v)];
    counts.components += used[at(v)] != 0 && parts.find(v) == v ? 1 : 0;
    counts.borders += rim[at(v)] != 0 && rims.find(v) == v ? 1 : 0;
  }
  const Index euler = points - static_cast<Index>(edges.size()) + static_cast<Index>(polygons);
  counts.genus = (2 * counts.components - counts.borders - euler) / 2;
  return counts;
}

// Chains of edges: joined at vertices of four quads, and along the border at those of two.
Index count_loops(const std::vector<Quad>& quads, const std::vector<Index>& mate,
                  const std::vector<Index>& around, const std::vector<char>& rim) {
  const auto next = [](Index side) { return side % 4 == 3 ? side - 3 : side + 1; };
  DisjointSets chains(static_cast<Index>(mate.size()));
  for (Index s = 0; at(s) < mate.size(); ++s) {
    if (mate[at(s)] != kInvalid) chains.join(s, mate[at(s)]);
    // At the corner where s ends.
    const VertexId v = quads[at(next(s) / 4)][at(next(s) % 4)];
    if (rim[at(v)] == 0 && around[at(v)] == 4) {
      // The next side's neighbour, its next side: straight on.
      const Index m = mate[at(next(s))];
      chains.join(s, next(m));
    } else if (rim[at(v)] != 0 && around[at(v)] == 2 && mate[at(s)] == kInvalid) {
      chains.join(s, next(mate[at(next(s))]));
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

void measure_distances(const QuadRequest& request, const ExecutionContext& context,
                       QuadCertificate& c) {
  const mesh::Surface& surface = *request.surface;
  std::vector<std::array<Vector3, 3>> of_surface, of_quads;
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
  for (Eigen::Index v = 0; v < request.vertices->rows(); ++v)
    on_quads.emplace_back(request.vertices->row(v));
  for (const Quad& quad : *request.quads) {
    std::array<Vector3, 4> p;
    for (std::size_t k = 0; k < 4; ++k) {
      p[k] = request.vertices->row(quad[k]);
      sides.push_back(std::minmax(quad[k], quad[(k + 1) % 4]));
    }
    of_quads.push_back({p[0], p[1], p[2]});
    of_quads.push_back({p[0], p[2], p[3]});
    on_quads.emplace_back(0.25 * (p[0] + p[1] + p[2] + p[3]));
  }
  add_middles(std::move(sides), *request.vertices, on_quads);
  Eigen::AlignedBox3d box;
  for (const auto& t : of_surface)
    for (const Vector3& p : t) box.extend(p);
  const double diagonal = box.diagonal().norm();
  c.to_surface = farthest(BoxTree(of_surface), on_quads, context) / diagonal;
  c.to_quads = farthest(BoxTree(of_quads), on_surface, context) / diagonal;
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
std::size_t misplaced(const QuadRequest& request) {
  const mesh::Surface& surface = *request.surface;
  const double size = surface.vertices.cwiseAbs().maxCoeff();
  std::size_t count = 0;
  for (VertexId v = 0; v < static_cast<VertexId>(request.vertices->rows()); ++v) {
    const FaceId f = (*request.parent_face)[at(v)];
    Vector3 p = Vector3::Zero();
    const Vector3 weight = request.barycentric->row(v);
    for (int k = 0; k < 3; ++k) p += weight[k] * Vector3(surface.vertices.row(surface.faces(f, k)));
    const double off = (p - Vector3(request.vertices->row(v))).norm();
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
  const std::vector<QuadSide> sides = sorted_sides(quads);
  std::size_t doubled = 0;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t j = i;
    int forth = 0;
    for (; j < sides.size() && sides[j].ends == sides[i].ends; ++j) forth += sides[j].forth ? 1 : 0;
    const std::size_t faces = j - i;
    if (faces > 2 || (faces == 2 && forth != 1)) ++doubled;
    i = j;
  }
  note(doubled, "pair of vertices is", "pairs of vertices are", " joined by more than one edge",
       defects);
  if (!defects.empty()) return defects;
  // One fan of quads around every vertex: as many as one meets by going round.
  const std::vector<Index> mate = mates_of(quads);
  std::vector<Index> corners(at(vertices), 0), met(at(vertices), 0);
  for (const Quad& q : quads)
    for (const VertexId v : q) ++corners[at(v)];
  std::vector<char> begun(at(vertices), 0);
  // A fan begins at the side that leaves along the border, if there is one.
  for (const bool border : {true, false}) {
    for (Index s = 0; at(s) < mate.size(); ++s) {
      const VertexId v = quads[at(s / 4)][at(s % 4)];
      if (begun[at(v)] != 0 || (mate[at(s)] != kInvalid && border)) continue;
      begun[at(v)] = 1;
      Index side = s;
      do {
        ++met[at(v)];
        side = mate[at(side % 4 == 0 ? side + 3 : side - 1)];
      } while (side != kInvalid && side != s);
    }
  }
  std::size_t pinched = 0;
  for (std::size_t v = 0; v < corners.size(); ++v) pinched += corners[v] != met[v] ? 1 : 0;
  note(pinched, "vertex has", "vertices have", " more than one fan of quads", defects);
  return defects;
}

std::vector<std::pair<VertexId, VertexId>> border_sides(const std::vector<Quad>& quads) {
  const std::vector<QuadSide> sides = sorted_sides(quads);
  std::vector<std::pair<VertexId, VertexId>> alone;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const bool shared = (i > 0 && sides[i - 1].ends == sides[i].ends) ||
                        (i + 1 < sides.size() && sides[i + 1].ends == sides[i].ends);
    if (!shared) alone.push_back(sides[i].ends);
  }
  return alone;
}

QuadCertificate certify_quads(const QuadRequest& request, const ExecutionContext& context) {
  const std::vector<Quad>& quads = *request.quads;
  const auto vertices = static_cast<Index>(request.vertices->rows());
  const mesh::Surface& surface = *request.surface;
  QuadCertificate c;
  c.vertices = vertices;
  c.quads = static_cast<Index>(quads.size());
  c.failures = quad_defects(quads, vertices);
  if (request.count >= 0 && request.count != static_cast<std::int64_t>(quads.size()))
    c.failures.push_back("there are " + std::to_string(quads.size()) +
                         " quads, but the area of the map is " + std::to_string(request.count));
  note(misplaced(request), "vertex does", "vertices do",
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
  if (request.around != nullptr) {
    std::size_t wrong = 0;
    for (std::size_t v = 0; v < around.size(); ++v)
      wrong += around[v] != (*request.around)[v] ? 1 : 0;
    note(wrong, "vertex has", "vertices have",
         " another number of quads than the map has quarter turns there", c.failures);
  }
  for (std::size_t q = 0; q < quads.size(); ++q) {
    const auto p = [&](std::size_t k) { return Vector3(request.vertices->row(quads[q][k])); };
    const Vector3 normal = surface.area_vector((*request.quad_parent)[q]);
    if (!((p(2) - p(0)).cross(p(3) - p(1)).dot(normal) > 0.0))
      c.turned.push_back(static_cast<Index>(q));
  }
  if (!quads.empty()) measure_distances(request, context, c);
  c.ok = c.failures.empty();
  return c;
}

}  // namespace flipfree::quads
