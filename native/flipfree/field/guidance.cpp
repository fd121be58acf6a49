#include "flipfree/field/guidance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"

namespace flipfree::field {

namespace {

using Matrix3 = Eigen::Matrix3d;

// Weight per share of area of an alignment of 0.5: smoothness over a length l weighs 1 / l^2, in
// units in which the surface has the area 1.
constexpr double kHalf = 100.0;
// Times the square root of the area: curvatures well below it are noise.
constexpr double kFaint = 0.5;
// Curvatures whose difference, squared, is a smaller share of their squares are equal up to
// rounding.
constexpr double kEqual = 1e-20;

double weight_of(double alignment) { return kHalf * alignment / (1.0 - alignment); }

// Per vertex, the bending along the edges around it: length * dihedral angle * direction twice
// (Cohen-Steiner, Morvan 2003), half of each edge's; and a third of the areas around it.
struct Bending {
  std::vector<Matrix3> tensor;
  std::vector<double> area;
  double total = 0.0;
};

Bending measure_bending(const mesh::Surface& surface, const mesh::Adjacency& adjacency) {
  const auto vertices = static_cast<std::size_t>(surface.vertices.rows());
  Bending bending{std::vector<Matrix3>(vertices, Matrix3::Zero()),
                  std::vector<double>(vertices, 0.0), 0.0};
  const auto faces = static_cast<FaceId>(surface.faces.rows());
  Points3 normal(faces, 3);
  for (FaceId f = 0; f < faces; ++f) {
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 a = Vector3(surface.vertices.row(surface.faces(f, 1))) - p;
    const Vector3 b = Vector3(surface.vertices.row(surface.faces(f, 2))) - p;
    const Vector3 n = a.cross(b);
    const double area = 0.5 * n.norm();
    normal.row(f) = n.normalized();
    bending.total += area;
    for (int k = 0; k < 3; ++k) bending.area[at(surface.faces(f, k))] += area / 3.0;
  }
  for (HalfedgeId h = 0; h < 3 * faces; ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || o < h) continue;
    const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
    const Vector3 e = surface.vertices.row(b) - surface.vertices.row(a);
    const Vector3 direction = e.normalized();
    const Vector3 n = normal.row(h / 3), m = normal.row(o / 3);
    const double angle = std::atan2(n.cross(m).dot(direction), n.dot(m));
    const Matrix3 part = (0.5 * angle * e.norm()) * direction * direction.transpose();
    bending.tensor[at(a)] += part;
    bending.tensor[at(b)] += part;
  }
  return bending;
}

}  // namespace

Wishes no_wishes(Index faces) {
  return {Crosses::Ones(faces), std::vector<double>(at(faces), 0.0),
          std::vector<char>(at(faces), 0)};
}

void follow_curvature(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                      double alignment, Wishes& wishes) {
  if (alignment <= 0.0) return;
  const Bending bending = measure_bending(surface, adjacency);
  const double faint = kFaint * kFaint / bending.total;
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    Matrix3 tensor = Matrix3::Zero();
    double area = 0.0;
    for (int k = 0; k < 3; ++k) {
      tensor += bending.tensor[at(surface.faces(f, k))];
      area += bending.area[at(surface.faces(f, k))];
    }
    tensor /= std::max(area, 1e-300);
    // In the plane of the face, axes along its first edge and to the left of it.
    const Vector3 p = surface.vertices.row(surface.faces(f, 0));
    const Vector3 x = (Vector3(surface.vertices.row(surface.faces(f, 1))) - p).normalized();
    const Vector3 side = Vector3(surface.vertices.row(surface.faces(f, 2))) - p;
    const Vector3 y = x.cross(side).cross(x).normalized();
    const double xx = x.dot(tensor * x), yy = y.dot(tensor * y), xy = x.dot(tensor * y);
    // Twice the angle, with the difference of the two curvatures; squared, four times.
    const std::complex<double> difference(xx - yy, 2.0 * xy);
    const double squares = xx * xx + yy * yy + 2.0 * xy * xy;
    const double unequal = std::norm(difference);
    if (!(unequal > kEqual * squares) || wishes.held[at(f)] != 0) continue;
    wishes.cross[f] = difference * difference / unequal;
    wishes.weight[at(f)] = weight_of(alignment) * unequal / (squares + faint);
  }
}

