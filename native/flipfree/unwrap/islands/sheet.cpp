#include "flipfree/unwrap/islands/sheet.h"

#include <boost/geometry/algorithms/intersects.hpp>
#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/unordered_map.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::unwrap {
namespace {

namespace bg = boost::geometry;

// Distance of a vertex from its image, over the largest extent.
constexpr double kMirrorTolerance = 1e-5;
// Costs of mirrored edges that differ by more than this factor are meant to differ.
constexpr double kSameCost = 2.5;
// Twice the tolerance to which the middle of an edge lies on the plane, over that of vertices.
constexpr double kOffPlane = 10.0;
// What a seam on the plane costs: there it stays a single one.
constexpr double kOnPlane = 0.8;

class Matcher {
 public:
  Matcher(const mesh::Surface& chart, const std::vector<double>& cost)
      : chart_(chart), adjacency_(chart.adjacency()), cost_(cost) {
    for (VertexId v = 0; v < chart.vertices.rows(); ++v)
      if (adjacency_.vertex_halfedge[at(v)] != kInvalid) used_.push_back(v);
  }

  Mirror run() {
    if (used_.empty()) return {};
    Points3 places = chart_.vertices(used_, Eigen::all);
    middle_ = places.colwise().mean();
    places.rowwise() -= middle_.transpose();
    tolerance_ = kMirrorTolerance * places.cwiseAbs().maxCoeff();
    if (!(tolerance_ > 0.0)) return {};
    std::vector<Entry> entries;
    for (const VertexId v : used_) entries.emplace_back(point(place(v)), v);
    at_place_ = decltype(at_place_)(entries);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h)
      edges_.emplace(mesh::ends(chart_.faces, h), h);
    std::vector<Vector3> normals = {Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ()};
    const Eigen::Matrix3d spread = places.transpose() * places;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
    for (Index k = 0; k < 3; ++k) normals.emplace_back(axes.eigenvectors().col(k));
    for (const Vector3& normal : normals) {
      Mirror mirror = across(normal);
      if (!mirror.empty()) return mirror;
    }
    return {};
  }

 private:
  using Point = bg::model::point<double, 3, bg::cs::cartesian>;
  using Entry = std::pair<Point, VertexId>;

  static Point point(const Vector3& p) { return {p.x(), p.y(), p.z()}; }
  Vector3 place(VertexId v) const { return chart_.vertices.row(v).transpose(); }

  // Vertices that are there, of those on the border or of the others, ascending.
  std::vector<VertexId> vertices_at(const Vector3& p, bool border) const {
    const Vector3 reach = Vector3::Constant(tolerance_);
    const bg::model::box<Point> there(point(p - reach), point(p + reach));
    std::vector<VertexId> found;
    for (auto i = at_place_.qbegin(bg::index::intersects(there)); i != at_place_.qend(); ++i)
      if (is_border(i->second) == border) found.push_back(i->second);
    std::sort(found.begin(), found.end());
    return found;
  }

  bool is_border(VertexId v) const {
    return mesh::rotate_cw(adjacency_, adjacency_.vertex_halfedge[at(v)]) == kInvalid;
  }

  // In either direction.
  HalfedgeId edge_between(VertexId a, VertexId b) const {
    const auto found = edges_.find(std::minmax(a, b));
    return found == edges_.end() ? kInvalid : found->second;
  }

  bool may_be_seam(HalfedgeId h) const {
    return adjacency_.opposite[at(h)] != kInvalid &&
           cost_[at(h)] < std::numeric_limits<double>::infinity();
  }

  // That of these vertices at one place which has edges to the images of what v has edges to.
  VertexId beside_images(VertexId v, const std::vector<VertexId>& images,
                         const std::vector<VertexId>& image) const {
    VertexId found = kInvalid;
    mesh::for_each_outgoing(adjacency_, v, [&](HalfedgeId h) {
      const VertexId beside = image[at(mesh::target(chart_.faces, h))];
      for (const VertexId i : images)
        if (found == kInvalid && beside != kInvalid && may_be_seam(h) &&
            edge_between(i, beside) != kInvalid)
          found = i;
    });
    return found;
  }

