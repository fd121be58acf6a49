#include "flipfree/unwrap/seams/made_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numbers>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/seams/costs.h"

namespace flipfree::unwrap {
namespace {

// Between the normals of two faces of what bevels belong to.
constexpr double kPlateAngle = 0.04;
// Shares of a part's area: of a region that counts, and what regions that count must have of a hard
// part.
constexpr double kRegion = 0.01;
constexpr double kHardRegions = 0.1;
// A smooth region whose inner vertices have less curvature (radians, sum of absolute values) is
// rolled.
constexpr double kRolled = 0.05;
// Area of a needle, over its longest side's square.
constexpr double kNeedle = 1e-3;
// What has an edge longer than this, in roots of its area, is a wire or has a needle.
constexpr double kWire = 16.0;
// Bevels are narrower than this, in roots of the part's area, all together than that, bend less
// from face to face, and away from their flat face up to the last, but for so much. Around rims
// they bend into themselves: they overlap from a share of their width on.
constexpr double kBevelWidth = 0.03;
constexpr double kBevelReach = 0.09;
constexpr double kBevelToPlate = 0.5;
constexpr double kBevelAngle = 0.88;
constexpr double kBevelTurn = 1.4;
constexpr double kBevelBack = 0.1;
constexpr double kBevelDepth = 0.3;
// Beside a facet of what is rolled is one of this share of its area, along this share of its
// longest edge. In sizes, facets count so much as other flat faces.
constexpr double kFacet = 0.5;
constexpr double kFacetSize = 0.1;

Vector3 place(const mesh::Surface& surface, VertexId v) {
  return surface.vertices.row(v).transpose();
}

}  // namespace

Shapes shapes_of(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                 const mesh::EdgeFlags& seams) {
  const Triangles& faces = surface.faces;
  const std::vector<double> zero(at(surface.vertices.rows()), 0.0);
  Shapes shapes{faces,
                adjacency,
                seams,
                0.0,
                {},
                {},
                zero,
                zero,
                {},
                {},
                std::vector<double>(at(static_cast<Index>(faces.rows())), 0.0)};
  std::vector<double> corners = zero;
  std::vector<char> is_border(at(surface.vertices.rows()), 0);
  double whole = 0.0;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    std::array<Vector3, 3> p;
    for (Index k = 0; k < 3; ++k) p[at(k)] = place(surface, faces(f, k));
    const Vector3 e = p[1] - p[0];
    const Vector3 d = p[2] - p[0];
    const double length = e.norm();
    const double doubled = e.cross(d).norm();
    shapes.area.push_back(0.5 * doubled);
    whole += 0.5 * doubled;
    shapes.flat.push_back(
        {Vector2::Zero(), Vector2(length, 0.0),
         length > 0.0 ? Vector2(e.dot(d) / length, doubled / length) : Vector2(d.norm(), 0.0)});
    for (Index k = 0; k < 3; ++k) {
      const Vector3 a = p[at((k + 1) % 3)] - p[at(k)];
      const Vector3 b = p[at((k + 2) % 3)] - p[at(k)];
      shapes.curvature[at(faces(f, k))] -= std::atan2(a.cross(b).norm(), a.dot(b));
      corners[at(faces(f, k))] += 1.0;
      const HalfedgeId h = 3 * f + k;
      if (adjacency.opposite[at(h)] != kInvalid && seams[at(h)] == 0) continue;
      is_border[at(mesh::source(faces, h))] = is_border[at(mesh::target(faces, h))] = 1;
    }
  }
  for (std::size_t v = 0; v < is_border.size(); ++v) {
    const double own = shapes.curvature[v] + 2 * std::numbers::pi;
    shapes.curvature[v] = is_border[v] != 0 ? 0.0 : std::abs(own) / corners[v];
  }
  shapes.size = std::sqrt(whole);
  return shapes;
}

