#include "flipfree/quads/places.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/base/plane.h"
#include "flipfree/quads/box_tree.h"

namespace flipfree::quads {

namespace {

// Weights made what they should be up to rounding.
Spot tidy(FaceId face, Vector3 weight) {
  weight = weight.cwiseMax(0.0);
  return {face, weight / weight.sum()};
}

// The end of a way from a vertex of the map along a vector, which lies counter-clockwise of the
// direction in which the half-edge leaves on the coarse surface, or is the same. Where the way
// meets vertices, it passes to their left.
Spot end_of_way(const FlatSurface& map, CornerId first, const Vector2& along) {
  const auto [corner, quarters] = sector_of(map, first, along);
  const Vector2 way = turned(along, quarters);
  HalfedgeId out = next_corner(corner);
  // In the chart of the first face, with the vertex at the origin: the ends of `out`, and by how
  // many quarters vectors of its face are turned to get there.
  Vector2 right = as_vector(map[corner].edge);
  Vector2 left = right + as_vector(map[out].edge);
  Vector2 third = Vector2::Zero();
  Index turn = 0;
  while (cross(left - right, way - right) < 0.0) {
    const HalfedgeId o = map[out].opposite;
    if (o == kInvalid) break;
    turn += map[o].turn;
    const Vector2 apex = right + turned(as_vector(map[next_corner(o)].edge), turn);
    if (cross(way, apex) > 0.0) {
      out = next_corner(o);
      third = left;
      left = apex;
    } else {
      out = previous_corner(o);
      third = right;
      right = apex;
    }
  }
  Vector3 weight;
  weight[out % 3] = twice_area(way, left, third);
  weight[next_corner(out) % 3] = twice_area(way, third, right);
  weight[previous_corner(out) % 3] = twice_area(way, right, left);
  return tidy(out / 3, weight);
}

Spot spot_of(const Carrier& carrier, const CoarseSurface& coarse, const FlatSurface& map) {
  const HalfedgeId h = carrier.halfedge;
  const auto walk = [&](HalfedgeId from, const Vector2& way) {
    return end_of_way(map, coarse[from].start, turned(way, coarse[from].start_turn));
  };
  if (carrier.at_vertex) return spot_on(coarse[h].start, 0.0);
  if (carrier.on_edge) {
    const Vector2 place = as_vector(carrier.doubled), whole = as_vector(coarse[h].integer);
    return walk(h, 0.5 * place.dot(whole) / whole.squaredNorm() * as_vector(coarse[h].edge));
  }
  const Gauss first = coarse[h].integer, second = first + coarse[h + 1].integer;
  const Gauss q = first + first, r = second + second;
  const auto area = static_cast<double>(cross(q, r));
  const std::array<double, 3> share = {
      static_cast<double>(cross(q - carrier.doubled, r - carrier.doubled)) / area,
      static_cast<double>(cross(carrier.doubled, r)) / area,
      static_cast<double>(cross(q, carrier.doubled)) / area};
  // From the nearest corner, to the two others.
  const auto k = static_cast<Index>(std::max_element(share.begin(), share.end()) - share.begin());
  const HalfedgeId from = h + k;
  return walk(from, share[at((k + 1) % 3)] * as_vector(coarse[from].edge) -
                        share[at((k + 2) % 3)] * as_vector(coarse[previous_corner(from)].edge));
}

// How much of a quad's proportions stays, 0 for squares: a strip that has to be wide shall be, but
// where there is room quads become square.
constexpr double kOwnProportions = 0.7;

// Overrelaxation: what is wrong over many quads is put right in rounds of their number, not of its
// square.
constexpr double kOver = 1.7;

// A spot is on an edge where the third weight is less.
constexpr double kOnEdge = 1e-7;
// That one move passes along a line.
constexpr int kMostEdges = 64;

class Relaxation {
 public:
  Relaxation(const mesh::Surface& surface, const std::vector<Quad>& quads,
             const mesh::EdgeFlags& lines, std::vector<Spot>& spots)
      : surface_(surface),
        adjacency_(surface.adjacency()),
        quads_(quads),
        lines_(lines),
        lines_at_(static_cast<std::size_t>(surface.vertices.rows())),
        spots_(spots),
        uses_(spots.size(), [&](const auto& add) {
          for (std::size_t q = 0; q < quads.size(); ++q)
            for (std::size_t k = 0; k < 4; ++k) add(quads[q][k], static_cast<Index>(4 * q + k));
        }) {
    for (HalfedgeId h = 0; at(h) < lines.size(); ++h) {
      if (lines[at(h)] == 0) continue;
      lines_at_[at(mesh::source(surface.faces, h))].push_back(h);
      if (adjacency_.opposite[at(h)] == kInvalid)
        lines_at_[at(mesh::target(surface.faces, h))].push_back(h);
    }
    for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f)
      normal_.push_back(surface.area_vector(f).normalized());
    for (const Spot& spot : spots) place_.push_back(position(surface, spot));
  }