  Mirror across(const Vector3& normal) const {
    Mirror mirror;
    mirror.image.assign(adjacency_.vertex_halfedge.size(), kInvalid);
    std::vector<double> height(mirror.image.size(), 0.0);  // above the plane
    bool moves = false;
    std::vector<std::pair<VertexId, std::vector<VertexId>>> of_several;
    for (const VertexId v : used_) {
      const Vector3 p = place(v);
      height[at(v)] = normal.dot(p - middle_);
      const Vector3 shift = 2.0 * height[at(v)] * normal;
      mirror.image[at(v)] = v;
      if (shift.cwiseAbs().maxCoeff() <= tolerance_) continue;
      std::vector<VertexId> images = vertices_at(p - shift, is_border(v));
      if (images.empty()) return {};
      moves = true;
      mirror.image[at(v)] = images.size() == 1 ? images.front() : kInvalid;
      if (images.size() > 1) of_several.emplace_back(v, std::move(images));
    }
    for (const auto& [v, images] : of_several) {
      mirror.image[at(v)] = beside_images(v, images, mirror.image);
      if (mirror.image[at(v)] == kInvalid) return {};
    }
    if (!moves) return {};
    for (const VertexId v : used_) {
      if (mirror.image[at(mirror.image[at(v)])] != v) return {};
    }
    mirror.edge.assign(cost_.size(), kInvalid);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      const VertexId a = mesh::source(chart_.faces, h);
      const VertexId b = mesh::target(chart_.faces, h);
      const double sum = height[at(a)] + height[at(b)];
      mirror.side.push_back(sum > kOffPlane * tolerance_    ? 1
                            : sum < -kOffPlane * tolerance_ ? -1
                                                            : 0);
      const bool border = adjacency_.opposite[at(h)] == kInvalid;
      if (!border && !may_be_seam(h)) continue;
      const HalfedgeId image = edge_between(mirror.image[at(a)], mirror.image[at(b)]);
      if (image == kInvalid || border != (adjacency_.opposite[at(image)] == kInvalid) ||
          (!border && !may_be_seam(image)))
        return {};
      const double own = cost_[at(h)];
      const double other = cost_[at(image)];
      if (!border && !(std::max(own, other) <= kSameCost * std::min(own, other))) return {};
      mirror.edge[at(h)] = image;
    }
    return mirror;
  }

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  std::vector<VertexId> used_;
  Vector3 middle_ = Vector3::Zero();
  double tolerance_ = 0.0;
  bg::index::rtree<Entry, bg::index::quadratic<8>> at_place_;
  boost::unordered_map<mesh::VertexPair, HalfedgeId> edges_;
};

}  // namespace

Mirror find_mirror(const mesh::Surface& chart, const std::vector<double>& cost) {
  return Matcher(chart, cost).run();
}

std::vector<double> mirrored_costs(const Triangles& faces, const Mirror& mirror,
                                   std::vector<double> cost) {
  const std::vector<double> own = cost;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mirror.edge.size()); ++h) {
    if (mirror.edge[at(h)] == kInvalid) continue;
    cost[at(h)] = 0.5 * (own[at(h)] + own[at(mirror.edge[at(h)])]);
    const VertexId a = mesh::source(faces, h);
    const VertexId b = mesh::target(faces, h);
    if (mirror.image[at(a)] == a && mirror.image[at(b)] == b) cost[at(h)] *= kOnPlane;
  }
  return cost;
}

namespace {

constexpr double kLeastCotangent = 1e-3;
constexpr double kMostCotangent = 1e3;

}  // namespace

