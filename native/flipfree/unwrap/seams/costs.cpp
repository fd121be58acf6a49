#include "flipfree/unwrap/seams/costs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"
#include "flipfree/mesh/adjacency.h"
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

// Zero where the face has no shape that would tell.
Vector3 normal_of(const mesh::Surface& surface, FaceId f) {
  const auto [p, q, r] = surface.corners(f);
  const Vector3 a = q - p;
  const Vector3 b = r - p;
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
    const auto count = at(options.weighted.rows());
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
      double& weight = weights_.try_emplace(edge, options.weights[i]).first->second;
      weight = std::max(std::min(weight, options.weights[i]), kLeastSeamWeight);
    }
  }

  bool empty() const { return weights_.empty(); }

  // 1 for edges without a weight; the least of several.
  double of(VertexId a, VertexId b) const {
    const auto found = weights_.find(std::minmax(a, b));
    return found == weights_.end() ? 1.0 : found->second;
  }

 private:
  using Edge = std::pair<VertexId, VertexId>;
  std::map<Edge, double> weights_;
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

std::vector<double> edge_costs(const mesh::Surface& surface, const mesh::EdgeFlags& uncuttable,
                               const SeamOptions& options) {
  const mesh::Adjacency& adjacency = surface.adjacency();
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
  options.polygon.clear();
  for (const FaceId f : separated.separated().face_origin)
    if (!of_input.polygon.empty()) options.polygon.push_back(of_input.polygon[at(f)]);
  options.seams.weighted = separated.edges(of_input.seams.weighted);
  options.seams.weights.clear();
  const std::vector<VertexId>& origin = separated.separated().vertex_origin;
  for (const auto& edge : options.seams.weighted.rowwise())
    options.seams.weights.push_back(weights.of(origin[at(edge[0])], origin[at(edge[1])]));
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

struct Frame {
  Vector3 right;
  Vector3 up;
  Vector3 away;
};

// Evenly distributed: points of a spiral from pole to pole (Fibonacci lattice).
Frame frame_of(int direction) {
  const double z = 1.0 - (2.0 * direction + 1.0) / kDirections;
  const double turn = direction * std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double r = std::sqrt(1.0 - z * z);
  Frame frame;
  frame.away = {r * std::cos(turn), r * std::sin(turn), z};
  frame.right = frame.away.unitOrthogonal();
  frame.up = frame.away.cross(frame.right);
  return frame;
}

// Coordinates of about one around the origin, whatever the user's unit.
Points3 in_own_unit(const Points3& positions, const Triangles& faces) {
  Vector3 low = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 high = -low;
  for (const VertexId v : faces.reshaped()) {
    low = low.cwiseMin(positions.row(v).transpose());
    high = high.cwiseMax(positions.row(v).transpose());
  }
  // Halves first: the difference of two huge coordinates may not be finite.
  const Vector3 middle = 0.5 * low + 0.5 * high;
  double radius = 0.0;
  Points3 places = positions;
  for (const VertexId v : faces.reshaped()) {
    places.row(v) = 0.5 * positions.row(v) - 0.5 * middle.transpose();
    radius = std::max(radius, places.row(v).cwiseAbs().maxCoeff());
  }
  if (radius > 0.0) places /= radius;
  return places;
}

// Narrows an interval to where slope x + rest >= 0, but for a pixel: whether one is inside is asked
// of each. Without it a needle's whole box is walked, and a fan has as many as it has spokes.
void narrow(double slope, double rest, double& low, double& high) {
  constexpr double kLevel = 1e-6;  // below, it decides nothing along a row
  if (std::abs(slope) < kLevel) return;
  const double x = -rest / slope;
  if (slope > 0.0) {
    low = std::max(low, x - 1.0);
  } else {
    high = std::min(high, x + 1.0);
  }
}

// Which face is in front at each pixel of a picture.
std::vector<FaceId> picture_of(const Points3& places, const Triangles& faces, const Frame& frame,
                               int side, const ExecutionContext& context) {
  constexpr FaceId kFacesPerCheck = 1 << 14;
  std::vector<double> depth(at(side * side), std::numeric_limits<double>::infinity());
  std::vector<FaceId> nearest(depth.size(), kInvalid);
  // The cube of side two around the origin fits whatever the direction.
  const double unit = unit_of(side);
  Points3 drawn(places.rows(), 3);
  drawn.col(0) = (unit * (places * frame.right)).array() + 0.5 * side;
  drawn.col(1) = (unit * (places * frame.up)).array() + 0.5 * side;
  drawn.col(2) = places * frame.away;
  // Pixels whose centres lie between.
  const auto first = [](double low) { return std::max(static_cast<int>(std::ceil(low - 0.5)), 0); };
  const auto last = [&](double high) {
    return std::min(static_cast<int>(std::floor(high - 0.5)), side - 1);
  };
  for (FaceId f = 0; f < faces.rows(); ++f) {
    if (f % kFacesPerCheck == 0) context.check();
    const Vector3 a = drawn.row(faces(f, 0));
    Vector3 b = drawn.row(faces(f, 1));
    Vector3 c = drawn.row(faces(f, 2));
    double area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (area < 0.0) {
      std::swap(b, c);
      area = -area;
    }
    if (!(area > 0.0)) continue;
    const double leftmost = std::min({a.x(), b.x(), c.x()}) - a.x();
    const double rightmost = std::max({a.x(), b.x(), c.x()}) - a.x();
    const int top = last(std::max({a.y(), b.y(), c.y()}));
    for (int y = first(std::min({a.y(), b.y(), c.y()})); y <= top; ++y) {
      const double py = y + 0.5 - a.y();
      double low = leftmost;
      double high = rightmost;
      narrow(c.y() - a.y(), (a.x() - c.x()) * py, low, high);
      narrow(a.y() - b.y(), (b.x() - a.x()) * py, low, high);
      narrow(b.y() - c.y(), area + (c.x() - b.x()) * py, low, high);
      if (!(low <= high)) continue;
      const int right = last(a.x() + high);
      for (int x = first(a.x() + low); x <= right; ++x) {
        const double px = x + 0.5 - a.x();
        const double of_b = px * (c.y() - a.y()) - (c.x() - a.x()) * py;
        const double of_c = (b.x() - a.x()) * py - px * (b.y() - a.y());
        if (of_b < 0.0 || of_c < 0.0 || of_b + of_c > area) continue;
        const double z = a.z() + (of_b * (b.z() - a.z()) + of_c * (c.z() - a.z())) / area;
        const std::size_t pixel = at(y * side + x);
        if (z >= depth[pixel]) continue;
        depth[pixel] = z;
        nearest[pixel] = f;
      }
    }
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