  void move(VertexId v, bool along_line) {
    // Along a line, which holds narrow quads as narrow as they are, these have more to say: the
    // same way shears them more.
    Vector3 wish = Vector3::Zero();
    double sum = 0.0;
    for (const Index use : uses_[v]) {
      const double weight = along_line ? 1.0 / std::sqrt(area(use / 4)) : 1.0;
      if (!std::isfinite(weight)) continue;  // it has no sides: it wishes nothing
      wish += weight * wished(use);
      sum += weight;
    }
    if (!(sum > 0.0)) return;
    wish /= sum;
    const Spot spot = spots_[at(v)];
    double share = 1.0;
    for (int tries = 0; tries < 4; ++tries, share *= 0.5) {
      const Vector3 way = share * kOver * (wish - place_[at(v)]);
      if (put(v, along_line ? slide_along(spot, way) : slide(surface_, lines_, spot, way))) return;
    }
  }

  // Corners that are free to the vertices of the surface that quads miss most, such as tips: of
  // each the farthest that is nearest to it. They are held then, and `rounds` more bring what is
  // around to rest. As long as that brings the farthest vertex nearer.
  void reach(std::vector<Freedom> freedom, int rounds, ExecutionContext& context) {
    constexpr int kMostTimes = 8;
    constexpr double kMissed = 0.3;  // of a quad's side: less is no more than quads are flat
    constexpr double kFar = 0.7;     // of the largest distance: others wait
    std::vector<VertexId> seen;
    for (VertexId v = 0; v < static_cast<VertexId>(surface_.vertices.rows()); ++v)
      if (const HalfedgeId h = adjacency_.vertex_halfedge[at(v)];
          h != kInvalid && adjacency_.opposite[at(h)] != kInvalid)
        seen.push_back(v);
    double best = std::numeric_limits<double>::infinity();
    std::vector<Spot> best_spots;
    for (int time = 0; time <= kMostTimes; ++time) {
      std::vector<Missed> missed = missed_of(seen, context);
      if (missed.empty() || !(missed[0].distance < best)) break;
      best = missed[0].distance;
      best_spots = spots_;
      if (time == kMostTimes) break;
      std::erase_if(missed, [&](const Missed& m) {
        return m.distance < kMissed * (0.25 * sides(m.quad)).sum();
      });
      seen.clear();
      for (const Missed& m : missed) seen.push_back(m.vertex);
      bool moved = false;
      for (const Missed& m : missed)
        if (m.distance >= kFar * best && move_to(m, freedom)) moved = true;
      if (!moved) break;
      relax(freedom, rounds, context);
    }
    if (!best_spots.empty()) spots_ = std::move(best_spots);
  }

  void relax(const std::vector<Freedom>& freedom, int rounds, ExecutionContext& context) {
    for (int round = 0; round < rounds; ++round) {
      for (VertexId v = 0; at(v) < spots_.size(); ++v) {
        if (v % 256 == 0)
          context.report("relaxing", (round + v / static_cast<double>(spots_.size())) / rounds);
        if (freedom[at(v)] != Freedom::kHeld) move(v, freedom[at(v)] == Freedom::kAlongLine);
      }
    }
  }

 private:
  // False, and the corner stays, where that would turn more corners of quads over.
  bool put(VertexId v, const Spot& spot) {
    const int before = turned_around(v);
    const Spot old_spot = std::exchange(spots_[at(v)], spot);
    const Vector3 old_place = std::exchange(place_[at(v)], position(surface_, spot));
    if (turned_around(v) <= before) return true;
    spots_[at(v)] = old_spot;
    place_[at(v)] = old_place;
    return false;
  }

