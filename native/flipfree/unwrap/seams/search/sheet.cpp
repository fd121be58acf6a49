#include "flipfree/unwrap/seams/search/sheet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/seams/search/hills.h"

namespace flipfree::unwrap {
namespace {

// Hills with at least this share of the best one's gain for its length are slit in the same round.
constexpr double kNearlyBest = 0.5;
constexpr double kLeastCost = 1e-12;
// Of the bound, on a scale of logarithms, from which on a place is a tip.
constexpr double kOfTips = 0.7;

}  // namespace

Sheet::Sheet(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
             const std::vector<double>& cost, const Mirror& mirror)
    : chart_(chart),
      mirror_(mirror),
      loops_(outer_loop_last(chart, mesh::boundary_halfedge_loops(chart.faces, adjacency))),
      real_(static_cast<HalfedgeId>(adjacency.opposite.size())),
      surface_(loops_.empty()
                   ? chart
                   : mesh::fill_holes(chart, {loops_.begin(), loops_.end() - 1}).surface),
      adjacency_(
          mesh::build_adjacency(static_cast<Index>(surface_.vertices.rows()), surface_.faces)),
      cost_(adjacency_.opposite.size(), 0.0),
      area_(adjacency_.vertex_halfedge.size(), 0.0),
      open_(adjacency_.vertex_halfedge.size(), 0),
      loop_of_(adjacency_.vertex_halfedge.size(), kInvalid),
      cut_(adjacency.opposite.size(), 0),
      paths_(surface_.faces, adjacency_, cost_) {
  for (std::size_t h = 0; h < cost.size(); ++h) {
    const HalfedgeId o = adjacency_.opposite[h];
    if (o < real_) cost_[h] = cost[h];
  }
  for (FaceId f = 0; f < chart.faces.rows(); ++f) {
    const Vector3 p = chart.vertices.row(chart.faces(f, 0));
    const double area = (chart.vertices.row(chart.faces(f, 1)).transpose() - p)
                            .cross(chart.vertices.row(chart.faces(f, 2)).transpose() - p)
                            .norm() /
                        6.0;
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
  const auto first = static_cast<std::size_t>(used - adjacency_.vertex_halfedge.begin());
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
  const Untimed opening(context);
  std::vector<double> cost = cost_;
  for (double& c : cost) c = std::clamp(c, kLeastCost, kForbidden);
  cut_ = mesh::planar_cut(chart_, adjacency_, context, {}, {}, cost);
  for (HalfedgeId h = 0; h < real_; ++h) {
    if (cut_[at(h)] != 0) open_vertex(mesh::source(surface_.faces, h));
  }
  return true;
}

std::vector<double> Sheet::scale(ExecutionContext& context) {
  return scale_field().solve(open_, context);
}

double Sheet::excess(const std::vector<double>& u) const {
  double growing = 0.0;
  double shrinking = 0.0;
  for (std::size_t v = 0; v < u.size(); ++v) {
    growing += area_[v] * std::exp(2.0 * u[v]);
    shrinking += area_[v] * std::exp(-2.0 * u[v]);
  }
  return std::sqrt(growing * shrinking) - 1.0;
}

std::vector<double> Sheet::tips(const std::vector<double>& ratios, double most) const {
  std::vector<double> result(open_.size(), 0.0);
  for (std::size_t c = 0; c < 3 * ratios.size(); ++c) {
    const VertexId v = chart_.faces(static_cast<Eigen::Index>(c / 3), static_cast<Index>(c % 3));
    if (open_[at(v)] != 0) continue;
    result[at(v)] = std::max(result[at(v)], std::log(ratios[c / 3]) - kOfTips * std::log(most));
  }
  return result;
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
  for (const Hill& hill : hills(surface_.faces, adjacency_, u, area_, reach)) {
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

Sheet::Loops Sheet::outer_loop_last(const mesh::Surface& chart, Loops loops) {
  std::size_t outer = 0;
  double longest = -1.0;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    double length = 0.0;
    for (const HalfedgeId h : loops[i]) {
      length += (chart.vertices.row(mesh::source(chart.faces, h)) -
                 chart.vertices.row(mesh::target(chart.faces, h)))
                    .norm();
    }
    if (length > longest) {
      longest = length;
      outer = i;
    }
  }
  if (!loops.empty()) std::swap(loops.back(), loops[outer]);
  return loops;
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
  for (const Hill& hill : hills(surface_.faces, adjacency_, u, area_, reach)) {
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
  for (const VertexId v : way.vertices) open_vertex(v);
  way.vertices.push_back(begin);
  mark(way, cut_);
  ways_.push_back(std::move(way));
  if (!mirror_.empty()) slit_image(ways_.back());
}

// Up to where it meets what is open: the slit itself where both cross the plane.
void Sheet::slit_image(const Way& way) {
  Way image;
  image.image = true;
  for (std::size_t i = 0; i < way.vertices.size(); ++i) {
    if (way.vertices[i] >= chart_.vertices.rows()) return;  // across a hole
    const VertexId v = mirror_.image[at(way.vertices[i])];
    image.vertices.push_back(v);
    if (open_[at(v)] != 0) break;
    if (i == way.edges.size() || mirror_.edge[at(way.edges[i])] == kInvalid) return;
    image.edges.push_back(mirror_.edge[at(way.edges[i])]);
  }
  if (image.edges.empty()) return;
  for (const VertexId v : image.vertices) open_vertex(v);
  mark(image, cut_);
  ways_.push_back(std::move(image));
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

void Sheet::mark(const Way& way, mesh::EdgeFlags& flags) const {
  for (const HalfedgeId h : way.edges) {
    const HalfedgeId o = adjacency_.opposite[at(h)];
    if (h < real_ && o < real_ && o != kInvalid) flags[at(h)] = flags[at(o)] = 1;
  }
}

mesh::EdgeFlags Sheet::edges(const std::vector<Way>& ways) const {
  mesh::EdgeFlags flags(cut_.size(), 0);
  for (const Way& way : ways) mark(way, flags);
  return flags;
}

// Across holes slits go on as others.
std::vector<std::vector<VertexId>> Sheet::parts(const std::vector<Way>& ways) const {
  const auto own = static_cast<VertexId>(chart_.vertices.rows());
  std::vector<std::vector<VertexId>> result;
  for (const Way& slit : ways) {
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

double Sheet::defect(VertexId v) { return scale_field().defect(v); }

ScaleField& Sheet::scale_field() {
  if (!scale_) scale_.emplace(surface_, adjacency_);
  return *scale_;
}

ScaleField::Response Sheet::respond(const std::vector<char>& open, ExecutionContext& context) {
  const auto slope = [&](const std::vector<double>& u) {
    double growing = 0.0;
    double shrinking = 0.0;
    for (std::size_t v = 0; v < u.size(); ++v) {
      growing += area_[v] * std::exp(2.0 * u[v]);
      shrinking += area_[v] * std::exp(-2.0 * u[v]);
    }
    const double balance = std::sqrt(shrinking / growing);
    std::vector<double> result(u.size());
    for (std::size_t v = 0; v < u.size(); ++v)
      result[v] = area_[v] * (balance * std::exp(2.0 * u[v]) - std::exp(-2.0 * u[v]) / balance);
    return result;
  };
  return scale_field().respond(open, slope, context);
}

// To the nearest vertex of a hole's border, if the end lies there.
double Sheet::distance(VertexId end) const {
  if (loop_of_[at(end)] == kInvalid) return paths_.distance(end);
  double least = mesh::ShortestPaths::kUnreached;
  for (const HalfedgeId h : loops_[at(loop_of_[at(end)])])
    least = std::min(least, paths_.distance(mesh::source(chart_.faces, h)));
  return least;
}

bool Sheet::connect(std::vector<VertexId> ends, ExecutionContext& context) {
  if (closed() && ways_.empty()) {
    if (ends.empty()) return false;
    const VertexId root = nearest_on_plane(ends.front(), context);
    open_vertex(root);
    ways_.push_back({{root}, {}});
  }
  for (;;) {
    std::erase_if(ends, [&](VertexId v) { return open_[at(v)] != 0; });
    if (ends.empty()) return true;
    paths_.grow(context);
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < ends.size(); ++i) {
      if (distance(ends[i]) < distance(ends[nearest])) nearest = i;
    }
    VertexId end = ends[nearest];
    if (distance(end) == mesh::ShortestPaths::kUnreached) return false;
    if (loop_of_[at(end)] != kInvalid) {
      for (const HalfedgeId h : loops_[at(loop_of_[at(end)])]) {
        const VertexId v = mesh::source(chart_.faces, h);
        if (paths_.distance(v) < paths_.distance(end)) end = v;
      }
    }
    slit_to(end);
  }
}

}  // namespace flipfree::unwrap