std::vector<MadePart> parts_of(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                               const mesh::EdgeFlags& seams, const std::vector<double>& cost,
                               Shapes& shapes) {
  const mesh::Components components = mesh::components_between(adjacency, seams);
  std::vector<MadePart> parts(at(components.count));
  shapes.place.resize(components.of_face.size());
  const Triangles& faces = surface.faces;
  const auto width = [&](FaceId f) {
    const Corners& p = shapes.flat[at(f)];
    const double longest = std::max({p[1].x(), (p[2] - p[1]).norm(), p[2].norm()});
    return shapes.area[at(f)] / (longest * longest);
  };
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    shapes.shaped.push_back(f);
    for (HalfedgeId h = 3 * f; h < 3 * f + 3 && width(f) < kNeedle; ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o != kInvalid && cost[at(h)] == mesh::ShortestPaths::kUnreached &&
          width(o / 3) > width(shapes.shaped.back()))
        shapes.shaped.back() = o / 3;
    }
  }
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    MadePart& part = parts[at(components.of_face[at(f)])];
    shapes.place[at(f)] = static_cast<Index>(part.faces.size());
    part.faces.push_back(f);
    part.area += shapes.area[at(f)];
    for (std::size_t k = 0; k < 3; ++k) {
      const Corners& flat = shapes.flat[at(f)];
      part.extent = std::max(part.extent, (flat[(k + 1) % 3] - flat[k]).norm());
    }
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const HalfedgeId o = adjacency.opposite[at(h)];
      if (o == kInvalid || o < h || seams[at(h)] != 0) continue;
      if (cost[at(h)] == mesh::ShortestPaths::kUnreached) {
        part.joined.push_back(h);
        continue;
      }
      const Vector3 side =
          place(surface, mesh::target(faces, h)) - place(surface, mesh::source(faces, h));
      const double plain = side.norm() * bend_factor(surface, h, o);
      const double weight = plain > 0.0 ? cost[at(h)] / plain : 1.0;
      const double angle = bend_between(surface, shapes.shaped[at(f)], shapes.shaped[at(o / 3)]);
      for (const VertexId v : {mesh::source(faces, h), mesh::target(faces, h)})
        shapes.bend[at(v)] = std::max(shapes.bend[at(v)], angle);
      part.hinges.push_back({h, side.norm(), weight, angle});
    }
  }
  for (MadePart& part : parts) part.extent = std::max(part.extent, part.size());
  return parts;
}

std::optional<double> flat_if_hard(const mesh::Surface& surface, const Shapes& shapes,
                                   const MadePart& part) {
  if (part.hinges.empty() || !(part.extent < kWire * part.size())) return {};
  Regions flat(shapes, part, kFlatAngle);
  Regions smooth(shapes, part, kSmoothAngle);
  // Faces of a fine mesh bend little from each to the next one, however much in all.
  std::vector<Vector3> direction(part.faces.size(), Vector3::Zero());
  for (const FaceId f : part.faces)
    direction[at(flat.of(f))] += shapes.area[at(f)] * face_normal(surface, f).normalized();
  const auto is_plane = [&](Index region) {
    return direction[at(region)].norm() >= std::cos(kPlateAngle) * flat.area(region);
  };
  double hard = 0.0;
  double flat_area = 0.0;
  for (const FaceId f : part.faces) {
    const bool is_flat = flat.area(flat.of(f)) >= kRegion * part.area && is_plane(flat.of(f));
    const bool is_rolled = smooth.area(smooth.of(f)) >= kRegion * part.area &&
                           smooth.curvature(smooth.of(f)) < kRolled;
    if (is_flat || is_rolled) hard += shapes.area[at(f)];
    if (is_flat) flat_area += shapes.area[at(f)];
  }
  if (hard < kHardRegions * part.area) return {};
  return flat_area / part.area;
}

void soften(Shapes& shapes, FaceId f) {
  const Corners& p = shapes.flat[at(f)];
  const double longest =
      std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
  shapes.soft[at(f)] = kBevelDepth * shapes.area[at(f)] / longest;
}

