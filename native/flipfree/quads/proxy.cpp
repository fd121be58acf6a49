#include "flipfree/quads/proxy.h"

#include <algorithm>
#include <array>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/holonomy/needed_topology.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/quads/box_tree.h"
#include "flipfree/quads/places.h"

namespace flipfree::quads {

DividedSurface divided(const mesh::Surface& surface, const IndexPairs& features, double longest,
                       std::size_t most, const ExecutionContext& context) {
  constexpr double kLine = 1e-15;  // height over length of a face
  const std::size_t most_given = most;
  mesh::RefinedSurface refined = mesh::unrefined(surface);
  std::priority_queue<std::tuple<double, VertexId, VertexId>> edges;
  const auto offer = [&](VertexId a, VertexId b, bool anyway = false) {
    const double length = (refined.position[at(a)] - refined.position[at(b)]).norm();
    if (anyway || length > longest) edges.emplace(length, a, b);
  };
  const mesh::Adjacency& adjacency = surface.adjacency();
  for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
    const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
    // A line but for rounding stays one however often it is divided.
    const VertexId c = mesh::source(surface.faces, previous_corner(h));
    const Vector3 along = surface.vertices.row(b) - surface.vertices.row(a);
    const Vector3 other = surface.vertices.row(c) - surface.vertices.row(a);
    const double size = std::max(along.norm(), other.norm());
    if (!((along / size).cross(other / size).norm() > kLine)) continue;
    const auto sides = adjacency.opposite.begin() + (h - h % 3);
    // A face without neighbours has three corners, and no map four then.
    const bool alone = std::all_of(sides, sides + 3, [](HalfedgeId o) { return o == kInvalid; });
    offer(a, b, alone);
  }
  while (!edges.empty() && most > 0) {
    const auto [length, a, b] = edges.top();
    edges.pop();
    const HalfedgeId h = refined.mesh.find(a, b);
    if (h == kInvalid) continue;  // by its other half-edge
    if (most-- % 256 == 0) context.check();
    const VertexId middle = refined.split_edge(h);
    offer(a, middle);  // on the border none leaves `middle` to one of the two
    offer(b, middle);
    refined.mesh.for_each_outgoing(
        middle, [&](HalfedgeId spoke) { offer(middle, refined.mesh.target(spoke)); });
  }
  DividedSurface made{mesh::to_surface(refined), mesh::provenance_of(refined), {}, {}};
  const mesh::Adjacency& own = made.surface.adjacency();
  const holonomy::Refinement of_surface{surface, made.surface, made.provenance.face};
  const mesh::EdgeFlags wanted = mesh::flag_edges(surface.faces, adjacency, features);
  std::vector<std::pair<VertexId, VertexId>> pieces;
  for (HalfedgeId h = 0; at(h) < own.opposite.size(); ++h) {
    // Slivers so thin that middles of their sides are one point stay, with all others.
    const VertexId a = mesh::source(made.surface.faces, h);
    const VertexId b = mesh::target(made.surface.faces, h);
    if (most_given > 0 && made.surface.vertices.row(a) == made.surface.vertices.row(b))
      return divided(surface, features, longest, 0, context);
    if (own.opposite[at(h)] < h) continue;  // the border as well
    const HalfedgeId side = of_surface.input_halfedge(h);
    if (side == kInvalid || wanted[at(side)] == 0) continue;
    pieces.emplace_back(a, b);
    made.whole.push_back(std::max(side, adjacency.opposite[at(side)]));
  }
  made.features = mesh::rows_of(pieces);
  return made;
}

BroughtBack bring_back(const mesh::Surface& whole, const IndexPairs& features,
                       const std::vector<Quad>& quads, const Points3& places,
                       ExecutionContext& context) {
  constexpr int kRounds = 10;
  const mesh::Adjacency& adjacency = whole.adjacency();
  mesh::EdgeFlags lines = mesh::flag_edges(whole.faces, adjacency, features);
  std::vector<std::array<Vector3, 3>> faces, borders;
  std::vector<HalfedgeId> border;
  for (HalfedgeId h = 0; at(h) < lines.size(); ++h) {
    const Vector3 a = whole.vertices.row(mesh::source(whole.faces, h));
    const Vector3 b = whole.vertices.row(mesh::target(whole.faces, h));
    if (h % 3 == 0) faces.push_back({a, b, whole.vertices.row(whole.faces(h / 3, 2))});
    if (adjacency.opposite[at(h)] != kInvalid) continue;
    lines[at(h)] = 1;
    border.push_back(h);
    borders.push_back({a, b, b});
  }
  const BoxTree in_faces(faces), on_border(borders);
  const auto count = static_cast<std::size_t>(places.rows());
  std::vector<char> rim(count, 0);
  for (const auto& [a, b] : border_sides(quads)) rim[at(a)] = rim[at(b)] = 1;
  BroughtBack back;
  for (std::size_t v = 0; v < count; ++v) {
    if (v % 256 == 0) context.check();
    const Vector3 place = places.row(static_cast<Eigen::Index>(v));
    const BoxTree::Nearest found = rim[v] != 0 ? on_border.nearest(place) : in_faces.nearest(place);
    Spot spot{static_cast<FaceId>(found.triangle), found.weights};
    if (rim[v] != 0) {
      const HalfedgeId h = border[found.triangle];
      spot = {h / 3, Vector3::Zero()};
      spot.weight[h % 3] = found.weights[0];
      spot.weight[next_corner(h) % 3] = 1.0 - found.weights[0];
    }
    back.spots.push_back(spot);
  }
  std::vector<Freedom> freedom;
  for (const char on : on_lines(whole, lines, back.spots))
    freedom.push_back(on != 0 ? Freedom::kHeld : Freedom::kFree);
  relax(whole, quads, lines, freedom, kRounds, back.spots, context);
  for (const Quad& quad : quads) {
    const Vector3 middle = middle_of(whole, quad, back.spots);
    back.quad_parent.push_back(static_cast<FaceId>(in_faces.nearest(middle).triangle));
  }
  return back;
}

}  // namespace flipfree::quads
