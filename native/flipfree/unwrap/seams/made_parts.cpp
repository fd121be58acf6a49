#include "flipfree/unwrap/seams/made_parts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numbers>
#include <queue>
#include <tuple>
#include <unordered_map>
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
// Bevels are narrower than this, in roots of the part's area, all together than that; they bend
// less than this from face to face, and away from their flat face than that. Around rims they bend
// into themselves: they overlap from a share of the width up to them on.
constexpr double kBevelWidth = 0.03;
constexpr double kBevelReach = 0.09;
constexpr double kBevelAngle = 0.88;
constexpr double kBevelTurn = 1.5;
constexpr double kBevelDepth = 0.15;

double longest_of(const Corners& p) {
  return std::max({(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()});
}

}  // namespace

Shapes::Shapes(const mesh::Surface& whole, const mesh::EdgeFlags& given)
    : surface(whole),
      faces(whole.faces),
      adjacency(whole.adjacency()),
      seams(given),
      curvature(at(whole.vertices.rows()), 0.0),
      bend(curvature),
      soft(at(faces.rows()), 0.0) {
  std::vector<double> corners(curvature.size(), 0.0);
  std::vector<char> is_border(corners.size(), 0);
  double sum = 0.0;
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    std::array<Vector3, 3> p;
    for (Index k = 0; k < 3; ++k) p[at(k)] = surface.vertices.row(faces(f, k)).transpose();
    const Vector3 e = p[1] - p[0];
    const Vector3 d = p[2] - p[0];
    const double length = e.norm();
    const double doubled = e.cross(d).norm();
    area.push_back(0.5 * doubled);
    sum += 0.5 * doubled;
    flat.push_back(
        {Vector2::Zero(), Vector2(length, 0.0),
         length > 0.0 ? Vector2(e.dot(d) / length, doubled / length) : Vector2(d.norm(), 0.0)});
    for (Index k = 0; k < 3; ++k) {
      const Vector3 a = p[at((k + 1) % 3)] - p[at(k)];
      const Vector3 b = p[at((k + 2) % 3)] - p[at(k)];
      curvature[at(faces(f, k))] -= std::atan2(a.cross(b).norm(), a.dot(b));
      corners[at(faces(f, k))] += 1.0;
      const HalfedgeId h = 3 * f + k;
      if (adjacency.opposite[at(h)] != kInvalid && seams[at(h)] == 0) continue;
      is_border[at(mesh::source(faces, h))] = is_border[at(mesh::target(faces, h))] = 1;
    }
  }
  for (std::size_t v = 0; v < is_border.size(); ++v) {
    const double own = curvature[v] + 2 * std::numbers::pi;
    curvature[v] = is_border[v] != 0 ? 0.0 : std::abs(own) / corners[v];
  }
  size = std::sqrt(sum);
}

std::vector<MadePart> parts_of(const std::vector<double>& cost, Shapes& shapes) {
  const mesh::Surface& surface = shapes.surface;
  const Triangles& faces = shapes.faces;
  const mesh::Components components = mesh::components_between(shapes.adjacency, shapes.seams);
  std::vector<MadePart> parts(at(components.count));
  shapes.place.resize(components.of_face.size());
  const auto width = [&](FaceId f) {
    const double longest = longest_of(shapes.flat[at(f)]);
    return shapes.area[at(f)] / (longest * longest);
  };
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    FaceId& shaped = shapes.shaped.emplace_back(f);
    for (const bool in_polygon : {true, false}) {
      if (width(shaped) >= kNeedle) break;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = shapes.adjacency.opposite[at(h)];
        if (o == kInvalid || (cost[at(h)] == mesh::ShortestPaths::kUnreached) != in_polygon)
          continue;
        const FaceId other = o / 3 < f ? shapes.shaped[at(o / 3)] : o / 3;
        if (width(other) > width(shaped)) shaped = other;
      }
    }
  }
  for (FaceId f = 0; f < static_cast<FaceId>(faces.rows()); ++f) {
    MadePart& part = parts[at(components.of_face[at(f)])];
    shapes.place[at(f)] = static_cast<Index>(part.faces.size());
    part.faces.push_back(f);
    part.area += shapes.area[at(f)];
    part.extent = std::max(part.extent, longest_of(shapes.flat[at(f)]));
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const HalfedgeId o = shapes.adjacency.opposite[at(h)];
      if (o == kInvalid || o < h || shapes.seams[at(h)] != 0) continue;
      if (cost[at(h)] == mesh::ShortestPaths::kUnreached) {
        part.joined.push_back(h);
        continue;
      }
      const double length = edge_length(surface, h);
      const double plain = length * bend_factor(surface, h, o);
      const double weight = plain > 0.0 ? cost[at(h)] / plain : 1.0;
      const double angle = bend_between(surface, shapes.shaped[at(f)], shapes.shaped[at(o / 3)]);
      for (const VertexId v : {mesh::source(faces, h), mesh::target(faces, h)})
        shapes.bend[at(v)] = std::max(shapes.bend[at(v)], angle);
      part.hinges.push_back({h, length, weight, angle});
    }
  }
  for (MadePart& part : parts) part.extent = std::max(part.extent, part.size());
  return parts;
}