std::vector<HalfedgeId> bevels_of(const mesh::Surface& surface, Shapes& shapes, MadePart& part) {
  part.bevelled = true;
  Regions flat(shapes, part, kPlateAngle);
  const auto angle = [&](FaceId f, FaceId g) {
    return bend_between(surface, shapes.shaped[at(f)], shapes.shaped[at(g)]);
  };
  const auto beyond = [&](HalfedgeId h) { return shapes.adjacency.opposite[at(h)]; };
  struct Reach {
    double share;  // of the size of the flat face
    double width;
    double turn;
    HalfedgeId h;  // into the region
    FaceId from;   // of the flat face
    bool operator<(const Reach& other) const {
      return std::tuple(-share, -h) < std::tuple(-other.share, -other.h);
    }
  };
  std::priority_queue<Reach> next;
  std::unordered_map<Index, std::vector<HalfedgeId>> around;
  for (const Hinge& hinge : part.hinges) {
    for (const HalfedgeId h : {hinge.h, beyond(hinge.h)}) {
      if (hinge.angle >= kPlateAngle && hinge.angle < kBevelAngle)
        around[flat.of(h / 3)].push_back(h);
    }
  }
  // Beside a facet of a cylinder there is another one, and no bevel.
  std::unordered_map<Index, double> longest;
  for (const FaceId f : part.faces) {
    const Corners& p = shapes.flat[at(f)];
    double& own = longest[flat.of(f)];
    for (std::size_t k = 0; k < 3; ++k) own = std::max(own, (p[(k + 1) % 3] - p[k]).norm());
  }
  const auto most = [&](FaceId from) {
    const Index plate = flat.of(from);
    return std::min(kBevelReach * part.size(), kBevelToPlate * flat.area(plate) / longest[plate]);
  };
  // Flat faces come before facets of what is rolled, of which some would be larger than others.
  std::unordered_set<Index> facets;
  for (const Hinge& hinge : part.hinges) {
    const std::array<Index, 2> sides = {flat.of(hinge.h / 3), flat.of(beyond(hinge.h) / 3)};
    if (sides[0] == sides[1] || hinge.angle >= kSmoothAngle) continue;
    for (const std::size_t k : {0u, 1u}) {
      if (hinge.length >= kFacet * longest[sides[k]] &&
          flat.area(sides[1 - k]) >= kFacet * flat.area(sides[k]))
        facets.insert(sides[k]);
    }
  }
  const auto size_of = [&](FaceId from) {
    return std::sqrt(flat.area(flat.of(from))) *
           (facets.count(flat.of(from)) == 0 ? 1.0 : kFacetSize);
  };
  std::unordered_map<Index, FaceId> owner;
  const auto grow = [&](Index region, const Reach& reach) {
    owner.emplace(region, reach.from);
    for (const HalfedgeId h : around[region]) {
      const HalfedgeId o = beyond(h);
      const Vector2 side =
          shapes.flat[at(o / 3)][at((o % 3 + 1) % 3)] - shapes.flat[at(o / 3)][at(o % 3)];
      const double width = flat.area(flat.of(o / 3)) / side.norm();
      const double whole = reach.width + width;
      const double turn = angle(reach.from, o / 3);
      if (width < kBevelWidth * part.size() && whole < most(reach.from) && turn < kBevelTurn &&
          turn > reach.turn - kBevelBack)
        next.push({whole / size_of(reach.from), whole, turn, o, reach.from});
    }
  };
  for (const FaceId f : part.faces) {
    const Index region = flat.of(f);
    if (owner.count(region) == 0 && flat.area(region) >= kRegion * part.area)
      grow(flat.of(f), {0.0, 0.0, 0.0, kInvalid, f});
  }
  std::vector<HalfedgeId> inside;
  while (!next.empty()) {
    const Reach reach = next.top();
    next.pop();
    if (owner.count(flat.of(reach.h / 3)) != 0) continue;
    inside.push_back(reach.h);
    grow(flat.of(reach.h / 3), reach);
  }
  for (Hinge& hinge : part.hinges) {
    const HalfedgeId o = beyond(hinge.h);
    const auto a = owner.find(flat.of(hinge.h / 3));
    const auto b = owner.find(flat.of(o / 3));
    if (hinge.angle < kFlatAngle || (a == owner.end() && b == owner.end())) continue;
    const FaceId f = a == owner.end() ? hinge.h / 3 : a->second;
    const FaceId g = b == owner.end() ? o / 3 : b->second;
    if (f == g) {
      inside.push_back(hinge.h);
    } else {
      hinge.angle = angle(f, g);
    }
  }
  for (const FaceId f : part.faces) {
    const auto own = owner.find(flat.of(f));
    if (own == owner.end() || flat.of(own->second) == flat.of(f)) continue;
    soften(shapes, f);
  }
  return inside;
}

}  // namespace flipfree::unwrap
