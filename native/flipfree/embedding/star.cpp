#include "flipfree/embedding/star.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>

#include "flipfree/base/error.h"

namespace flipfree::embedding {

namespace {

using Size = std::size_t;

constexpr Size kSmallRing = 64;

// Sum of S (1 + (D0 / D)^2) over a star with its centre at some point, infinite unless every D > 0;
// gradient and Hessian.
struct Quadratic {
  double value = 0.0;
  Vector2 gradient = Vector2::Zero();
  double hxx = 0.0;
  double hxy = 0.0;
  double hyy = 0.0;
};

Quadratic expand(const Star& star, const Vector2& p) {
  Quadratic e;
  for (Size i = 0; i < star.size(); ++i) {
    const Vector2 q = star.at[i] - p;
    const Vector2 r = star.at[star.next(i)] - p;
    const double d = cross(q, r);
    // Gradient of d with respect to p.
    const Vector2 a(star.at[i].y() - star.at[star.next(i)].y(),
                    star.at[star.next(i)].x() - star.at[i].x());
    if (!(d > 0)) {
      e.value = HUGE_VAL;  // positive only by exact arithmetic
      return e;
    }
    const double s = q.x() * q.x() + q.y() * q.y() + r.x() * r.x() + r.y() * r.y() + a.x() * a.x() +
                     a.y() * a.y();
    const Vector2 s1 = -2 * (q + r);
    const double ratio = star.target[i] / d;
    const double b = ratio * ratio;
    const double phi = 1 + b;
    const double phi1 = -2 * b / d;
    const double phi2 = 6 * b / (d * d);
    e.value += s * phi;
    const double k = s * phi1;
    e.gradient += phi * s1 + k * a;
    const double m = s * phi2;
    e.hxx += 4 * phi + 2 * phi1 * s1.x() * a.x() + m * a.x() * a.x();
    e.hyy += 4 * phi + 2 * phi1 * s1.y() * a.y() + m * a.y() * a.y();
    e.hxy += phi1 * (s1.x() * a.y() + s1.y() * a.x()) + m * a.x() * a.y();
  }
  return e;
}

// Descent direction: Newton with negative curvature reflected (2 x 2 eigenvalues).
Vector2 newton_direction(const Quadratic& e) {
  const double mean = (e.hxx + e.hyy) / 2;
  const double half = (e.hxx - e.hyy) / 2;
  const double radius = std::sqrt(half * half + e.hxy * e.hxy);
  const double large = mean + radius;
  if (!(large > 0) || !std::isfinite(large)) return Vector2::Zero();
  const double small = std::max(std::abs(mean - radius), 1e-9 * large);
  // Unit eigenvector of the large eigenvalue.
  Vector2 c(half >= 0 ? half + radius : e.hxy, half >= 0 ? e.hxy : radius - half);
  const double norm = std::sqrt(c.x() * c.x() + c.y() * c.y());
  c = norm > 0 ? Vector2(c / norm) : Vector2(1, 0);
  const double along = (c.x() * e.gradient.x() + c.y() * e.gradient.y()) / large;
  const double across = cross(c, e.gradient) / small;
  return {-(c.x() * along - c.y() * across), -(c.y() * along + c.x() * across)};
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

double step_to_boundary(const Star& star, const Vector2& p, const Vector2& d) {
  double largest = HUGE_VAL;
  for (Size i = 0; i < star.size(); ++i) {
    const Vector2& q = star.at[i];
    const Vector2& r = star.at[star.next(i)];
    const double area = cross(q - p, r - p);
    const double slope = (q.y() - r.y()) * d.x() + (r.x() - q.x()) * d.y();
    if (slope < 0 && area > 0) largest = std::min(largest, area / -slope);
  }
  return largest;
}

bool star_positive(const PlanarMap& map, const Star& star, const Vector2& p) {
  for (Size i = 0; i < star.size(); ++i) {
    const Size j = star.next(i);
    if (numeric::orientation(p, star.at[i], star.at[j]) <= 0) return false;
    if (map.stored.rows() > 0 &&
        numeric::orientation(p.data(), map.stored.data() + 2 * star.ring[i],
                             map.stored.data() + 2 * star.ring[j]) <= 0)
      return false;
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
  const Vector2 d = newton_direction(e);
  const double slope = e.gradient.x() * d.x() + e.gradient.y() * d.y();
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

Vector2 sum_of(const std::vector<Vector2>& points) {
  Vector2 sum = Vector2::Zero();
  for (const Vector2& p : points) sum += p;
  return sum;
}

// The ring's bounding box, clipped by the half-planes of its edges.
std::vector<Vector2> kernel_of(const Star& star) {
  Eigen::AlignedBox2d box;
  for (const Vector2& q : star.at) box.extend(q);
  const Vector2 low = box.min(), high = box.max();
  std::vector<Vector2> kernel{low, {high.x(), low.y()}, high, {low.x(), high.y()}};
  std::vector<Vector2> next;
  // Edges far apart first: they leave few corners, or none, to clip by the others.
  const Size stride = far_stride(star.size());
  Size i = 0;
  for (Size k = 0; k < star.size() && !kernel.empty(); ++k, i = (i + stride) % star.size()) {
    const Vector2& q = star.at[i];
    const Vector2& r = star.at[star.next(i)];
    next.clear();
    for (Size c = 0; c < kernel.size(); ++c) {
      const Vector2& a = kernel[c];
      const Vector2& b = kernel[(c + 1) % kernel.size()];
      const double sa = twice_area(q, r, a);
      const double sb = twice_area(q, r, b);
      if (sa >= 0) next.push_back(a);
      if ((sa >= 0) != (sb >= 0)) next.emplace_back(a + (b - a) * (sa / (sa - sb)));
    }
    kernel.swap(next);
  }
  return kernel;
}

}  // namespace

bool centre_in_kernel(PlanarMap& map, VertexId v, Star& star) {
  gather_star(map, map.mesh.outgoing(v), star);
  const auto try_place = [&](const Vector2& place) {
    const Vector2 candidate = map.snap(place);
    if (!star_positive(map, star, candidate)) return false;
    map.move(v, candidate);
    return true;
  };
  // Clipping is quadratic; the ring of a hub often is convex, or star-shaped around its mean.
  if (star.size() > kSmallRing && try_place(sum_of(star.at) / static_cast<double>(star.size())))
    return true;
  const std::vector<Vector2> kernel = kernel_of(star);
  if (kernel.size() < 3) return false;
  const Vector2 mean = sum_of(kernel) / static_cast<double>(kernel.size());
  Vector2 centroid = Vector2::Zero();
  double area = 0.0;
  for (Size k = 0; k < kernel.size(); ++k) {
    const Vector2 a = kernel[k] - mean;
    const Vector2 b = kernel[(k + 1) % kernel.size()] - mean;
    const double d = cross(a, b);
    centroid += d * (a + b) / 3;
    area += d;
  }
  if (area > 0) centroid /= area;
  return try_place(mean + centroid) || try_place(mean);
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
    queued_[at(v)] = 0;
    if (improve_vertex(map, v, star_) > tolerance) {
      // improve_vertex left the ring in star_.
      for (const VertexId w : star_.ring) push(map, w);
      push(map, v);
    }
  }
  for (; head < queue_.size(); ++head) queued_[at(queue_[head])] = 0;
  queue_.clear();
}

namespace {

// Floating-point numbers in order: consecutive numbers have consecutive ordinals; both zeros have
// ordinal 0.
std::int64_t to_ordinal(double value, bool float32) {
  if (float32) {
    const auto bits = std::bit_cast<std::int32_t>(static_cast<float>(value));
    return bits >= 0 ? bits : -static_cast<std::int64_t>(bits & 0x7fffffff);
  }
  const auto bits = std::bit_cast<std::int64_t>(value);
  return bits >= 0 ? bits : -(bits & 0x7fffffffffffffff);
}

double from_ordinal(std::int64_t ordinal, bool float32) {
  const bool negative = ordinal < 0;
  const std::int64_t magnitude = negative ? -ordinal : ordinal;
  const double value = float32 ? std::bit_cast<float>(static_cast<std::int32_t>(magnitude))
                               : std::bit_cast<double>(magnitude);
  return negative ? -value : value;
}

struct Interval {
  std::int64_t low = 0;
  std::int64_t high = -1;
  bool empty() const { return low > high; }
};

// From the least to the largest double there are more numbers than a signed one counts.
std::uint64_t count(const Interval& range) {
  return static_cast<std::uint64_t>(range.high) - static_cast<std::uint64_t>(range.low) + 1;
}
std::int64_t beyond(std::int64_t low, std::uint64_t steps) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + steps);
}

// What is left of a range that begins or ends with positive numbers, and has all of them there.
template <typename Positive>
Interval positive_part(Interval range, bool at_end, const Positive& positive) {
  std::int64_t good = at_end ? range.high : range.low;
  std::int64_t bad = at_end ? range.low - 1 : range.high + 1;
  if (!positive(good)) return {};
  for (std::int64_t middle; (middle = std::midpoint(good, bad)) != good;)
    (positive(middle) ? good : bad) = middle;
  (at_end ? range.low : range.high) = good;
  return range;
}

}  // namespace

Room find_room(const PlanarMap& map, const Star& star, std::uint64_t budget) {
  Eigen::AlignedBox2d box;
  for (const Vector2& q : star.at) box.extend(q);
  // Grid values within the box; its ends themselves cannot be strictly inside.
  const auto within = [&](Index axis) -> Interval {
    return {to_ordinal(box.min()[axis], map.float32), to_ordinal(box.max()[axis], map.float32)};
  };
  const Index across = count(within(0)) < count(within(1)) ? 0 : 1;  // the axis that rows share
  const auto point = [&](double row, std::int64_t ordinal) {
    Vector2 p;
    p[across] = row;
    p[1 - across] = from_ordinal(ordinal, map.float32);
    return p;
  };
  // Values along the row on the positive side of all edges: orientation is linear along the row, so
  // each edge keeps a half-line, the end or the beginning as its derivative has it.
  const auto admissible = [&](double row) {
    Interval inside = within(1 - across);
    const auto keep = [&](const Vector2& q, const Vector2& r) {
      const double slope = across == 1 ? q.y() - r.y() : r.x() - q.x();
      if (inside.empty()) return;
      inside = positive_part(inside, slope > 0.0, [&](std::int64_t ordinal) {
        return numeric::orientation(point(row, ordinal), q, r) > 0;
      });
    };
    for (Size i = 0; i < star.size() && !inside.empty(); ++i) {
      const Size j = star.next(i);
      keep(star.at[i], star.at[j]);
      if (map.stored.rows() > 0) keep(map.stored.row(star.ring[i]), map.stored.row(star.ring[j]));
    }
    return inside;
  };
  const Interval rows = within(across);
  const std::uint64_t total = count(rows);
  const std::uint64_t most = std::max<std::uint64_t>(64, budget / star.ring.size());
  Room room;
  room.exact = total <= most;
  const std::uint64_t looked = std::min(total, most);
  std::uint64_t widest = 0;
  for (std::uint64_t k = 0; k < looked; ++k) {
    const auto offset = room.exact ? static_cast<double>(k)
                                   : static_cast<double>(total) * (static_cast<double>(k) + 0.5) /
                                         static_cast<double>(looked);
    const double row =
        from_ordinal(beyond(rows.low, static_cast<std::uint64_t>(offset)), map.float32);
    const Interval inside = admissible(row);
    if (inside.empty()) continue;
    const std::uint64_t width = count(inside);
    const auto limit = std::numeric_limits<std::uint64_t>::max() / 2;
    room.points = std::min(limit, room.points + std::min(limit, width));
    if (width > widest) {
      widest = width;
      room.middle = point(row, beyond(inside.low, width / 2));
    }
  }
  return room;
}

std::string narrowest_extent(const Star& star) {
  const Size n = star.ring.size();
  const Size stride = n / 1000 + 1;
  double narrowest = HUGE_VAL;
  std::string text;
  for (Size i = 0; i < n; i += stride) {
    const Size j = star.next(i);
    const Vector2 edge = star.at[j] - star.at[i];
    std::pair<double, Size> far(0.0, i);  // distance and place
    for (Size k = 0; k < n; ++k) {
      const double distance = std::abs(cross(edge, star.at[k] - star.at[i])) / edge.norm();
      if (distance > far.first) far = {distance, k};
    }
    if (far.first >= narrowest || !(far.first > 0.0)) continue;
    narrowest = far.first;
    text = "between the edge (" + vertex_id(star.ring[i]) + ", " + vertex_id(star.ring[j]) +
           ") and vertex " + vertex_id(star.ring[far.second]);
  }
  return text.empty() ? "between vertices that lie on one line" : text;
}

}  // namespace flipfree::embedding
