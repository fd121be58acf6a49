#include "flipfree/unwrap/seams/costs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/shortest_paths.h"
#include "flipfree/unwrap/islands/islands.h"

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

// Of the angle between two faces; nothing where one has no shape that would tell.
std::optional<double> cosine_between(const mesh::Surface& surface, FaceId f, FaceId g) {
  std::array<Vector3, 2> normal;
  for (const FaceId face : {f, g}) {
    const auto [a, b] = mesh::sides_at(surface, 3 * face);
    const Vector3 upright = a.cross(b);
    const double length = upright.norm();
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), (b - a).squaredNorm()});
    if (!(length > kThinnestWithNormal * longest)) return {};
    normal[face == f ? 0 : 1] = upright / length;
  }
  return normal[0].dot(normal[1]);
}

// The weights that were given, by edge: the least of several.
std::map<mesh::VertexPair, double> weights_of(const SeamOptions& options) {
  const auto count = at(options.weighted.rows());
  if (options.weights.size() != count) {
    throw_invalid(ErrorCode::kBadShape, "There are " + std::to_string(count) +
                                            " edges with weights, but " +
                                            std::to_string(options.weights.size()) +
                                            " weights. Give one weight for each edge.");
  }
  std::map<mesh::VertexPair, double> weights;
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = options.weighted.row(static_cast<Eigen::Index>(i));
    const mesh::VertexPair edge = std::minmax({row[0], row[1]});
    if (!(options.weights[i] >= 0.0)) {
      throw_invalid(ErrorCode::kBadOption,
                    "The weight of edge " + std::to_string(i) +
                        " is negative or no number. Give 0 for a seam that costs nothing, and "
                        "infinity for none.",
                    ElementKind::kEdge, {edge.first, edge.second});
    }
    double& weight = weights.try_emplace(edge, options.weights[i]).first->second;
    weight = std::max(std::min(weight, options.weights[i]), kLeastSeamWeight);
  }
  return weights;
}

}  // namespace

double bend_factor(const mesh::Surface& surface, HalfedgeId h, HalfedgeId o) {
  const std::optional<double> cosine = cosine_between(surface, h / 3, o / 3);
  if (!cosine) return 1.0;
  const double over =
      surface.area_vector(h / 3).dot(-mesh::sides_at(surface, previous_corner(o)).previous);
  const double sharpness = std::clamp(1.0 - *cosine, 0.0, 1.0);
  return 1.0 - sharpness * (1.0 - (over > 0.0 ? kHollowCost : kCreaseCost));
}

std::vector<double> edge_costs(const mesh::Surface& surface, const mesh::EdgeFlags& uncuttable,
                               const SeamOptions& options) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  const std::map<mesh::VertexPair, double> weights = weights_of(options);
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
    const auto own = weights.find(mesh::ends(surface.faces, h));
    cost[at(h)] = (own == weights.end() ? 1.0 : own->second) * edge_length(surface, h) *
                  bend_factor(surface, h, o);
    // An edge without length that is never to be a seam.
    if (std::isnan(cost[at(h)])) cost[at(h)] = mesh::ShortestPaths::kUnreached;
  }
  return cost;
}

mesh::EdgeFlags never_seams(const std::vector<double>& cost) {
  mesh::EdgeFlags never;
  for (const double c : cost) never.push_back(c == mesh::ShortestPaths::kUnreached ? 1 : 0);
  return never;
}

mesh::EdgeFlags with_sharp_edges(const mesh::Surface& surface, mesh::EdgeFlags seams,
                                 const mesh::EdgeFlags& uncuttable, double sharp_angle) {
  if (!(sharp_angle > 0.0)) return seams;
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  const double least = std::cos(sharp_angle);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(seams.size()); ++h) {
    const HalfedgeId o = opposite[at(h)];
    if (o < h || (!uncuttable.empty() && uncuttable[at(h)] != 0)) continue;
    if (cosine_between(surface, h / 3, o / 3).value_or(1.0) < least)
      seams[at(h)] = seams[at(o)] = 1;
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
  const std::map<mesh::VertexPair, double> weights = weights_of(of_input.seams);
  UnwrapOptions options = of_input;
  options.cuts = separated.edges(of_input.cuts);
  options.uncuttable = separated.edges(of_input.uncuttable);
  options.pins = separated.pins(of_input.pins);
  options.polygon.clear();
  for (const FaceId f : separated.separated().face_origin)
    if (!of_input.polygon.empty()) options.polygon.push_back(of_input.polygon[at(f)]);
  options.seams.weighted = separated.edges(of_input.seams.weighted);
  options.seams.weights.clear();
  const std::vector<VertexId>& origin = separated.separated().vertex_origin;
  for (const auto& edge : options.seams.weighted.rowwise())
    options.seams.weights.push_back(
        weights.at(std::minmax(origin[at(edge[0])], origin[at(edge[1])])));
  return options;
}