std::optional<double> flat_if_hard(const Shapes& shapes, const MadePart& part) {
  if (part.hinges.empty() || !(part.extent < kWire * part.size())) return {};
  Regions flat(shapes, part, kFlatAngle);
  Regions smooth(shapes, part, kSmoothAngle);
  // Faces of a fine mesh bend little from each to the next one, however much in all.
  std::vector<Vector3> direction(part.faces.size(), Vector3::Zero());
  for (const FaceId f : part.faces)
    direction[at(flat.of(f))] += shapes.area[at(f)] * face_normal(shapes.surface, f).normalized();
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
  shapes.soft[at(f)] = 2.0 * kBevelDepth * shapes.area[at(f)] / longest_of(shapes.flat[at(f)]);
}

std::vector<HalfedgeId> bevels_of(Shapes& shapes, MadePart& part) {
  part.bevelled = true;
  Regions flat(shapes, part, kPlateAngle);
  const auto angle = [&](FaceId f, FaceId g) {
    return bend_between(shapes.surface, shapes.shaped[at(f)], shapes.shaped[at(g)]);
  };
  const auto beyond = [&](HalfedgeId h) { return shapes.adjacency.opposite[at(h)]; };
  std::unordered_map<Index, std::vector<HalfedgeId>> around;
  for (const Hinge& hinge : part.hinges) {
    for (const HalfedgeId h : {hinge.h, beyond(hinge.h)}) {
      if (hinge.angle >= kPlateAngle && hinge.angle < kBevelAngle)
        around[flat.of(h / 3)].push_back(h);
    }
  }
  std::unordered_map<Index, FaceId> owner;
  std::vector<std::pair<double, FaceId>> plates;  // the largest first, those of one size by number
  for (const FaceId f : part.faces) {
    const Index region = flat.of(f);
    const double area = flat.area(region);
    if (area >= kRegion * part.area && owner.emplace(region, f).second)
      plates.emplace_back(-std::round(1e3 * area / part.area), f);
  }
  std::sort(plates.begin(), plates.end());
  std::vector<HalfedgeId> inside;
  std::unordered_map<Index, double> depth;
  // What is parallel to a plate beyond a step goes to the nearest one, with the step; then one
  // plate after the other takes what is left.
  for (const bool to_parallels : {true, false}) {
    using Reach = std::tuple<std::size_t, double, HalfedgeId, FaceId>;  // turn, width; into; from
    std::priority_queue<Reach, std::vector<Reach>, std::greater<>> next;
    std::unordered_map<Index, std::pair<HalfedgeId, double>> into;  // and the width up to there
    const auto go_on = [&](Index region, std::size_t turn, double reached, FaceId plate) {
      for (const HalfedgeId h : around[region]) {
        const HalfedgeId o = beyond(h);
        const auto own = owner.find(flat.of(o / 3));
        if (own != owner.end() && own->second != plate) continue;
        const Vector2 side =
            shapes.flat[at(o / 3)][at((o % 3 + 1) % 3)] - shapes.flat[at(o / 3)][at(o % 3)];
        const double width = flat.area(flat.of(o / 3)) / side.norm();
        if (width < kBevelWidth * part.size() && reached + width < kBevelReach * part.size() &&
            angle(plate, o / 3) < kBevelTurn)
          next.emplace(turn, reached + width, o, plate);
      }
    };
    for (std::size_t i = 0; i < plates.size(); ++i)
      go_on(flat.of(plates[i].second), to_parallels ? 0 : i, 0.0, plates[i].second);
    while (!next.empty()) {
      const auto [turn, width, h, plate] = next.top();
      next.pop();
      Index region = flat.of(h / 3);
      if (!into.emplace(region, std::pair(h, width)).second) continue;
      go_on(region, turn, width, plate);
      if (to_parallels && angle(plate, h / 3) >= kPlateAngle) continue;
      while (owner.emplace(region, plate).second) {
        const auto& [entry, reached] = into.at(region);
        inside.push_back(entry);
        depth[region] = kBevelDepth * reached;
        region = flat.of(beyond(entry) / 3);
      }
    }
  }
  for (Hinge& hinge : part.hinges) {
    const HalfedgeId o = beyond(hinge.h);
    const auto a = owner.find(flat.of(hinge.h / 3));
    const auto b = owner.find(flat.of(o / 3));
    if (hinge.angle < kFlatAngle || (a == owner.end() && b == owner.end())) continue;
    const FaceId f = a == owner.end() ? hinge.h / 3 : a->second;
    const FaceId g = b == owner.end() ? o / 3 : b->second;
    if (f == g || angle(f, g) < kFlatAngle) {
      inside.push_back(hinge.h);
    } else {
      hinge.angle = angle(f, g);
    }
  }
  for (const FaceId f : part.faces) {
    const auto own = depth.find(flat.of(f));
    if (own != depth.end()) shapes.soft[at(f)] = own->second;
  }
  return inside;
}

}  // namespace flipfree::unwrap
