#include "flipfree/mesh/decimated/decimated.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/refined/editable_triangulation.h"

namespace flipfree::mesh {
namespace {

// Stars with more corners are left alone.
constexpr std::size_t kMostCorners = 20;
// Triangles that come are at least of this shape in the plane of the star (1: equilateral, 0:
// flat), and turn away from the star by less than a right angle.
constexpr double kLeastShape = 0.06;
// How much evenness weighs beside shape: a share of the squared area of the star.
constexpr double kEvenness = 1e-3;
// Of the vertices, the share with the least costs that may go in one round; rounds that remove a
// smaller share are the last ones.
constexpr double kRound = 0.4;
constexpr double kWorthwhile = 0.01;
// How many neighbours are tried as the one to go into, the cheapest first.
constexpr std::size_t kTried = 3;
constexpr std::size_t kGrain = 4096;

// Sum of squared distances from planes, weighted by areas.
struct Quadric {
  std::array<double, 10> a{};

  void add(const Vector3& n, double d, double weight) {
    const std::array<double, 4> p = {n.x(), n.y(), n.z(), d};
    std::size_t k = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = i; j < 4; ++j) a[k++] += weight * p[i] * p[j];
    }
  }
  void add(const Quadric& other) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] += other.a[i];
  }
  double at_point(const Vector3& p) const {
    const double x = p.x();
    const double y = p.y();
    const double z = p.z();
    return x * (a[0] * x + 2.0 * (a[1] * y + a[2] * z + a[3])) +
           y * (a[4] * y + 2.0 * (a[5] * z + a[6])) + z * (a[7] * z + 2.0 * a[8]) + a[9];
  }
};

double shape(const Vector2& a, const Vector2& b, const Vector2& c) {
  const Vector2 e = b - a;
  const Vector2 f = c - a;
  const double squares = e.squaredNorm() + f.squaredNorm() + (f - e).squaredNorm();
  return squares > 0.0 ? 2.0 * std::sqrt(3.0) * cross(e, f) / squares : 0.0;
}

class Decimator {
 public:
  Decimator(const Surface& surface, const std::vector<VertexId>& held)
      : surface_(surface),
        mesh_(static_cast<Index>(surface.vertices.rows()), surface.faces),
        faces_(static_cast<Index>(surface.faces.rows())),
        quadric_(at(mesh_.vertex_count())),
        choices_(at(mesh_.vertex_count())),
        held_(at(mesh_.vertex_count()), 0) {
    for (const VertexId v : held) held_[at(v)] = 1;
    for (HalfedgeId h = 0; h < mesh_.halfedge_slots(); ++h) {
      const Vector3 p = place(mesh_.source(h));
      const Vector3 along = place(mesh_.target(h)) - p;
      const Vector3 doubled = along.cross(place(mesh_.apex(h)) - p);
      const double size = doubled.norm();
      if (!(size > 0.0)) continue;
      const Vector3 n = doubled / size;
      quadric_[at(mesh_.source(h))].add(n, -n.dot(p), 0.5 * size);
      if (!mesh_.is_boundary(h)) continue;
      // The line of the boundary stays: a plane through it, upright on the face.
      const Vector3 side = n.cross(along).normalized();
      const double weight = along.squaredNorm();
      quadric_[at(mesh_.source(h))].add(side, -side.dot(p), weight);
      quadric_[at(mesh_.target(h))].add(side, -side.dot(p), weight);
    }
  }