  // A vertex of the surface, and the quad that it is nearest to.
  struct Missed {
    double distance;
    VertexId vertex;
    Index quad;
  };
  Eigen::Array4d sides(Index q) const {
    Eigen::Array4d length;
    for (int k = 0; k < 4; ++k)
      length[k] =
          (place_[at(quads_[at(q)][at((k + 1) % 4)])] - place_[at(quads_[at(q)][at(k)])]).norm();
    return length;
  }
  // Of the rectangle with the quad's mean sides, times four.
  double area(Index q) const {
    const Eigen::Array4d length = sides(q);
    return (length[0] + length[2]) * (length[1] + length[3]);
  }
  // The farthest first.
  std::vector<Missed> missed_of(const std::vector<VertexId>& vertices,
                                const ExecutionContext& context) const {
    const BoxTree tree = tree_of(quads_, [&](VertexId v) { return place_[at(v)]; });
    std::vector<Missed> missed;
    for (const VertexId v : vertices) {
      if (v % 256 == 0) context.check();
      const BoxTree::Nearest found = tree.nearest(surface_.vertices.row(v));
      missed.push_back({found.distance, v, static_cast<Index>(found.triangle / 2)});
    }
    std::sort(missed.begin(), missed.end(), [](const Missed& a, const Missed& b) {
      return std::pair(-a.distance, a.vertex) < std::pair(-b.distance, b.vertex);
    });
    return missed;
  }

  bool move_to(const Missed& missed, std::vector<Freedom>& freedom) {
    const Vector3 goal = surface_.vertices.row(missed.vertex);
    const Quad& quad = quads_[at(missed.quad)];
    const VertexId c = *std::min_element(quad.begin(), quad.end(), [&](VertexId a, VertexId b) {
      return (place_[at(a)] - goal).squaredNorm() < (place_[at(b)] - goal).squaredNorm();
    });
    if (freedom[at(c)] != Freedom::kFree ||
        !put(c, spot_on(adjacency_.vertex_halfedge[at(missed.vertex)], 0.0)))
      return false;
    freedom[at(c)] = Freedom::kHeld;
    return true;
  }

  // The same along the line that the spot lies on, by what of the way goes along it; at a vertex of
  // more or fewer than two of its edges not beyond half of the way there.
  Spot slide_along(const Spot& from, const Vector3& way) const {
    const auto vertex = [&](VertexId v) -> Vector3 { return surface_.vertices.row(v); };
    // The edge, and how far along it the spot lies.
    HalfedgeId on = kInvalid;
    double t = 0.0, most = 0.0;
    for (int k = 0; k < 3; ++k) {
      const HalfedgeId h = 3 * from.face + k;
      if (from.weight[(k + 2) % 3] >= kOnEdge || lines_[at(h)] == 0) continue;
      on = h;
      t = from.weight[(k + 1) % 3] / (from.weight[k] + from.weight[(k + 1) % 3]);
    }
    for (int k = 0; k < 3; ++k) {
      if (from.weight[k] <= 1.0 - kOnEdge) continue;
      const VertexId v = surface_.faces(from.face, k);
      if (lines_at_[at(v)].size() != 2) return from;
      for (const HalfedgeId h : lines_at_[at(v)]) {
        const bool leaves = mesh::source(surface_.faces, h) == v;
        const VertexId w =
            leaves ? mesh::target(surface_.faces, h) : mesh::source(surface_.faces, h);
        const double along = way.dot((vertex(w) - vertex(v)).normalized());
        if (on != kInvalid && along <= most) continue;
        on = h;
        t = leaves ? 0.0 : 1.0;
        most = along;
      }
    }
    if (on == kInvalid) return from;
    const Vector3 a = vertex(mesh::source(surface_.faces, on)),
                  b = vertex(mesh::target(surface_.faces, on));
    double left = way.dot((b - a).normalized());
    bool forth = left > 0.0;
    left = std::abs(left);
    for (int steps = 0; steps < kMostEdges; ++steps) {
      const VertexId ends[2] = {mesh::source(surface_.faces, on), mesh::target(surface_.faces, on)};
      const double length = (vertex(ends[1]) - vertex(ends[0])).norm();
      if (!(length > 0.0)) break;
      const double room = (forth ? 1.0 - t : t) * length;
      if (left <= room) return spot_on(on, t + (forth ? left : -left) / length);
      const VertexId next = ends[forth ? 1 : 0];
      if (lines_at_[at(next)].size() != 2)
        return spot_on(on, t + (forth ? 0.5 : -0.5) * room / length);
      left -= room;
      const HalfedgeId o = adjacency_.opposite[at(on)];
      for (const HalfedgeId h : lines_at_[at(next)]) {
        if (h == on || h == o) continue;
        on = h;
        break;
      }
      forth = mesh::source(surface_.faces, on) == next;
      t = forth ? 0.0 : 1.0;
    }
    return from;
  }

