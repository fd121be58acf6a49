#include "flipfree/mesh/decimated/decimated.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/refined/editable_triangulation.h"
#include "flipfree/numeric/predicates.h"

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
constexpr std::size_t kGrain = 4096;

// Sum of squared distances from planes (n, d), weighted by areas: p -> (p, 1) Q (p, 1)^T.
using Quadric = Eigen::Matrix4d;

void add_plane(Quadric& quadric, const Vector3& n, double d, double weight) {
  const Eigen::Vector4d plane(n.x(), n.y(), n.z(), d);
  quadric += weight * plane * plane.transpose();
}

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
        quadric_(at(mesh_.vertex_count()), Quadric::Zero()),
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
      add_plane(quadric_[at(mesh_.source(h))], n, -n.dot(p), 0.5 * size);
      if (!mesh_.is_boundary(h)) continue;
      // The line of the boundary stays: a plane through it, upright on the face.
      const Vector3 side = n.cross(along).normalized();
      const double weight = along.squaredNorm();
      for (const VertexId v : {mesh_.source(h), mesh_.target(h)})
        add_plane(quadric_[at(v)], side, -side.dot(p), weight);
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
        if (choices_[at(v)].into != kInvalid && held_[at(v)] == 0)
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
    few.surface.vertices = surface_.vertices(few.origin, Eigen::all);
    Triangles faces = mesh_.faces();
    for (VertexId& v : faces.reshaped()) v = few.into[at(v)];
    few.surface.faces = std::move(faces);
    return few;
  }

 private:
  // The neighbour that a vertex goes into at the least cost, if it may go at all.
  struct Choice {
    double cost = std::numeric_limits<double>::infinity();
    VertexId into = kInvalid;
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
    const Vector3 p = place(v);
    double area = 0.0;
    const auto offer = [&](VertexId w) {
      const Vector3 q = place(w);
      const Eigen::Vector4d place(q.x(), q.y(), q.z(), 1.0);
      double cost = place.dot((quadric_[at(v)] + quadric_[at(w)]) * place);
      // Long ways cost more: where all is flat, vertices go to the nearest one.
      cost = std::max(cost, 0.0) + 1e-2 * kEvenness * (q - p).squaredNorm() * (q - p).squaredNorm();
      if (cost < best.cost) best = {cost, w};
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
    best.cost += kEvenness * area * area;
    return best;
  }

  // False if the vertex cannot go; else ring_ are its neighbours.
  bool remove(VertexId v) {
    const HalfedgeId first = mesh_.outgoing(v);
    const bool boundary = mesh_.is_boundary(first);
    ring_.clear();
    star_.clear();
    HalfedgeId last = first;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      ring_.push_back(mesh_.target(h));
      star_.push_back(h / 3);
      last = h;
    });
    if (boundary) ring_.push_back(mesh_.apex(last));
    if (ring_.size() < 3 || ring_.size() > kMostCorners) return false;
    // The only face of a neighbour would lie on the line that the vertex comes back to.
    if (boundary && (is_ear(ring_.front()) || is_ear(ring_.back()))) return false;
    flatten(v, boundary);
    const auto found = std::find(ring_.begin(), ring_.end(), choices_[at(v)].into);
    return found != ring_.end() &&
           go_into(v, static_cast<std::size_t>(found - ring_.begin()), boundary);
  }

  bool is_ear(VertexId v) const {
    const HalfedgeId h = mesh_.outgoing(v);
    return mesh_.is_boundary(h) && mesh_.rotate_ccw(h) == kInvalid;
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
      const std::size_t around = boundary ? n + 1 : n;
      const bool joined = i == j || i == (j + 1) % around || (i + 1) % around == j;
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
    quadric_[at(w)] += quadric_[at(v)];
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

namespace {

// A vertex that cannot stand where it belongs goes nearer to the one that it came from, by halves.
constexpr int kMostHalves = 40;
// Stars with less mean energy than this are left as they come, others improved; at the boundary,
// whose line stays where it can, less.
constexpr double kGoodStar = 1.1;
constexpr double kBadStar = 2.0;
constexpr double kMostTurn = 0.8 * std::numbers::pi;
constexpr int kMostSteps = 8;
constexpr double kSettled = 1e-2;

// A triangle around the vertex: its corners in the plane, and the inverse of the two edges from the
// vertex on the surface, laid flat.
struct StarTriangle {
  Vector2 a;
  Vector2 b;
  Eigen::Matrix2d rest;
  double area = 0.0;
};

struct Expansion {
  double value = std::numeric_limits<double>::infinity();
  Vector2 gradient = Vector2::Zero();
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();
};

class Prolongation {
 public:
  Prolongation(const Surface& whole, const Decimated& few, bool keep_boundary, Points2& uv)
      : whole_(whole), few_(few), keep_boundary_(keep_boundary), uv_(uv) {}

  bool put_back(const Decimated::Gone& gone, std::size_t ring_end) {
    ring_ = few_.rings.data() + gone.ring;
    size_ = ring_end - gone.ring;
    steps_ = gone.boundary ? size_ - 1 : size_;
    const Vector2 w = uv(at(gone.into));
    const std::size_t second = at(gone.first);
    Vector2 place =
        gone.share[0] * w + gone.share[1] * uv(second) + gone.share[2] * uv((second + 1) % size_);
    if (!stands(place) && !stands_near(gone, w, place)) return false;
    if (!gone.boundary || !keep_boundary_)
      relax(gone.vertex, gone.boundary ? kBadStar : kGoodStar, place);
    uv_.row(gone.vertex) = place.transpose();
    return true;
  }

 private:
  Vector2 uv(std::size_t i) const { return uv_.row(ring_[i]).transpose(); }

  bool stands(const Vector2& place) const {
    for (std::size_t i = 0; i < steps_; ++i) {
      if (numeric::orientation(place, uv(i), uv((i + 1) % size_)) <= 0) return false;
    }
    return true;
  }

  // As near to where it belongs as it can stand.
  bool stands_near(const Decimated::Gone& gone, const Vector2& w, Vector2& place) const {
    const double length = (place - w).norm();
    Vector2 away = gone.boundary ? along_boundary(at(gone.into)) : bisector(at(gone.into));
    const double size = away.norm();
    if (!(size > 0.0) || !(length > 0.0)) return false;
    away *= length / size;
    for (int i = 0; i < kMostHalves; ++i) {
      place = w + away;
      if (stands(place)) return true;
      away *= 0.5;
    }
    return false;
  }

  // Into the angle of the ring at its corner j, which is below two pi: from near it all of the ring
  // is seen.
  Vector2 bisector(std::size_t j) const {
    return turned(uv((j + 1) % size_) - uv(j), 0.5 * angle_at(j));
  }
  double angle_at(std::size_t j) const {
    double whole = 0.0;
    for (std::size_t i = 1; i + 1 < size_; ++i)
      whole += turn(uv((j + i) % size_) - uv(j), uv((j + i + 1) % size_) - uv(j));
    return whole;
  }

  // From the end j of the open ring to its other end; outward from there where the ring's angle is
  // too large for it, to where the next of the ring is still seen from its inner side.
  Vector2 along_boundary(std::size_t j) const {
    const double most = std::min(angle_at(j), kMostTurn);
    return j == 0 ? turned(uv(1) - uv(0), most) : turned(uv(j - 1) - uv(j), -most);
  }

  static Vector2 turned(const Vector2& v, double angle) {
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
  }

  // Newton steps on the symmetric Dirichlet energy of the star alone, down to `enough`.
  void relax(VertexId v, double enough, Vector2& place) {
    around_.clear();
    const Vector3 p = whole_.vertices.row(v).transpose();
    double whole = 0.0;
    for (std::size_t i = 0; i < steps_; ++i) {
      const Vector3 e = whole_.vertices.row(ring_[i]).transpose() - p;
      const Vector3 f = whole_.vertices.row(ring_[(i + 1) % size_]).transpose() - p;
      const double length = e.norm();
      const double height = e.cross(f).norm() / length;
      if (!(height > 1e-6 * length)) continue;
      Eigen::Matrix2d edges;
      edges << length, e.dot(f) / length, 0.0, height;
      around_.push_back({uv(i), uv((i + 1) % size_), edges.inverse(), 0.5 * length * height});
      whole += around_.back().area;
    }
    for (StarTriangle& t : around_) t.area /= whole;
    Expansion now = expand(place);
    for (int step = 0; step < kMostSteps && now.value > enough; ++step) {
      const Vector2 way = -now.hessian.inverse() * now.gradient;
      double length = 1.0;
      Expansion next;
      for (int i = 0; i < kMostHalves; ++i, length *= 0.5) {
        next = expand(place + length * way);
        if (next.value < now.value) break;
      }
      const Vector2 there = place + length * way;
      if (!(next.value < now.value) || !stands(there)) return;
      const bool settled = now.value - next.value < kSettled * now.value;
      place = there;
      now = next;
      if (settled) return;
    }
  }

  // The mean energy of the star with the vertex there; infinite where a triangle turns over.
  Expansion expand(const Vector2& p) const {
    Expansion sum;
    double value = 0.0;
    for (const StarTriangle& t : around_) {
      Eigen::Matrix2d edges;
      edges.col(0) = t.a - p;
      edges.col(1) = t.b - p;
      const Eigen::Matrix2d jacobian = edges * t.rest;
      const double unit = t.rest.determinant();
      const double d = edges.determinant() * unit;
      if (!(d > 0.0)) return {};
      const Vector2 r = t.rest.transpose() * Vector2::Ones();
      const double squares = jacobian.squaredNorm();
      const Vector2 of_squares = -2.0 * jacobian * r;
      const Vector2 of_d = unit * Vector2(t.a.y() - t.b.y(), t.b.x() - t.a.x());
      const double inverse = 1.0 / (d * d);
      const double weight = 0.25 * t.area;
      value += weight * squares * (1.0 + inverse);
      sum.gradient += weight * ((1.0 + inverse) * of_squares - 2.0 * squares * inverse / d * of_d);
      const Eigen::Matrix2d mixed = of_squares * of_d.transpose();
      Eigen::Matrix2d h = (1.0 + inverse) * 2.0 * r.squaredNorm() * Eigen::Matrix2d::Identity() -
                          2.0 * inverse / d * (mixed + mixed.transpose()) +
                          6.0 * squares * inverse * inverse * of_d * of_d.transpose();
      sum.hessian += weight * h;
    }
    sum.value = value;
    // Eigenvalues of either sign count as positive.
    const double mean = 0.5 * sum.hessian.trace();
    const double half =
        std::hypot(0.5 * (sum.hessian(0, 0) - sum.hessian(1, 1)), sum.hessian(0, 1));
    const double least = mean - half;
    const double lift = least < 1e-3 * mean ? 1e-3 * std::abs(mean) + half - mean : 0.0;
    sum.hessian += lift * Eigen::Matrix2d::Identity();
    return sum;
  }

  const Surface& whole_;
  const Decimated& few_;
  bool keep_boundary_;
  Points2& uv_;
  const VertexId* ring_ = nullptr;
  std::size_t size_ = 0;
  std::size_t steps_ = 0;
  std::vector<StarTriangle> around_;
};

}  // namespace

Points2 prolong(const Surface& whole, const Decimated& few, const Points2& uv, bool keep_boundary,
                const ExecutionContext& context) {
  Points2 all(static_cast<Eigen::Index>(few.into.size()), 2);
  all(few.origin, Eigen::all) = uv;
  Prolongation prolongation(whole, few, keep_boundary, all);
  std::size_t end = few.rings.size();
  for (std::size_t i = few.gone.size(); i-- > 0;) {
    if (i % 4096 == 0) context.check();
    if (!prolongation.put_back(few.gone[i], end)) return {};
    end = few.gone[i].ring;
  }
  return all;
}

}  // namespace flipfree::mesh