  void run(Index target, ExecutionContext& context) {
    std::vector<VertexId> left;
    for (VertexId v = 0; v < mesh_.vertex_count(); ++v) {
      if (mesh_.outgoing(v) != kInvalid) left.push_back(v);
    }
    while (faces_ > target) {
      choose(left, context);
      std::vector<std::pair<double, VertexId>> order;
      order.reserve(left.size());
      for (const VertexId v : left) {
        if (choices_[at(v)].count > 0 && held_[at(v)] == 0)
          order.emplace_back(choices_[at(v)].cost, v);
      }
      const auto most = std::min(
          order.size(), static_cast<std::size_t>(kRound * static_cast<double>(left.size())) + 1);
      std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(most),
                       order.end());
      order.resize(most);
      std::sort(order.begin(), order.end());
      std::vector<char> blocked(quadric_.size(), 0);
      std::size_t removed = 0;
      for (std::size_t i = 0; i < order.size() && faces_ > target; ++i) {
        if (i % 1024 == 0) context.check();
        const VertexId v = order[i].second;
        if (blocked[at(v)] != 0 || !remove(v)) continue;
        for (const VertexId w : ring_) blocked[at(w)] = 1;
        ++removed;
      }
      if (static_cast<double>(removed) < kWorthwhile * static_cast<double>(left.size())) break;
      std::erase_if(left, [&](VertexId v) { return mesh_.outgoing(v) == kInvalid; });
    }
  }

  Decimated result() {
    Decimated few;
    few.gone = std::move(gone_);
    few.rings = std::move(rings_);
    few.into.assign(quadric_.size(), kInvalid);
    for (VertexId v = 0; v < mesh_.vertex_count(); ++v) {
      if (mesh_.outgoing(v) == kInvalid) continue;
      few.into[at(v)] = static_cast<VertexId>(few.origin.size());
      few.origin.push_back(v);
    }
    for (std::size_t i = few.gone.size(); i-- > 0;) {
      const Decimated::Gone& g = few.gone[i];
      few.into[at(g.vertex)] = few.into[at(few.rings[g.ring + at(g.into)])];
    }
    few.surface.vertices.resize(static_cast<Eigen::Index>(few.origin.size()), 3);
    for (std::size_t i = 0; i < few.origin.size(); ++i)
      few.surface.vertices.row(static_cast<Eigen::Index>(i)) = place(few.origin[i]).transpose();
    few.surface.faces = mesh_.faces();
    for (Eigen::Index i = 0; i < few.surface.faces.size(); ++i) {
      VertexId& v = few.surface.faces.data()[i];
      v = few.into[at(v)];
    }
    return few;
  }

 private:
  // Where a vertex may go, the cheapest first.
  struct Choice {
    double cost = 0.0;
    std::array<VertexId, kTried> into{};
    Index count = 0;
  };

  Vector3 place(VertexId v) const { return surface_.vertices.row(v).transpose(); }

  void choose(const std::vector<VertexId>& left, const ExecutionContext& context) {
    parallel_for(context, left.size(), kGrain,
                 [&](std::size_t begin, std::size_t end, std::size_t) {
                   context.check();
                   for (std::size_t i = begin; i < end; ++i)
                     choices_[at(left[i])] = choice(left[i]);
                 });
  }

  Choice choice(VertexId v) const {
    Choice best;
    std::array<double, kTried> costs{};
    const Vector3 p = place(v);
    double area = 0.0;
    const auto offer = [&](VertexId w) {
      const Vector3 q = place(w);
      double cost = quadric_[at(v)].at_point(q) + quadric_[at(w)].at_point(q);
      // Long ways cost more: where all is flat, vertices go to the nearest one.
      cost = std::max(cost, 0.0) + 1e-2 * kEvenness * (q - p).squaredNorm() * (q - p).squaredNorm();
      std::size_t i = at(best.count);
      if (i == kTried && cost >= costs[kTried - 1]) return;
      if (i < kTried) {
        ++best.count;
      } else {
        --i;
      }
      for (; i > 0 && cost < costs[i - 1]; --i) {
        costs[i] = costs[i - 1];
        best.into[i] = best.into[i - 1];
      }
      costs[i] = cost;
      best.into[i] = w;
    };
    const HalfedgeId first = mesh_.outgoing(v);
    const bool boundary = mesh_.is_boundary(first);
    HalfedgeId last = first;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      area += (place(mesh_.target(h)) - p).cross(place(mesh_.apex(h)) - p).norm();
      // Not from inside to the boundary: the angle there may be too large to come back from.
      if (!boundary && !mesh_.is_boundary_vertex(mesh_.target(h))) offer(mesh_.target(h));
      last = h;
    });
    if (boundary) {
      offer(mesh_.target(first));
      offer(mesh_.apex(last));
    }
    best.cost = costs[0] + kEvenness * area * area;
    return best;
  }

  // False if the vertex cannot go; else ring_ are its neighbours.
  bool remove(VertexId v) {
    const HalfedgeId first = mesh_.outgoing(v);
    const bool boundary = mesh_.is_boundary(first);
    ring_.clear();
    star_.clear();
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      ring_.push_back(mesh_.target(h));
      star_.push_back(h / 3);
    });
    if (boundary) ring_.push_back(mesh_.apex(3 * star_.back() + first_corner(star_.back(), v)));
    if (ring_.size() < 3 || ring_.size() > kMostCorners) return false;
    // The only face of a neighbour would lie on the line that the vertex comes back to.
    if (boundary && (is_ear(ring_.front()) || is_ear(ring_.back()))) return false;
    flatten(v, boundary);
    const Choice& choice = choices_[at(v)];
    for (Index i = 0; i < choice.count; ++i) {
      const auto found = std::find(ring_.begin(), ring_.end(), choice.into[at(i)]);
      if (found != ring_.end() &&
          go_into(v, static_cast<std::size_t>(found - ring_.begin()), boundary))
        return true;
    }
    return false;
  }

  bool is_ear(VertexId v) const {
    const HalfedgeId h = mesh_.outgoing(v);
    return mesh_.is_boundary(h) && mesh_.rotate_ccw(h) == kInvalid;
  }

  Index first_corner(FaceId f, VertexId v) const {
    Index k = 0;
    while (mesh_.source(3 * f + k) != v) ++k;
    return k;
  }

  // The ring around v in the plane, v at the origin: lengths as they are, angles scaled to sum up.
  void flatten(VertexId v, bool boundary) {
    const Vector3 p = place(v);
    const std::size_t n = ring_.size();
    const std::size_t steps = boundary ? n - 1 : n;
    std::array<double, kMostCorners + 1> angle{};
    normal_ = Vector3::Zero();
    for (std::size_t i = 0; i < steps; ++i) {
      const Vector3 a = place(ring_[i]) - p;
      const Vector3 b = place(ring_[(i + 1) % n]) - p;
      const Vector3 normal = a.cross(b);
      normal_ += normal;
      angle[i + 1] = angle[i] + std::atan2(normal.norm(), a.dot(b));
    }
    const double whole = (boundary ? 1.0 : 2.0) * std::numbers::pi;
    const double scale = angle[steps] > 0.0 ? whole / angle[steps] : 0.0;
    flat_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double length = (place(ring_[i]) - p).norm();
      const double turn = scale * angle[i];
      flat_[i] = {length * std::cos(turn), length * std::sin(turn)};
    }
    if (boundary) flat_[n - 1] = {-(place(ring_[n - 1]) - p).norm(), 0.0};
  }

  bool go_into(VertexId v, std::size_t j, bool boundary) {
    const std::size_t n = ring_.size();
    const VertexId w = ring_[j];
    if (boundary && j != 0 && j != n - 1) return false;
    const auto beside = [&](std::size_t i) {
      return i == j || i == (j + 1) % n || (i + 1) % n == j;
    };
    triangles_.clear();
    const Vector3 q = place(w);
    std::size_t holder = n;
    double deepest = -1.0;
    std::array<double, 3> share{};
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t k = (i + 1) % n;
      if (i == j || k == j || (boundary && k == 0)) continue;
      const Vector2& b = flat_[i];
      const Vector2& c = flat_[k];
      if (!(shape(flat_[j], b, c) >= kLeastShape)) return false;
      const Vector3 normal = (place(ring_[i]) - q).cross(place(ring_[k]) - q);
      if (!(normal.dot(normal_) > 0.0)) return false;
      const double area = cross(Vector2(b - flat_[j]), Vector2(c - flat_[j]));
      const std::array<double, 3> weights = {cross(b, c) / area, cross(c, flat_[j]) / area,
                                             cross(flat_[j], b) / area};
      const double depth = std::min({weights[0], weights[1], weights[2]});
      if (holder == n || depth > deepest) {
        holder = i;
        deepest = depth;
        share = weights;
      }
      triangles_.push_back({w, ring_[i], ring_[k]});
    }
    // Edges that come must not be there already, nor the boundary close up. In an open ring the
    // ends are no neighbours.
    for (std::size_t i = 0; i < n; ++i) {
      const bool joined = boundary ? i == j || i == j + 1 || i + 1 == j : beside(i);
      if (!joined && mesh_.find(w, ring_[i]) != kInvalid) return false;
    }
    // Of a tetrahedron nothing would be left.
    if (!boundary && n == 3 && triangles_.size() == 1) {
      const HalfedgeId o = mesh_.opposite(mesh_.find(triangles_[0][1], triangles_[0][2]));
      const HalfedgeId own = o == kInvalid ? kInvalid : mesh_.opposite(o);
      if ((o != kInvalid && mesh_.apex(o) == w) || (own != kInvalid && mesh_.apex(own) == w))
        return false;
    }
    gone_.push_back({v,
                     rings_.size(),
                     static_cast<Index>(j),
                     static_cast<Index>(holder),
                     {share[0], share[1], share[2]},
                     boundary});
    rings_.insert(rings_.end(), ring_.begin(), ring_.end());
    const std::vector<FaceId> parents(triangles_.size(), kInvalid);
    mesh_.replace(star_, triangles_, parents);
    quadric_[at(w)].add(quadric_[at(v)]);
    faces_ -= static_cast<Index>(star_.size() - triangles_.size());
    return true;
  }

  const Surface& surface_;
  EditableTriangulation mesh_;
  Index faces_;
  std::vector<Quadric> quadric_;
  std::vector<Choice> choices_;
  std::vector<char> held_;
  std::vector<Decimated::Gone> gone_;
  std::vector<VertexId> rings_;
  // Of the vertex that is about to go.
  std::vector<VertexId> ring_;
  std::vector<FaceId> star_;
  std::vector<Vector2> flat_;
  Vector3 normal_;
  std::vector<EditableTriangulation::Triangle> triangles_;
};

}  // namespace

Decimated decimate(const Surface& surface, Index faces, ExecutionContext& context,
                   const std::vector<VertexId>& held) {
  Decimator decimator(surface, held);
  decimator.run(faces, context);
  return decimator.result();
}

}  // namespace flipfree::mesh
