#include "flipfree/unwrap/seams/sheet.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <utility>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {
namespace {

// Distance of a vertex from its image, over the largest extent.
constexpr double kMirrorTolerance = 1e-5;
// Costs of mirrored edges that differ by more than this factor are meant to differ.
constexpr double kSameCost = 2.5;
// What a seam on the plane costs: there it stays a single one.
constexpr double kOnPlane = 0.8;

class Matcher {
 public:
  Matcher(const mesh::Surface& chart, const std::vector<double>& cost)
      : chart_(chart), adjacency_(chart.adjacency()), cost_(cost) {
    for (std::size_t v = 0; v < adjacency_.vertex_halfedge.size(); ++v) {
      if (adjacency_.vertex_halfedge[v] == kInvalid) continue;
      used_.push_back(static_cast<VertexId>(v));
      middle_ += place(used_.back());
    }
    middle_ /= std::max(static_cast<double>(used_.size()), 1.0);
    double size = 0.0;
    for (const VertexId v : used_) {
      const Vector3 p = place(v) - middle_;
      size = std::max(size, p.cwiseAbs().maxCoeff());
      spread_ += p * p.transpose();
    }
    tolerance_ = kMirrorTolerance * size;
  }

  Mirror run() {
    if (used_.empty() || !(tolerance_ > 0.0)) return {};
    for (const VertexId v : used_) cells_[key(cell(place(v)))].push_back(v);
    std::vector<Vector3> normals = {Vector3::UnitX(), Vector3::UnitY(), Vector3::UnitZ()};
    const Eigen::Matrix3d axes =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread_).eigenvectors();
    for (Index k = 0; k < 3; ++k) normals.emplace_back(axes.col(k));
    for (const Vector3& normal : normals) {
      Mirror mirror = across(normal);
      if (!mirror.empty()) return mirror;
    }
    return {};
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  struct Spoke {
    HalfedgeId halfedge;
    VertexId end;  // that it is to have
  };

  Vector3 place(VertexId v) const { return chart_.vertices.row(v).transpose(); }

  // Cells are some tolerances wide: whatever is near lies in the same one or beside it.
  Cell cell(const Vector3& p) const {
    const Vector3 scaled = (p - middle_) / (4.0 * tolerance_);
    return {std::llround(scaled.x()), std::llround(scaled.y()), std::llround(scaled.z())};
  }
  static std::uint64_t key(const Cell& c) {
    std::uint64_t hash = 0;
    for (const std::int64_t x : c)
      hash = (hash ^ static_cast<std::uint64_t>(x)) * 0x9E3779B97F4A7C15ULL;
    return hash;
  }

  // Vertices that are there, of those on the border or of the others.
  std::vector<VertexId> vertices_at(const Vector3& p, bool border) const {
    std::vector<VertexId> found;
    const Cell home = cell(p);
    for (std::int64_t i = 0; i < 27; ++i) {
      const Cell c = {home[0] + i % 3 - 1, home[1] + i / 3 % 3 - 1, home[2] + i / 9 - 1};
      const auto entry = cells_.find(key(c));
      if (entry == cells_.end()) continue;
      for (const VertexId v : entry->second) {
        if (cell(place(v)) != c || is_border(v) != border) continue;
        if ((place(v) - p).cwiseAbs().maxCoeff() > tolerance_) continue;
        found.push_back(v);
      }
    }
    return found;
  }

  bool is_border(VertexId v) const {
    return mesh::rotate_cw(adjacency_, adjacency_.vertex_halfedge[at(v)]) == kInvalid;
  }

  // In either direction. Around both ends in turn: one of them may be a hub.
  HalfedgeId edge_between(VertexId a, VertexId b) const {
    std::array<Spoke, 2> spokes = {Spoke{adjacency_.vertex_halfedge[at(a)], b},
                                   Spoke{adjacency_.vertex_halfedge[at(b)], a}};
    const std::array<HalfedgeId, 2> first = {spokes[0].halfedge, spokes[1].halfedge};
    for (;;) {
      for (std::size_t i = 0; i < 2; ++i) {
        auto& [h, end] = spokes[i];
        if (mesh::target(chart_.faces, h) == end) return h;
        const HalfedgeId before = previous_corner(h);
        if (mesh::source(chart_.faces, before) == end) return before;
        h = mesh::rotate_ccw(adjacency_, h);
        if (h == kInvalid || h == first[i]) return kInvalid;
      }
    }
  }