  // Where the rectangle that is nearest to a quad has this corner.
  Vector3 wished(Index use) const {
    const Quad& quad = quads_[at(use / 4)];
    std::array<Vector3, 4> p;
    for (std::size_t k = 0; k < 4; ++k) p[k] = place_[at(quad[k])];
    const Vector3 centre = 0.25 * (p[0] + p[1] + p[2] + p[3]);
    const Vector3 u = p[1] - p[0] + p[2] - p[3], w = p[3] - p[0] + p[2] - p[1];
    const double a = u.norm(), b = w.norm();
    if (!(a > 0.0) || !(b > 0.0)) return p[at(use % 4)];
    // The sides' directions, turned apart or together as much as they must.
    const Vector3 sum = u / a + w / b, difference = u / a - w / b;
    if (!(sum.norm() > 1e-6) || !(difference.norm() > 1e-6)) return p[at(use % 4)];
    const Vector3 s = sum.normalized(), d = difference.normalized();
    const double middle = std::sqrt(a * b);
    const double scale = 0.25 * std::sqrt(0.5);
    const Vector3 right =
        scale * std::pow(a, kOwnProportions) * std::pow(middle, 1.0 - kOwnProportions) * (s + d);
    const Vector3 up =
        scale * std::pow(b, kOwnProportions) * std::pow(middle, 1.0 - kOwnProportions) * (s - d);
    const double x = use % 4 == 1 || use % 4 == 2 ? 1.0 : -1.0, y = use % 4 >= 2 ? 1.0 : -1.0;
    return centre + x * right + y * up;
  }

  // Corners of the quads around v that look against the surface.
  int turned_around(VertexId v) const {
    int count = 0;
    for (const Index use : uses_[v]) {
      const Quad& quad = quads_[at(use / 4)];
      Vector3 normal = Vector3::Zero();
      for (const VertexId c : quad) normal += normal_[at(spots_[at(c)].face)];
      for (std::size_t k = 0; k < 4; ++k) {
        const Vector3& p = place_[at(quad[k])];
        const Vector3 next = place_[at(quad[(k + 1) % 4])] - p;
        const Vector3 last = place_[at(quad[(k + 3) % 4])] - p;
        if (!(next.cross(last).dot(normal) > 0.0)) ++count;
      }
    }
    return count;
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const std::vector<Quad>& quads_;
  const mesh::EdgeFlags& lines_;
  std::vector<std::vector<HalfedgeId>> lines_at_;  // per vertex one half-edge of each line edge
  std::vector<Spot>& spots_;
  Lists<Index> uses_;  // corners 4 q + k at each vertex
  std::vector<Vector3> normal_, place_;
};

}  // namespace

std::vector<Spot> spots_of(const std::vector<Carrier>& carriers, const CoarseSurface& coarse,
                           const FlatSurface& map, const ExecutionContext& context) {
  std::vector<Spot> spots;
  for (const Carrier& carrier : carriers) {
    if (spots.size() % 256 == 0) context.check();
    spots.push_back(spot_of(carrier, coarse, map));
  }
  return spots;
}

Spot slide(const mesh::Surface& surface, const mesh::EdgeFlags& lines, Spot from,
           const Vector3& way) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const auto vertex = [&](HalfedgeId h) {
    return Vector3(surface.vertices.row(mesh::source(surface.faces, h)));
  };
  Vector3 left = way;  // what is left of it
  HalfedgeId came = kInvalid;
  for (int steps = 0; steps < 256; ++steps) {
    const HalfedgeId h = 3 * from.face;
    const Vector3 a = vertex(h + 1) - vertex(h), b = vertex(h + 2) - vertex(h);
    const Vector3 normal = a.cross(b);
    const double area = normal.squaredNorm();
    if (!(area > 0.0)) return from;
    // By how much the weights change along it.
    Vector3 change(0.0, left.cross(b).dot(normal) / area, a.cross(left).dot(normal) / area);
    change[0] = -change[1] - change[2];
    double share = 1.0;
    int out = -1;  // the corner whose weight is the first to vanish
    for (int k = 0; k < 3; ++k) {
      if (came != kInvalid && previous_corner(came) % 3 == k) continue;
      if (change[k] < 0.0 && from.weight[k] + share * change[k] < 0.0) {
        share = std::max(0.0, -from.weight[k] / change[k]);
        out = k;
      }
    }
    const HalfedgeId across = h + (out + 1) % 3;
    if (out >= 0 && !lines.empty() && lines[at(across)] != 0 &&
        adjacency.opposite[at(across)] != kInvalid)
      return tidy(from.face, from.weight + 0.5 * share * change);
    from = tidy(from.face, from.weight + share * change);
    if (out < 0) return from;
    from.weight[out] = 0.0;
    const HalfedgeId o = adjacency.opposite[at(across)];
    left *= 1.0 - share;
    if (o == kInvalid || !(left.squaredNorm() > 0.0)) return tidy(from.face, from.weight);
    // Unfolded: what runs along the edge stays, what leaves the face enters the next one.
    const Vector3 edge = (vertex(next_corner(across)) - vertex(across)).normalized();
    const Vector3 in_plane = left - left.dot(normal) / area * normal;
    const double along = in_plane.dot(edge);
    const double beyond = (in_plane - along * edge).norm();
    Vector3 inward = vertex(previous_corner(o)) - vertex(o);
    inward -= inward.dot(edge) * edge;
    left = along * edge + beyond * inward.normalized();
    Vector3 weight = Vector3::Zero();
    weight[o % 3] = from.weight[next_corner(across) % 3];
    weight[next_corner(o) % 3] = from.weight[across % 3];
    from = tidy(o / 3, weight);
    came = o;
  }
  return from;
}