std::vector<double> scale_field(const mesh::Surface& surface, const std::vector<char>& open,
                                ExecutionContext& context) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<double> half_cotangent;  // of the angle opposite to each half-edge, clamped
  std::vector<double> defect(open.size(), 2.0 * std::numbers::pi);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(surface.faces.size()); ++h) {
    const CornerId apex = previous_corner(h);
    const auto [a, b] = mesh::sides_at(surface, apex);
    const double sine = a.cross(b).norm();
    const double cosine = a.dot(b);
    half_cotangent.push_back(sine > 0.0
                                 ? std::clamp(0.5 * cosine / sine, kLeastCotangent, kMostCotangent)
                                 : kMostCotangent);
    defect[at(mesh::source(surface.faces, apex))] -= std::atan2(sine, cosine);
  }
  std::vector<double> result(open.size(), 0.0);
  std::vector<Index> unknown(open.size(), kInvalid);
  std::vector<Index> vertex;  // per unknown
  for (std::size_t v = 0; v < open.size(); ++v) {
    if (open[v] || adjacency.vertex_halfedge[v] == kInvalid) continue;
    unknown[v] = static_cast<Index>(vertex.size());
    vertex.push_back(static_cast<Index>(v));
  }
  const auto count = static_cast<Index>(vertex.size());
  if (count == 0) return result;
  // Inner vertices have closed fans, and one outgoing half-edge for each neighbour.
  std::vector<Eigen::Triplet<double, Index>> entries;
  entries.reserve(4 * vertex.size());
  Eigen::VectorXd right(count);
  for (Index row = 0; row < count; ++row) {
    if (row % 8192 == 0) context.check();
    double diagonal = 0.0;
    mesh::for_each_outgoing(adjacency, vertex[at(row)], [&](HalfedgeId h) {
      const double weight = half_cotangent[at(h)] + half_cotangent[at(adjacency.opposite[at(h)])];
      diagonal += weight;
      const Index other = unknown[at(mesh::target(surface.faces, h))];
      if (other > row) entries.emplace_back(other, row, -weight);
    });
    entries.emplace_back(row, row, diagonal);
    right[row] = defect[at(vertex[at(row)])];
  }
  numeric::SparseMatrix matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  if (!cholesky.factorize(matrix, context)) return result;
  const Eigen::VectorXd u = cholesky.solve(right, context);
  const bool usable = u.allFinite();
  for (Index row = 0; row < count && usable; ++row) result[at(vertex[at(row)])] = u[row];
  return result;
}

namespace {

// Moments of |u| over a hill: its area, and the integrals of |u| and its square.
using Moments = Eigen::Array3d;

double above(double foot, const Moments& m) {
  return std::max(m[2] - 2.0 * foot * m[1] + foot * foot * m[0], 0.0);
}

}  // namespace

std::vector<Hill> hills(const mesh::Surface& surface, const std::vector<double>& u,
                        const std::vector<double>& area, const std::vector<char>& reach) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  std::vector<VertexId> order;
  for (std::size_t v = 0; v < u.size(); ++v) {
    if (u[v] != 0.0) order.push_back(static_cast<VertexId>(v));
  }
  const auto height = [&](VertexId v) { return std::abs(u[at(v)]); };
  const auto lower = [&](VertexId a, VertexId b) {
    return height(a) != height(b) ? height(a) < height(b) : a > b;
  };
  std::sort(order.begin(), order.end(), [&](VertexId a, VertexId b) { return lower(b, a); });
  DisjointSets sets(static_cast<Index>(u.size()));  // the representative of a hill is its peak
  std::vector<char> seen(u.size(), 0);
  std::vector<Moments> moments(u.size());
  std::vector<VertexId> end(u.size(), kInvalid);
  std::vector<Hill> found;
  const auto finish = [&](VertexId peak, double gain, double foot) {
    if (end[at(peak)] != kInvalid) found.push_back({end[at(peak)], gain, height(peak), foot});
  };
  for (const VertexId v : order) {
    seen[at(v)] = 1;
    if (reach[at(v)] != 0) end[at(v)] = v;
    moments[at(v)] = {area[at(v)], area[at(v)] * height(v), area[at(v)] * height(v) * height(v)};
    mesh::for_each_outgoing(adjacency, v, [&](HalfedgeId h) {
      const VertexId w = mesh::target(surface.faces, h);
      if (seen[at(w)] == 0 || u[at(v)] * u[at(w)] < 0.0) return;
      VertexId a = sets.find(v);
      VertexId b = sets.find(w);
      if (a == b) return;
      if (lower(b, a)) std::swap(a, b);
      if (a != v) finish(a, above(height(v), moments[at(a)]), height(v));
      sets.join(a, b);
      moments[at(b)] += moments[at(a)];
      if (end[at(b)] == kInvalid) end[at(b)] = end[at(a)];
    });
  }
  for (const VertexId v : order) {
    if (sets.find(v) == v) finish(v, moments[at(v)][2], 0.0);
  }
  return found;
}

}  // namespace flipfree::unwrap
