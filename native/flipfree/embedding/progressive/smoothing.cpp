#include "flipfree/embedding/progressive/smoothing.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "flipfree/base/plane.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

constexpr Size kSmallRing = 64;

// Sum of S (1 + (D0 / D)^2) over a star with its centre at some point, infinite unless every D > 0;
// gradient and Hessian.
struct Quadratic {
  double value = 0.0;
  double gx = 0.0;
  double gy = 0.0;
  double hxx = 0.0;
  double hxy = 0.0;
  double hyy = 0.0;
};

Quadratic expand(const Star& star, const Vector2& p) {
  Quadratic e;
  const Size n = star.ring.size();
  for (Size i = 0; i < n; ++i) {
    const Vector2& q = star.at[i];
    const Vector2& r = star.at[i + 1 == n ? 0 : i + 1];
    const double qx = q.x() - p.x();
    const double qy = q.y() - p.y();
    const double rx = r.x() - p.x();
    const double ry = r.y() - p.y();
    const double d = qx * ry - qy * rx;
    const double ax = q.y() - r.y();  // gradient of d with respect to p
    const double ay = r.x() - q.x();
    if (!(d > 0)) {
      e.value = HUGE_VAL;  // positive only by exact arithmetic
      return e;
    }
    const double s = qx * qx + qy * qy + rx * rx + ry * ry + ax * ax + ay * ay;
    const double sx = -2 * (qx + rx);
    const double sy = -2 * (qy + ry);
    const double ratio = star.target[i] / d;
    const double b = ratio * ratio;
    const double phi = 1 + b;
    const double phi1 = -2 * b / d;
    const double phi2 = 6 * b / (d * d);
    e.value += s * phi;
    const double k = s * phi1;
    e.gx += phi * sx + k * ax;
    e.gy += phi * sy + k * ay;
    const double m = s * phi2;
    e.hxx += 4 * phi + 2 * phi1 * sx * ax + m * ax * ax;
    e.hyy += 4 * phi + 2 * phi1 * sy * ay + m * ay * ay;
    e.hxy += phi1 * (sx * ay + sy * ax) + m * ax * ay;
  }
  return e;
}

// Descent direction: Newton with negative curvature reflected (2 x 2 eigenvalues).
Vector2 newton_direction(const Quadratic& e) {
  const double mean = (e.hxx + e.hyy) / 2;
  const double half = (e.hxx - e.hyy) / 2;
  const double radius = std::sqrt(half * half + e.hxy * e.hxy);
  double large = mean + radius;
  double small = mean - radius;
  if (!(large > 0) || !std::isfinite(large)) return Vector2::Zero();
  small = std::max(std::abs(small), 1e-9 * large);
  // Unit eigenvector of the large eigenvalue.
  double cx = half >= 0 ? half + radius : e.hxy;
  double cy = half >= 0 ? e.hxy : radius - half;
  const double norm = std::sqrt(cx * cx + cy * cy);
  if (norm > 0) {
    cx /= norm;
    cy /= norm;
  } else {
    cx = 1;
    cy = 0;
  }
  const double along = (cx * e.gx + cy * e.gy) / large;
  const double across = (cx * e.gy - cy * e.gx) / small;
  return {-(cx * along - cy * across), -(cy * along + cx * across)};
}

// Largest t with D(p + t d) >= 0 for all triangles.
double step_to_boundary(const Star& star, const Vector2& p, const Vector2& d) {
  double largest = HUGE_VAL;
  const Size n = star.ring.size();
  for (Size i = 0; i < n; ++i) {
    const Vector2& q = star.at[i];
    const Vector2& r = star.at[i + 1 == n ? 0 : i + 1];
    const double area = (q.x() - p.x()) * (r.y() - p.y()) - (q.y() - p.y()) * (r.x() - p.x());
    const double slope = (q.y() - r.y()) * d.x() + (r.x() - q.x()) * d.y();
    if (slope < 0) largest = std::min(largest, area / -slope);
  }
  return largest;
}

double smallest_edge(const Star& star, const Vector2& p) {
  double smallest = HUGE_VAL;
  for (const Vector2& q : star.at) smallest = std::min(smallest, (q - p).squaredNorm());
  return std::sqrt(smallest);
}

// A step that visits n places in an order in which neighbours come late: 1 for small n.
Size far_stride(Size n) {
  if (n <= kSmallRing) return 1;
  Size stride = static_cast<Size>(0.618 * static_cast<double>(n));
  while (std::gcd(stride, n) != 1) ++stride;
  return stride;
}

}  // namespace

void gather_star(const PlanarMap& map, HalfedgeId first, Star& star) {
  star.ring.clear();
  star.at.clear();
  star.target.clear();
  map.mesh.for_each_outgoing(first, [&](HalfedgeId h) {
    star.ring.push_back(map.mesh.target(h));
    star.at.push_back(map.at(star.ring.back()));
    star.target.push_back(2 * map.unit * map.share[at(h / 3)]);
  });
}

bool star_positive(const PlanarMap& map, const Star& star, const Vector2& p) {
  const Size n = star.ring.size();
  for (Size i = 0; i < n; ++i) {
    const Size j = i + 1 == n ? 0 : i + 1;
    if (numeric::orientation(p.data(), star.at[i].data(), star.at[j].data()) <= 0) return false;
    if (map.stored.rows() > 0 &&
        numeric::orientation(p.data(), map.stored.data() + 2 * star.ring[i],
                             map.stored.data() + 2 * star.ring[j]) <= 0) {
      return false;
    }
  }
  return true;
}