namespace {

constexpr int kDirections = 48;
// Pixels along a side of a picture: as many pixels as twice the faces, within these.
constexpr int kLeastSide = 96;
constexpr int kMostSide = 320;
constexpr Index kPixels = 6;
// Neighbours are averaged so often: single faces cover few pixels.
constexpr int kAveragingRounds = 3;
// What a direction counts grows with the power of what it shows.
constexpr double kSharpness = 4.0;

// Pixels in a unit of length.
double unit_of(int side) { return 0.5 * side / std::numbers::sqrt3; }

// To the right, up and away. Evenly distributed: points of a spiral from pole to pole (Fibonacci
// lattice).
Eigen::Matrix3d frame_of(int direction) {
  const double z = 1.0 - (2.0 * direction + 1.0) / kDirections;
  const double turn = direction * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double r = std::sqrt(1.0 - z * z);
  const Vector3 away(r * std::cos(turn), r * std::sin(turn), z);
  const Vector3 right = away.unitOrthogonal();
  Eigen::Matrix3d frame;
  frame << right, away.cross(right), away;
  return frame;
}

// Coordinates of about one around the origin, whatever the user's unit.
Points3 in_own_unit(const Points3& positions, const Triangles& faces) {
  const Points3 used = positions(faces.reshaped(), Eigen::all);
  // Halves first: the difference of two huge coordinates may not be finite.
  const Eigen::RowVector3d middle =
      0.5 * used.colwise().minCoeff() + 0.5 * used.colwise().maxCoeff();
  const Points3 places = (0.5 * positions).rowwise() - 0.5 * middle;
  const double radius = places(faces.reshaped(), Eigen::all).cwiseAbs().maxCoeff();
  return radius > 0.0 ? Points3(places / radius) : places;
}

// Which face is in front at each pixel of a picture.
std::vector<FaceId> picture_of(const Points3& places, const Triangles& faces,
                               const Eigen::Matrix3d& frame, int side,
                               const ExecutionContext& context) {
  constexpr FaceId kFacesPerCheck = 1 << 14;
  std::vector<double> depth(at(side * side), std::numeric_limits<double>::infinity());
  std::vector<FaceId> nearest(depth.size(), kInvalid);
  // The cube of side two around the origin fits whatever the direction.
  const double unit = unit_of(side);
  Points3 drawn = places * frame;
  drawn.leftCols(2) = (unit * drawn.leftCols(2)).array() + 0.5 * side;
  // Calls visit() for the pixels whose centres lie between.
  const auto for_pixels = [&](double low, double high, auto visit) {
    const int last = std::min(static_cast<int>(std::floor(high - 0.5)), side - 1);
    for (int i = std::max(static_cast<int>(std::ceil(low - 0.5)), 0); i <= last; ++i) visit(i);
  };
  for (FaceId f = 0; f < faces.rows(); ++f) {
    if (f % kFacesPerCheck == 0) context.check();
    const std::array<Vector3, 3> p = {drawn.row(faces(f, 0)), drawn.row(faces(f, 1)),
                                      drawn.row(faces(f, 2))};
    const Vector3 normal = (p[1] - p[0]).cross(p[2] - p[0]);
    if (normal.z() == 0.0) continue;
    const Vector2 slope = -normal.head<2>() / normal.z();
    const auto [top, bottom] = std::minmax({p[0].y(), p[1].y(), p[2].y()});
    const std::pair<double, double> depths = std::minmax({p[0].z(), p[1].z(), p[2].z()});
    for_pixels(top, bottom, [&](int y) {
      const double line = y + 0.5;
      double left = side;
      double right = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3& a = p[k];
        const Vector3& b = p[(k + 1) % 3];
        if ((a.y() <= line) == (b.y() <= line)) continue;
        const double x = a.x() + (line - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
        left = std::min(left, x);
        right = std::max(right, x);
      }
      for_pixels(left, right, [&](int x) {
        // Of a face seen from its side rounding would leave it.
        const double z = std::clamp(p[0].z() + slope.dot(Vector2(x + 0.5, line) - p[0].head<2>()),
                                    depths.first, depths.second);
        const std::size_t pixel = at(y * side + x);
        if (!(z < depth[pixel])) return;
        depth[pixel] = z;
        nearest[pixel] = f;
      });
    });
  }
  return nearest;
}

// Per face, how much it bends towards its neighbours for its size.
std::vector<double> bends_of(const mesh::Surface& surface, const std::vector<double>& area) {
  const std::vector<HalfedgeId>& opposite = surface.adjacency().opposite;
  std::vector<double> bend(area.size(), 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(opposite.size()); ++h) {
    const HalfedgeId o = opposite[at(h)];
    if (o == kInvalid || !(area[at(h / 3)] > 0.0) || !(area[at(o / 3)] > 0.0)) continue;
    bend[at(h / 3)] += edge_length(surface, h) * bend_between(surface, h / 3, o / 3) /
                       (area[at(h / 3)] + area[at(o / 3)]);
  }
  return bend;
}

}  // namespace