void follow_edges(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                  const Frames& frames, const mesh::EdgeFlags& edges, bool boundary, double weight,
                  Wishes& wishes) {
  for (FaceId f = 0; f < static_cast<FaceId>(surface.faces.rows()); ++f) {
    std::complex<double> sum = 0.0, longest = 0.0;
    double most = 0.0;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const bool outside = adjacency.opposite[at(h)] == kInvalid;
      if (edges[at(h)] == 0 && !(outside && boundary)) continue;
      const double length = (surface.vertices.row(mesh::target(surface.faces, h)) -
                             surface.vertices.row(mesh::source(surface.faces, h)))
                                .norm();
      const auto along = std::polar(1.0, 4.0 * frames.direction[at(h)]);
      sum += length * along;
      if (length > most) {
        most = length;
        longest = along;
      }
    }
    if (!(most > 0.0)) continue;
    wishes.cross[f] = std::abs(sum) > 1e-3 * most ? sum / std::abs(sum) : longest;
    if (weight >= 1.0) {
      wishes.held[at(f)] = 1;
    } else {
      wishes.weight[at(f)] = weight_of(weight);
    }
  }
}

namespace {

// By so much a direction changes at most: more is a jump of sizes that no triangle there can take.
constexpr double kMost = 0.125 * std::numbers::pi;

}  // namespace

std::vector<double> curvature_sizing(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                                     double share) {
  constexpr double kMostBent = 16.0;
  constexpr double kExtent = 0.05;  // of the square root of the area
  constexpr double kMostRings = 200.0;
  const Bending bending = measure_bending(surface, adjacency);
  std::vector<double> bent, area = bending.area;
  double mean = 0.0;
  for (const Matrix3& tensor : bending.tensor) {
    bent.push_back(tensor.norm());
    mean += bent.back() / bending.total;
  }
  // A round of means over neighbours spreads by about an edge's square.
  const double rounds =
      std::min(kMostRings, kExtent * kExtent * static_cast<double>(surface.faces.rows()));
  for (int round = 0; round < rounds; ++round) {
    for (std::vector<double>* values : {&bent, &area}) {
      std::vector<double> sum = *values;
      std::vector<double> count(sum.size(), 1.0);
      for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
        const VertexId a = mesh::source(surface.faces, h), b = mesh::target(surface.faces, h);
        sum[at(a)] += (*values)[at(b)];
        count[at(a)] += 1.0;
      }
      for (std::size_t v = 0; v < sum.size(); ++v) (*values)[v] = sum[v] / count[v];
    }
  }
  std::vector<double> sizing;
  for (std::size_t v = 0; v < bent.size(); ++v) {
    const double ratio = area[v] > 0.0 && mean > 0.0 ? bent[v] / area[v] / mean : 1.0;
    sizing.push_back(std::pow(std::clamp(ratio, 1.0 / kMostBent, kMostBent), 0.5 * share));
  }
  return sizing;
}

void check_sizing(const std::vector<double>& sizing, const mesh::Surface& surface) {
  if (sizing.empty()) return;
  if (sizing.size() != static_cast<std::size_t>(surface.vertices.rows()))
    throw_invalid(ErrorCode::kBadShape, "sizing needs one number per vertex.");
  for (std::size_t v = 0; v < sizing.size(); ++v) {
    if (sizing[v] > 0.0 && std::isfinite(sizing[v])) continue;
    throw_invalid(ErrorCode::kBadOption,
                  "sizing at vertex " + vertex_id(v) +
                      " is not a positive number. Give the length in the map of a length 1 there.",
                  ElementKind::kVertex, {static_cast<Index>(v)});
  }
}

Frames sized_frames(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const Frames& frames, const std::vector<double>& sizing) {
  Frames sized = frames;
  for (HalfedgeId h = 0; at(h) < sized.direction.size(); ++h) {
    if (adjacency.opposite[at(h)] == kInvalid) continue;
    const double growth = std::log(sizing[at(mesh::target(surface.faces, h))] /
                                   sizing[at(mesh::source(surface.faces, h))]);
    if (growth == 0.0) continue;  // also where a corner has no angle
    // d(angle at j) = cot(angle at k) / 2 (p_i - p_j) + cot(angle at i) / 2 (p_k - p_j) to first
    // order, as both edges of the corner at j change (Springborn, Schroeder, Pinkall 2008).
    const double change = -0.5 * growth / std::tan(frames.corner[at(previous_corner(h))]);
    sized.direction[at(h)] += std::clamp(change, -kMost, kMost);
  }
  return sized;
}

}  // namespace flipfree::field
