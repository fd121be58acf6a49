#include "flipfree/mesh/decimated/prolong.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::mesh {
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
    double whole = 0.0;
    for (std::size_t i = 1; i + 1 < size_; ++i)
      whole += turn(uv((j + i) % size_) - uv(j), uv((j + i + 1) % size_) - uv(j));
    return turned(uv((j + 1) % size_) - uv(j), 0.5 * whole);
  }

  // From the end j of the open ring to its other end; outward from there where the ring's angle is
  // too large for it, to where the next of the ring is still seen from its inner side.
  Vector2 along_boundary(std::size_t j) const {
    double whole = 0.0;
    for (std::size_t i = 1; i + 1 < size_; ++i)
      whole += turn(uv((j + i) % size_) - uv(j), uv((j + i + 1) % size_) - uv(j));
    const double most = std::min(whole, kMostTurn);
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
  for (std::size_t i = 0; i < few.origin.size(); ++i)
    all.row(few.origin[i]) = uv.row(static_cast<Eigen::Index>(i));
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
