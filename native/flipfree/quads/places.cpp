#include "flipfree/quads/places.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"

namespace flipfree::quads {

namespace {

// Weights made what they should be up to rounding.
Spot tidy(FaceId face, Vector3 weight) {
  weight = weight.cwiseMax(0.0);
  return {face, weight / weight.sum()};
}

// From a vertex of the map along a vector, which lies counter-clockwise of the direction in which
// the half-edge leaves on the coarse surface, or is the same. Where the way meets vertices, it
// passes to their left.
class Straight {
 public:
  Straight(const FlatSurface& map, CornerId corner, const Vector2& way) : map_(map) {
    corner_ = corner;
    way_ = way;
    // Into the sector that holds the vector.
    while (true) {
      const HalfedgeId last = previous_corner(corner_);
      const HalfedgeId across = map_[last].opposite;
      if (across == kInvalid || flipfree::cross(way_, as_vector(-map_[last].edge)) > 0.0) break;
      way_ = turned(way_, map_[last].turn);
      corner_ = across;
    }
  }

  Spot end() const {
    HalfedgeId out = next_corner(corner_);
    // In the chart of the first face, with the vertex at the origin: the ends of `out`, and by how
    // many quarters vectors of its face are turned to get there.
    Vector2 right = as_vector(map_[corner_].edge);
    Vector2 left = right + as_vector(map_[out].edge);
    Vector2 third = Vector2::Zero();
    Index turn = 0;
    while (flipfree::cross(left - right, way_ - right) < 0.0) {
      const HalfedgeId o = map_[out].opposite;
      if (o == kInvalid) break;
      turn += map_[o].turn;
      const Vector2 apex = right + turned(as_vector(map_[next_corner(o)].edge), turn);
      if (flipfree::cross(way_, apex) > 0.0) {
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
    weight[out % 3] = twice_area(way_, left, third);
    weight[next_corner(out) % 3] = twice_area(way_, third, right);
    weight[previous_corner(out) % 3] = twice_area(way_, right, left);
    return tidy(out / 3, weight);
  }

 private:
  const FlatSurface& map_;
  CornerId corner_;
  Vector2 way_;
};

Spot spot_of(const Carrier& carrier, const CoarseSurface& coarse, const FlatSurface& map) {
  const HalfedgeId h = carrier.halfedge;
  const auto walk = [&](HalfedgeId from, const Vector2& way) {
    return Straight(map, coarse[from].start, turned(way, coarse[from].start_turn)).end();
  };
  if (carrier.at_vertex) {
    Spot spot{coarse[h].start / 3, Vector3::Zero()};
    spot.weight[coarse[h].start % 3] = 1.0;
    return spot;
  }
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

Spot slide(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
           const mesh::EdgeFlags& lines, Spot from, const Vector3& way) {
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

Spot on_input(const certify::Parametrization& map, const mesh::Surface& input, const Spot& spot) {
  const FaceId parent = map.parent_face[at(spot.face)];
  Vector3 weight = Vector3::Zero();
  for (int k = 0; k < 3; ++k) {
    const VertexId v = map.surface.faces(spot.face, k);
    const FaceId of_vertex = map.vertex_parent[at(v)];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        if (input.faces(parent, j) == input.faces(of_vertex, i))
          weight[j] += spot.weight[k] * map.vertex_barycentric(v, i);
      }
    }
  }
  return tidy(parent, weight);
}

}  // namespace flipfree::quads