namespace {

// One safeguarded Newton step for v, whose star must be positive. Returns how far v went in units
// of its star's smallest edge (0: converged or stuck).
double improve_vertex(PlanarMap& map, VertexId v, Star& star) {
  gather_star(map, map.mesh.outgoing(v), star);
  const Vector2 p = map.at(v);
  const Quadratic e = expand(star, p);
  if (!std::isfinite(e.value)) return centre_in_kernel(map, v, star) ? 1.0 : 0.0;
  Vector2 d = newton_direction(e);
  const double slope = e.gx * d.x() + e.gy * d.y();
  if (!(slope < 0)) return 0.0;
  double t = std::min(1.0, 0.9 * step_to_boundary(star, p, d));
  for (int k = 0; k < 12; ++k, t /= 2) {
    const Vector2 candidate = map.snap(p + t * d);
    if (candidate == p) return 0.0;
    if (expand(star, candidate).value > e.value + 1e-4 * t * slope) continue;
    if (!star_positive(map, star, candidate)) continue;
    map.move(v, candidate);
    return (candidate - p).norm() / smallest_edge(star, p);
  }
  return 0.0;
}

}  // namespace

bool centre_in_kernel(PlanarMap& map, VertexId v, Star& star) {
  gather_star(map, map.mesh.outgoing(v), star);
  if (star.ring.size() > kSmallRing) {
    // Clipping is quadratic; the ring of a hub often is convex, or star-shaped around its mean.
    Vector2 mean = Vector2::Zero();
    for (const Vector2& q : star.at) mean += q;
    const Vector2 candidate = map.snap(mean / static_cast<double>(star.ring.size()));
    if (star_positive(map, star, candidate)) {
      map.move(v, candidate);
      return true;
    }
  }
  // Clip the ring's bounding box by the half-planes of its edges, then take the kernel's centroid.
  Vector2 low = star.at[0];
  Vector2 high = star.at[0];
  for (const Vector2& q : star.at) {
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  std::vector<Vector2> kernel{low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  std::vector<Vector2> next;
  const Size n = star.ring.size();
  // Edges far apart first: they leave few corners, or none, to clip by the others.
  const Size stride = far_stride(n);
  Size i = 0;
  for (Size k = 0; k < n && !kernel.empty(); ++k, i = (i + stride) % n) {
    const Vector2& q = star.at[i];
    const Vector2& r = star.at[i + 1 == n ? 0 : i + 1];
    const auto side = [&](const Vector2& x) {
      return (r.x() - q.x()) * (x.y() - q.y()) - (r.y() - q.y()) * (x.x() - q.x());
    };
    next.clear();
    for (Size c = 0; c < kernel.size(); ++c) {
      const Vector2& a = kernel[c];
      const Vector2& b = kernel[c + 1 == kernel.size() ? 0 : c + 1];
      const double sa = side(a);
      const double sb = side(b);
      if (sa >= 0) next.push_back(a);
      if ((sa >= 0) != (sb >= 0)) next.emplace_back(a + (b - a) * (sa / (sa - sb)));
    }
    kernel.swap(next);
  }
  if (kernel.size() < 3) return false;
  Vector2 mean = Vector2::Zero();
  for (const Vector2& x : kernel) mean += x;
  mean /= static_cast<double>(kernel.size());
  Vector2 centroid = Vector2::Zero();
  double area = 0.0;
  for (Size k = 0; k < kernel.size(); ++k) {
    const Vector2 a = kernel[k] - mean;
    const Vector2 b = kernel[k + 1 == kernel.size() ? 0 : k + 1] - mean;
    const double d = cross(a, b);
    centroid += d * (a + b) / 3;
    area += d;
  }
  if (area > 0) centroid /= area;
  for (const Vector2& x : {Vector2(mean + centroid), mean}) {
    const Vector2 candidate = map.snap(x);
    if (!star_positive(map, star, candidate)) continue;
    map.move(v, candidate);
    return true;
  }
  return false;
}

void smooth_sweeps(PlanarMap& map, const std::vector<VertexId>& vertices, int sweeps,
                   double tolerance, const ExecutionContext& context) {
  constexpr Size kVisitsPerCheck = 1024;
  Star star;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double largest = 0.0;
    for (Size k = 0; k < vertices.size(); ++k) {
      if (k % kVisitsPerCheck == 0) context.check();
      largest = std::max(largest, improve_vertex(map, vertices[k], star));
    }
    if (largest <= tolerance) break;
  }
}

void SmoothingQueue::push_star(const PlanarMap& map, VertexId v) {
  if (map.mesh.degree(v) > kMaxQueuedDegree) return;
  push(map, v);
  map.mesh.for_each_outgoing(map.mesh.outgoing(v),
                             [&](HalfedgeId h) { push(map, map.mesh.target(h)); });
}

void SmoothingQueue::run(PlanarMap& map, std::size_t steps, double tolerance) {
  Size head = 0;
  for (; head < queue_.size() && head < steps; ++head) {
    const VertexId v = queue_[head];
    queued_[static_cast<Size>(v)] = 0;
    if (improve_vertex(map, v, star_) > tolerance) {
      // improve_vertex left the ring in star_.
      for (const VertexId w : star_.ring) push(map, w);
      push(map, v);
    }
  }
  for (; head < queue_.size(); ++head) queued_[static_cast<Size>(queue_[head])] = 0;
  queue_.clear();
}

}  // namespace flipfree::embedding