Vector3 weights_in(FaceId f, VertexId v, const mesh::Surface& input,
                   const certify::Parametrization& map) {
  Vector3 weights = Vector3::Zero();
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (input.faces(f, k) == input.faces(map.vertex_parent[at(v)], i))
        weights[k] += map.vertex_barycentric(v, i);
  return weights;
}

Spot on_input(const certify::Parametrization& map, const mesh::Surface& input, const Spot& spot) {
  const FaceId parent = map.parent_face[at(spot.face)];
  Vector3 weight = Vector3::Zero();
  for (int k = 0; k < 3; ++k)
    weight += spot.weight[k] * weights_in(parent, map.surface.faces(spot.face, k), input, map);
  return tidy(parent, weight);
}

std::vector<char> on_lines(const mesh::Surface& surface, const mesh::EdgeFlags& lines,
                           const std::vector<Spot>& spots) {
  std::vector<char> vertex_on(at(surface.vertices.rows()), 0);
  for (HalfedgeId h = 0; at(h) < lines.size(); ++h) {
    if (lines[at(h)] == 0) continue;
    vertex_on[at(mesh::source(surface.faces, h))] = 1;
    vertex_on[at(mesh::target(surface.faces, h))] = 1;
  }
  std::vector<char> on;
  for (const Spot& spot : spots) {
    bool found = false;
    for (int k = 0; k < 3; ++k) {
      found = found || (spot.weight[(k + 2) % 3] < kOnEdge && lines[at(3 * spot.face + k)] != 0) ||
              (spot.weight[k] > 1.0 - kOnEdge && vertex_on[at(surface.faces(spot.face, k))] != 0);
    }
    on.push_back(found ? 1 : 0);
  }
  return on;
}

void relax(const mesh::Surface& surface, const std::vector<Quad>& quads,
           const mesh::EdgeFlags& lines, const std::vector<Freedom>& freedom, int rounds,
           std::vector<Spot>& spots, ExecutionContext& context) {
  constexpr int kRoundsAfter = 5;
  Relaxation relaxation(surface, quads, lines, spots);
  relaxation.relax(freedom, rounds, context);
  relaxation.reach(freedom, kRoundsAfter, context);
}

}  // namespace flipfree::quads
