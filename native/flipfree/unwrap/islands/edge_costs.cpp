#include "flipfree/unwrap/islands/edge_costs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/islands/corners.h"

namespace flipfree::unwrap {
namespace {

// A right angle or more outward, and inward, where seams are hidden, too; between them and the
// plane the cost changes evenly.
constexpr double kCreaseCost = 0.7;
constexpr double kHollowCost = 0.55;
// Seams of no length at all would wander.
constexpr double kLeastSeamWeight = 1e-3;
// Height over length of faces whose normal is but rounding.
constexpr double kThinnestWithNormal = 1e-8;

// Zero where the face has no shape that would tell.
Vector3 normal_of(const mesh::Surface& surface, FaceId f) {
  const Vector3 p = surface.vertices.row(surface.faces(f, 0));
  const Vector3 a = surface.vertices.row(surface.faces(f, 1)).transpose() - p;
  const Vector3 b = surface.vertices.row(surface.faces(f, 2)).transpose() - p;
  const Vector3 normal = a.cross(b);
  const double length = normal.norm();
  const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
  return length > kThinnestWithNormal * longest ? Vector3(normal / length)
                                                : Vector3(Vector3::Zero());
}

bool tell_their_bend(const Vector3& a, const Vector3& b) {
  return !a.isZero(0.0) && !b.isZero(0.0);
}

// The weights that were given, by edge.
class Weights {
 public:
  explicit Weights(const SeamOptions& options) {
    const auto count = static_cast<std::size_t>(options.weighted.rows());
    if (options.weights.size() != count) {
      throw_invalid(ErrorCode::kBadShape, "There are " + std::to_string(count) +
                                              " edges with weights, but " +
                                              std::to_string(options.weights.size()) +
                                              " weights. Give one weight for each edge.");
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Edge edge = std::minmax({options.weighted(static_cast<Eigen::Index>(i), 0),
                                     options.weighted(static_cast<Eigen::Index>(i), 1)});
      if (!(options.weights[i] >= 0.0)) {
        throw_invalid(ErrorCode::kBadOption,
                      "The weight of edge " + std::to_string(i) +
                          " is negative or no number. Give 0 for a seam that costs nothing, and "
                          "infinity for none.",
                      ElementKind::kEdge, {edge.first, edge.second});
      }
      sorted_.emplace_back(edge, std::max(options.weights[i], kLeastSeamWeight));
    }
    std::sort(sorted_.begin(), sorted_.end());
  }

  bool empty() const { return sorted_.empty(); }

  // 1 for edges without a weight; the least of several.
  double of(VertexId a, VertexId b) const {
    const Edge edge = std::minmax(a, b);
    const auto found = std::lower_bound(
        sorted_.begin(), sorted_.end(), edge,
        [](const std::pair<Edge, double>& w, const Edge& wanted) { return w.first < wanted; });
    return found != sorted_.end() && found->first == edge ? found->second : 1.0;
  }

 private:
  using Edge = std::pair<VertexId, VertexId>;
  std::vector<std::pair<Edge, double>> sorted_;
};

}  // namespace

double bend_factor(const mesh::Surface& surface, HalfedgeId h, HalfedgeId o) {
  const Vector3 a = normal_of(surface, h / 3);
  const Vector3 b = normal_of(surface, o / 3);
  if (!tell_their_bend(a, b)) return 1.0;
  const VertexId apex = surface.faces(o / 3, previous_corner(o) % 3);
  const Vector3 over =
      (surface.vertices.row(apex) - surface.vertices.row(mesh::source(surface.faces, h)))
          .transpose();
  const double sharpness = std::clamp(1.0 - a.dot(b), 0.0, 1.0);
  return 1.0 - sharpness * (1.0 - (a.dot(over) > 0.0 ? kHollowCost : kCreaseCost));
}

std::vector<double> edge_costs(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                               const mesh::EdgeFlags& uncuttable, const SeamOptions& options) {
  const Weights weights(options);
  if (!weights.empty())
    mesh::flag_edges(surface.faces, adjacency, options.weighted);  // refuses what is no edge
  std::vector<double> cost(adjacency.opposite.size(), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o < h) {
      if (o != kInvalid) cost[at(h)] = cost[at(o)];
      continue;
    }
    if (!uncuttable.empty() && uncuttable[at(h)] != 0) {
      cost[at(h)] = mesh::ShortestPaths::kUnreached;
      continue;
    }
    const VertexId a = mesh::source(surface.faces, h);
    const VertexId b = mesh::target(surface.faces, h);
    cost[at(h)] = weights.of(a, b) * edge_length(surface, h) * bend_factor(surface, h, o);
    // An edge without length that is never to be a seam.
    if (std::isnan(cost[at(h)])) cost[at(h)] = mesh::ShortestPaths::kUnreached;
  }
  return cost;
}

mesh::EdgeFlags with_sharp_edges(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                 mesh::EdgeFlags seams, const mesh::EdgeFlags& uncuttable,
                                 double sharp_angle) {
  if (!(sharp_angle > 0.0)) return seams;
  const double least = std::cos(sharp_angle);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(seams.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o < h || (!uncuttable.empty() && uncuttable[at(h)] != 0)) continue;
    const Vector3 a = normal_of(surface, h / 3);
    const Vector3 b = normal_of(surface, o / 3);
    if (tell_their_bend(a, b) && a.dot(b) < least) seams[at(h)] = seams[at(o)] = 1;
  }
  return seams;
}

mesh::SeparateOptions separating(const UnwrapOptions& options) {
  mesh::SeparateOptions separating;
  separating.seams = &options.cuts;
  separating.diagonals = &options.uncuttable;
  if (!options.material.empty()) separating.material = &options.material;
  if (!options.polygon.empty()) separating.polygon = &options.polygon;
  return separating;
}

UnwrapOptions on_separated(const certify::SeparatedMap& separated, const UnwrapOptions& of_input) {
  const Weights weights(of_input.seams);
  UnwrapOptions options = of_input;
  options.cuts = separated.edges(of_input.cuts);
  options.uncuttable = separated.edges(of_input.uncuttable);
  options.pins = separated.pins(of_input.pins);
  options.seams.weighted = separated.edges(of_input.seams.weighted);
  options.seams.weights.clear();
  const std::vector<VertexId>& origin = separated.separated().vertex_origin;
  for (const auto& edge : options.seams.weighted.rowwise())
    options.seams.weights.push_back(weights.of(origin[at(edge[0])], origin[at(edge[1])]));
  return options;
}

}  // namespace flipfree::unwrap
