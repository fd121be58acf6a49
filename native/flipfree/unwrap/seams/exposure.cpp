#include "flipfree/unwrap/seams/exposure.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "flipfree/base/parallel.h"

namespace flipfree::unwrap {
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

// Per face, its area, and how much it bends towards its neighbours for its size.
struct FaceShapes {
  std::vector<double> area;
  std::vector<double> bend;
};

FaceShapes face_shapes_of(const Points3& places, const Triangles& faces,
                          const mesh::Adjacency& adjacency) {
  const auto count = at(static_cast<Index>(faces.rows()));
  std::vector<Vector3> normal(count);
  std::vector<double> area(count);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    const Vector3 p = places.row(faces(f, 0));
    const Vector3 a = places.row(faces(f, 1)).transpose() - p;
    normal[at(f)] = a.cross(places.row(faces(f, 2)).transpose() - p);
    area[at(f)] = 0.5 * normal[at(f)].norm();
    if (area[at(f)] > 0.0) normal[at(f)] /= 2.0 * area[at(f)];
  }
  std::vector<double> bend(count, 0.0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o == kInvalid || !(area[at(h / 3)] > 0.0) || !(area[at(o / 3)] > 0.0)) continue;
    const double length =
        (places.row(faces(h / 3, h % 3)) - places.row(faces(h / 3, (h + 1) % 3))).norm();
    const double angle = std::atan2(normal[at(h / 3)].cross(normal[at(o / 3)]).norm(),
                                    normal[at(h / 3)].dot(normal[at(o / 3)]));
    bend[at(h / 3)] += length * angle / (area[at(h / 3)] + area[at(o / 3)]);
  }
  return {std::move(area), std::move(bend)};
}

}  // namespace

std::vector<double> exposure(const Points3& positions, const Triangles& faces,
                             const mesh::Adjacency& adjacency, ExecutionContext& context) {
  const Points3 places = in_own_unit(positions, faces);
  const FaceShapes shape = face_shapes_of(places, faces, adjacency);
  const auto pixels = static_cast<double>(kPixels * faces.rows());
  const int side = std::clamp(static_cast<int>(std::sqrt(pixels)), kLeastSide, kMostSide);
  std::vector<std::vector<FaceId>> pictures(kDirections);
  std::vector<double> shows(kDirections, 0.0);
  parallel_for(context, kDirections, 1, [&](std::size_t d, std::size_t, std::size_t) {
    pictures[d] = picture_of(places, faces, frame_of(static_cast<int>(d)), side, context);
    for (const FaceId f : pictures[d]) {
      if (f != kInvalid) shows[d] += shape.bend[at(f)];
    }
  });
  const double most = *std::max_element(shows.begin(), shows.end());
  if (!(most > 0.0)) std::fill(shows.begin(), shows.end(), 1.0);  // flat
  double total = 0.0;
  for (double& s : shows) total += s = std::pow(most > 0.0 ? s / most : 1.0, kSharpness);
  std::vector<double> light(shape.area.size(), 0.0);
  for (std::size_t d = 0; d < pictures.size(); ++d) {
    for (const FaceId f : pictures[d]) {
      if (f != kInvalid) light[at(f)] += shows[d];
    }
  }
  // A face of a ball is in sight from half of all directions, under half its size on the mean.
  const double full = 0.25 * total * unit_of(side) * unit_of(side);
  Eigen::ArrayX2d sums =
      Eigen::ArrayX2d::Zero(positions.rows(), 2);  // light, and what would be full
  for (FaceId f = 0; f < faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k)
      sums.row(faces(f, k)) += Eigen::Array2d(light[at(f)], full * shape.area[at(f)]).transpose();
  }
  for (int round = 0; round < kAveragingRounds; ++round) {
    const Eigen::ArrayX2d own = sums;
    for (FaceId f = 0; f < faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k) sums.row(faces(f, k)) += own.row(faces(f, next_corner(k)));
    }
  }
  std::vector<double> result(at(static_cast<Index>(positions.rows())), 1.0);
  for (std::size_t v = 0; v < result.size(); ++v) {
    const auto sum = sums.row(static_cast<Eigen::Index>(v));
    if (sum[1] > 0.0) result[v] = sum[0] / sum[1];
  }
  return result;
}

}  // namespace flipfree::unwrap