std::vector<double> exposure(const mesh::Surface& surface, ExecutionContext& context) {
  const Triangles& faces = surface.faces;
  const mesh::Surface placed{in_own_unit(surface.vertices, faces), surface.faces};
  const std::vector<double> area = face_areas(placed);
  const std::vector<double> bend = bends_of(placed, area);
  const auto pixels = static_cast<double>(kPixels * faces.rows());
  const int side = std::clamp(static_cast<int>(std::sqrt(pixels)), kLeastSide, kMostSide);
  std::vector<std::vector<FaceId>> pictures(kDirections);
  std::vector<double> shows(kDirections, 0.0);
  parallel_for(context, kDirections, 1, [&](std::size_t d, std::size_t, std::size_t) {
    pictures[d] = picture_of(placed.vertices, faces, frame_of(static_cast<int>(d)), side, context);
    for (const FaceId f : pictures[d]) {
      if (f != kInvalid) shows[d] += bend[at(f)];
    }
  });
  const double most = *std::max_element(shows.begin(), shows.end());
  if (!(most > 0.0)) std::fill(shows.begin(), shows.end(), 1.0);  // flat
  double total = 0.0;
  for (double& s : shows) total += s = std::pow(most > 0.0 ? s / most : 1.0, kSharpness);
  std::vector<double> light(area.size(), 0.0);
  for (std::size_t d = 0; d < pictures.size(); ++d) {
    for (const FaceId f : pictures[d]) {
      if (f != kInvalid) light[at(f)] += shows[d];
    }
  }
  // A face of a ball is in sight from half of all directions, under half its size on the mean.
  const double full = 0.25 * total * unit_of(side) * unit_of(side);
  Eigen::ArrayX2d sums =
      Eigen::ArrayX2d::Zero(surface.vertices.rows(), 2);  // light, and what would be full
  for (FaceId f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k)
      sums.row(faces(f, k)) += Eigen::Array2d(light[at(f)], full * area[at(f)]).transpose();
  }
  for (int round = 0; round < kAveragingRounds; ++round) {
    const Eigen::ArrayX2d own = sums;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) sums.row(faces(f, k)) += own.row(faces(f, next_corner(k)));
    }
  }
  std::vector<double> result(at(surface.vertices.rows()), 1.0);
  for (std::size_t v = 0; v < result.size(); ++v) {
    const auto sum = sums.row(static_cast<Eigen::Index>(v));
    if (sum[1] > 0.0) result[v] = sum[0] / sum[1];
  }
  return result;
}

}  // namespace flipfree::unwrap