  bool may_be_seam(HalfedgeId h) const {
    return adjacency_.opposite[at(h)] != kInvalid &&
           cost_[at(h)] < std::numeric_limits<double>::infinity();
  }

  // That of these vertices at one place which has edges to the images of what v has edges to.
  VertexId beside_images(VertexId v, const std::vector<VertexId>& images,
                         const std::vector<VertexId>& image) const {
    const HalfedgeId first = adjacency_.vertex_halfedge[at(v)];
    HalfedgeId h = first;
    do {
      const VertexId beside = image[at(mesh::target(chart_.faces, h))];
      for (const VertexId i : images)
        if (beside != kInvalid && may_be_seam(h) && edge_between(i, beside) != kInvalid) return i;
      h = mesh::rotate_ccw(adjacency_, h);
    } while (h != kInvalid && h != first);
    return kInvalid;
  }

  Mirror across(const Vector3& normal) const {
    Mirror mirror;
    mirror.image.assign(adjacency_.vertex_halfedge.size(), kInvalid);
    bool moves = false;
    std::vector<std::pair<VertexId, std::vector<VertexId>>> of_several;
    for (const VertexId v : used_) {
      const Vector3 p = place(v);
      const Vector3 shift = 2.0 * normal.dot(p - middle_) * normal;
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
      const bool border = adjacency_.opposite[at(h)] == kInvalid;
      if (!border && !may_be_seam(h)) continue;
      const HalfedgeId image = edge_between(mirror.image[at(mesh::source(chart_.faces, h))],
                                            mirror.image[at(mesh::target(chart_.faces, h))]);
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
  Eigen::Matrix3d spread_ = Eigen::Matrix3d::Zero();
  double tolerance_ = 0.0;
  std::unordered_map<std::uint64_t, std::vector<VertexId>> cells_;
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

// Hills with at least this share of the best one's gain for its length are slit in the same round.
constexpr double kNearlyBest = 0.5;
constexpr double kLeastCost = 1e-12;

// Moves the longest loop to the end.
mesh::Surface filled_but_for_longest(const mesh::Surface& chart,
                                     std::vector<std::vector<HalfedgeId>>& loops) {
  if (loops.empty()) return chart;
  std::swap(loops.back(), loops[longest_loop(chart, loops)]);
  return mesh::fill_holes(chart, {loops.begin(), loops.end() - 1});
}

}  // namespace

Sheet::Sheet(const mesh::Surface& chart, const std::vector<double>& cost, const Mirror& mirror)
    : chart_(chart),
      mirror_(mirror),
      loops_(mesh::boundary_halfedge_loops(chart.faces, chart.adjacency())),
      real_(static_cast<HalfedgeId>(cost.size())),
      surface_(filled_but_for_longest(chart, loops_)),
      adjacency_(surface_.adjacency()),
      scale_(surface_),
      cost_(adjacency_.opposite.size(), 0.0),
      area_(adjacency_.vertex_halfedge.size(), 0.0),
      open_(adjacency_.vertex_halfedge.size(), 0),
      loop_of_(adjacency_.vertex_halfedge.size(), kInvalid),
      cut_(cost.size(), 0),
      paths_(surface_.faces, adjacency_, cost_) {
  for (std::size_t h = 0; h < cost.size(); ++h) {
    const HalfedgeId o = adjacency_.opposite[h];
    if (o < real_) cost_[h] = cost[h];
  }
  for (FaceId f = 0; f < chart.faces.rows(); ++f) {
    const double area = chart.area_vector(f).norm() / 6.0;
    for (Index k = 0; k < 3; ++k) area_[at(chart.faces(f, k))] += area;
  }
  double total = 0.0;
  for (const double a : area_) total += a;
  for (double& a : area_) a /= total;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    for (const HalfedgeId h : loops_[i])
      loop_of_[at(mesh::source(chart.faces, h))] = static_cast<Index>(i);
  }
  if (!loops_.empty()) open_loop(static_cast<Index>(loops_.size()) - 1);
}

bool Sheet::open_closed(ExecutionContext& context) {
  if (!loops_.empty()) return false;
  const auto used =
      std::find_if(adjacency_.vertex_halfedge.begin(), adjacency_.vertex_halfedge.end(),
                   [](HalfedgeId h) { return h != kInvalid; });
  const auto first = at(used - adjacency_.vertex_halfedge.begin());
  open_[first] = 1;
  const VertexId peak = steepest(scale(context), static_cast<VertexId>(first));
  open_[first] = 0;
  // A slit between a hill and its image crosses the plane.
  const VertexId root = nearest_on_plane(peak, context);
  open_vertex(root);
  ways_.push_back({{root}, {}});
  const std::vector<double> u = scale(context);
  paths_.grow(context);
  const VertexId end = root == peak ? steepest(u, root) : peak;
  if (edges_to(end) >= (root == peak ? 2 : 1)) {
    slit_to(end);
    return false;
  }
  return open_anyhow(context);
}

bool Sheet::open_anyhow(ExecutionContext& context) {
  if (!loops_.empty() || std::find(cut_.begin(), cut_.end(), 1) != cut_.end()) return false;
  const Grace opening(context);
  std::vector<double> cost = cost_;
  for (double& c : cost) c = std::clamp(c, kLeastCost, kForbidden);
  cut_ = mesh::planar_cut(chart_, adjacency_, context, {}, {}, cost);
  for (HalfedgeId h = 0; h < real_; ++h) {
    if (cut_[at(h)] != 0) open_vertex(mesh::source(surface_.faces, h));
  }
  return true;
}

std::vector<double> Sheet::scale(ExecutionContext& context) { return scale_.solve(open_, context); }

double Sheet::excess(const std::vector<double>& u) const {
  double growing = 0.0;
  double shrinking = 0.0;
  for (std::size_t v = 0; v < u.size(); ++v) {
    growing += area_[v] * std::exp(2.0 * u[v]);
    shrinking += area_[v] * std::exp(-2.0 * u[v]);
  }
  return std::sqrt(growing * shrinking) - 1.0;
}

bool Sheet::slit_best(const std::vector<double>& u, std::size_t most, ExecutionContext& context) {
  paths_.grow(context);
  struct End {
    VertexId vertex;
    double worth;
  };
  std::vector<End> ends;
  std::vector<char> reach(open_.size());
  for (VertexId v = 0; v < static_cast<VertexId>(reach.size()); ++v)
    reach[at(v)] = paths_.distance(v) < mesh::ShortestPaths::kUnreached ? 1 : 0;
  for (const Hill& hill : hills(surface_, u, area_, reach)) {
    const double length = paths_.distance(hill.peak);
    if (!(hill.gain > 0.0)) continue;
    ends.push_back({hill.peak, hill.gain / std::max(length, 1e-300)});
  }
  std::sort(ends.begin(), ends.end(), [](const End& a, const End& b) {
    return a.worth != b.worth ? a.worth > b.worth : a.vertex < b.vertex;
  });
  for (std::size_t i = 0; i < std::min(ends.size(), most); ++i) {
    if (ends[i].worth < kNearlyBest * ends[0].worth) break;
    paths_.grow(context);
    slit_to(ends[i].vertex);
  }
  return !ends.empty();
}

bool Sheet::slit_between(VertexId end, VertexId begin, ExecutionContext& context) {
  if (end == begin) {
    if (loops_.empty()) open_vertex(end);
    return true;
  }
  paths_.grow(context);
  // Which loop of a chart is its outer one may differ.
  const VertexId closed = open_[at(end)] == 0 ? end : begin;
  if (open_[at(closed)] != 0) return true;
  if (paths_.distance(closed) == mesh::ShortestPaths::kUnreached) return false;
  slit_to(closed);
  return true;
}

// The peak of the hill with the largest gain, that a slit may end in; `otherwise` if there is
// none.
VertexId Sheet::steepest(const std::vector<double>& u, VertexId otherwise) const {
  Hill best{otherwise, 0.0};
  std::vector<char> reach(open_.size(), 0);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
    if (cost_[at(h)] < mesh::ShortestPaths::kUnreached)
      reach[at(mesh::source(surface_.faces, h))] = 1;
  }
  for (const Hill& hill : hills(surface_, u, area_, reach)) {
    if (hill.gain > best.gain) best = hill;
  }
  return best.peak;
}

int Sheet::edges_to(VertexId v) const {
  int count = 0;
  for (; paths_.arrival(v) != kInvalid; v = paths_.before(v)) ++count;
  return count;
}

void Sheet::open_vertex(VertexId v) {
  if (open_[at(v)] != 0) return;
  open_[at(v)] = 1;
  paths_.add_source(v);
  if (loop_of_[at(v)] != kInvalid) open_loop(loop_of_[at(v)]);
}

// A vertex is on one loop: none of those here opens another one. Cost: O(its length).
void Sheet::open_loop(Index loop) {
  for (const HalfedgeId h : loops_[at(loop)]) {
    const VertexId v = mesh::source(surface_.faces, h);
    if (open_[at(v)] != 0) continue;
    open_[at(v)] = 1;
    paths_.add_source(v);
  }
}

void Sheet::slit_to(VertexId end) {
  Way way;
  VertexId begin = end;
  for (; paths_.arrival(begin) != kInvalid; begin = paths_.before(begin)) {
    way.vertices.push_back(begin);
    way.edges.push_back(paths_.arrival(begin));
  }
  if (way.edges.empty()) return;
  way.vertices.push_back(begin);
  take(std::move(way));
  if (!mirror_.empty()) slit_image(ways_.back());
}

// Up to where it meets what is open: the slit itself where both cross the plane.
void Sheet::slit_image(const Way& way) {
  Way image;
  for (std::size_t i = 0; i < way.vertices.size(); ++i) {
    if (way.vertices[i] >= chart_.vertices.rows()) return;  // across a hole
    const VertexId v = mirror_.image[at(way.vertices[i])];
    image.vertices.push_back(v);
    if (open_[at(v)] != 0) break;
    if (i == way.edges.size() || mirror_.edge[at(way.edges[i])] == kInvalid) return;
    image.edges.push_back(mirror_.edge[at(way.edges[i])]);
  }
  if (!image.edges.empty()) take(std::move(image));
}

VertexId Sheet::nearest_on_plane(VertexId v, const ExecutionContext& context) const {
  if (mirror_.empty() || mirror_.image[at(v)] == v) return v;
  mesh::ShortestPaths from(surface_.faces, adjacency_, cost_);
  from.add_source(v);
  from.grow(context);
  VertexId nearest = v;
  double least = mesh::ShortestPaths::kUnreached;
  for (VertexId w = 0; w < static_cast<VertexId>(mirror_.image.size()); ++w) {
    if (mirror_.image[at(w)] != w || from.distance(w) >= least) continue;
    least = from.distance(w);
    nearest = w;
  }
  return nearest;
}

void Sheet::take(Way way) {
  for (const VertexId v : way.vertices) open_vertex(v);
  for (const HalfedgeId h : way.edges) {
    const HalfedgeId o = adjacency_.opposite[at(h)];
    if (h < real_ && o < real_ && o != kInvalid) cut_[at(h)] = cut_[at(o)] = 1;
  }
  ways_.push_back(std::move(way));
}

// Across holes slits go on as others.
std::vector<std::vector<VertexId>> Sheet::made() const {
  const auto own = static_cast<VertexId>(chart_.vertices.rows());
  std::vector<std::vector<VertexId>> result;
  for (const Way& slit : ways_) {
    const std::vector<VertexId>& way = slit.vertices;
    if (way.size() == 1) result.push_back(way);
    for (auto last = way.rbegin(); last != way.rend();) {
      const auto hole = std::find_if(last, way.rend(), [&](VertexId v) { return v >= own; });
      if (hole - last > 1) {
        std::vector<VertexId> part(last, hole);
        std::reverse(part.begin(), part.end());
        result.push_back(std::move(part));
      }
      last = std::find_if(hole, way.rend(), [&](VertexId v) { return v < own; });
    }
  }
  return result;
}

}  // namespace flipfree::unwrap
