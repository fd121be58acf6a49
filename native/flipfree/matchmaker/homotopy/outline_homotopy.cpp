#include "flipfree/matchmaker/homotopy/outline_homotopy.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>

#include "flipfree/base/plane.h"
#include "flipfree/embedding/disk/disk.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// The point left of a -> b at the given distances from both.
Vector2 apex_of(const Vector2& a, const Vector2& b, double from_a, double from_b) {
  const double base = (b - a).norm();
  const double along = 0.5 * (base + (from_a - from_b) * (from_a + from_b) / base);
  const Vector2 u = (b - a) / base;
  return a + along * u +
         (0.5 * quadruple_area(base, from_a, from_b) / base) * Vector2(-u.y(), u.x());
}

// The last face left when leaves are peeled off the tree of faces round by round.
FaceId centre_of_tree(const Mesh& mesh) {
  const auto count = static_cast<std::size_t>(mesh.face_slots());
  std::vector<int> degree(count, 0);
  std::vector<char> gone(count, 0);
  std::deque<FaceId> leaves;
  FaceId last = 0;
  for (FaceId f = 0; f < mesh.face_slots(); ++f) {
    if (!mesh.alive(f)) continue;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) degree[at(f)] += mesh.is_boundary(h) ? 0 : 1;
    if (degree[at(f)] <= 1) leaves.push_back(f);
  }
  while (!leaves.empty()) {
    const FaceId f = leaves.front();
    leaves.pop_front();
    if (gone[at(f)] != 0) continue;
    gone[at(f)] = 1;
    last = f;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (mesh.is_boundary(h)) continue;
      const FaceId g = mesh.opposite(h) / 3;
      if (gone[at(g)] == 0 && --degree[at(g)] <= 1) leaves.push_back(g);
    }
  }
  return last;
}

}  // namespace

OutlineHomotopy::OutlineHomotopy(TargetDomain domain, const std::vector<SheetPin>& pins)
    : domain_(std::move(domain)), pins_(pins), circle_(domain_.point.size(), Vector2::Zero()) {
  const Mesh& mesh = domain_.triangulation;
  const std::size_t n = domain_.outline.size();
  const auto point = [&](Index v) -> const Vector2& { return domain_.point[at(v)]; };
  std::vector<double> lengths;
  double perimeter = 0;
  for (std::size_t i = 0; i < n; ++i) {
    lengths.push_back((point(domain_.outline[(i + 1) % n]) - point(domain_.outline[i])).norm());
    perimeter += lengths.back();
  }
  root_ = centre_of_tree(mesh);
  std::vector<char> seen(static_cast<std::size_t>(mesh.face_slots()), 0);
  seen[at(root_)] = 1;
  std::deque<FaceId> queue = {root_};
  while (!queue.empty()) {
    const FaceId f = queue.front();
    queue.pop_front();
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (mesh.is_boundary(h)) continue;
      const HalfedgeId o = mesh.opposite(h);
      if (seen[at(o / 3)]++ != 0) continue;
      glue_.push_back(o);
      queue.push_back(o / 3);
    }
  }
  // The circle is turned and moved to where the root lies in the target: frames drift little.
  const Points2 circle =
      embedding::place_boundary(embedding::BoundaryShape::kCircle, lengths).positions;
  double around = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const auto next = static_cast<Eigen::Index>((i + 1) % n);
    around += (circle.row(next) - circle.row(row)).norm();
    circle_[at(domain_.outline[i])] = circle.row(row).transpose();
  }
  const Index a = mesh.source(3 * root_);
  const Index b = mesh.target(3 * root_);
  const Vector2 from = circle_[at(b)] - circle_[at(a)];
  const Vector2 to = point(b) - point(a);
  const double scale = perimeter / around;
  const double size = from.norm() * to.norm();
  const double c = scale * from.dot(to) / size;
  const double s = scale * cross(from, to) / size;
  const Vector2 middle = 0.5 * (circle_[at(a)] + circle_[at(b)]);
  const Vector2 there = 0.5 * (point(a) + point(b));
  for (const Index v : domain_.outline) {
    Vector2& p = circle_[at(v)];
    const Vector2 q = p - middle;
    p = there + Vector2(c * q.x() - s * q.y(), s * q.x() + c * q.y());
  }
  for (const SheetPin& p : pins_) {
    const Mesh::Triangle t = mesh.corners(p.face);
    const Vector2 e = point(t[1]) - point(t[0]);
    const Vector2 f = point(t[2]) - point(t[0]);
    const Vector2 d = p.pin.uv - point(t[0]);
    const double area = cross(e, f);
    const double w1 = std::clamp(cross(d, f) / area, 0.0, 1.0);
    const double w2 = std::clamp(cross(e, d) / area, 0.0, 1.0 - w1);
    weight_.push_back({1.0 - w1 - w2, w1, w2});
  }
}

double OutlineHomotopy::length(HalfedgeId h, double t) const {
  const auto a = static_cast<std::size_t>(domain_.triangulation.source(h));
  const auto b = static_cast<std::size_t>(domain_.triangulation.target(h));
  return (1 - t) * (circle_[b] - circle_[a]).norm() +
         t * (domain_.point[b] - domain_.point[a]).norm();
}

std::vector<Vector2> OutlineHomotopy::corners(double t) const {
  if (t >= 1) return domain_.point;
  if (t <= 0) return circle_;
  const Mesh& mesh = domain_.triangulation;
  std::vector<Vector2> p(domain_.point.size(), Vector2::Zero());
  const auto at = [&](Index v) -> Vector2& { return p[static_cast<std::size_t>(v)]; };
  const auto set_apex = [&](HalfedgeId h) {
    at(mesh.apex(h)) = apex_of(at(mesh.source(h)), at(mesh.target(h)),
                               length(previous_corner(h), t), length(next_corner(h), t));
  };
  const HalfedgeId h = 3 * root_;
  const Vector2& a = domain_.point[static_cast<std::size_t>(mesh.source(h))];
  const Vector2& b = domain_.point[static_cast<std::size_t>(mesh.target(h))];
  const Vector2 half = 0.5 * length(h, t) * (b - a).normalized();
  at(mesh.source(h)) = 0.5 * (a + b) - half;
  at(mesh.target(h)) = 0.5 * (a + b) + half;
  set_apex(h);
  for (const HalfedgeId g : glue_) set_apex(g);
  return p;
}

std::vector<std::pair<VertexId, Vector2>> OutlineHomotopy::places(
    double t, const std::vector<Vector2>& corners) const {
  std::vector<std::pair<VertexId, Vector2>> result;
  result.reserve(domain_.outline.size() + pins_.size());
  for (const Index v : domain_.outline) {
    result.emplace_back(domain_.mesh_vertex[static_cast<std::size_t>(v)], corners[at(v)]);
  }
  for (std::size_t i = 0; i < pins_.size(); ++i) {
    const Mesh::Triangle c = domain_.triangulation.corners(pins_[i].face);
    Vector2 p = Vector2::Zero();
    for (std::size_t k = 0; k < 3; ++k) p += weight_[i][k] * corners[at(c[k])];
    result.emplace_back(pins_[i].pin.vertex, t >= 1 ? pins_[i].pin.uv : p);
  }
  return result;
}

}  // namespace flipfree::matchmaker
