#include "flipfree/intrinsic/layout/refine_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/layout/polygon_triangulation.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::intrinsic {

namespace {

// One side of a face with all its points: place 0 is its first corner, last() its second.
struct Side {
  const EdgePointMap& map;
  HalfedgeId h;
  bool left;
  std::int64_t begin, end;

  Side(const EdgePointMap& m, HalfedgeId halfedge)
      : map(m),
        h(halfedge),
        left(m.edge_halfedge[at(m.edge_of[at(halfedge)])] == halfedge),
        begin(m.begin[at(m.edge_of[at(halfedge)])]),
        end(m.begin[at(m.edge_of[at(halfedge)]) + 1]) {}

  Index last() const { return static_cast<Index>(end - begin) + 1; }
  std::int64_t point_at(Index place) const { return left ? begin + place - 1 : end - place; }
  Vector2 uv(Index place) const {
    if (place == 0) return map.corner_uv.row(h);
    if (place == last()) return map.corner_uv.row(next_corner(h));
    const EdgePoint& point = map.points[at(point_at(place))];
    return left ? point.uv_left : point.uv_right;
  }
  // How far the direction from `origin` to the side turns between two places.
  double winding(const Vector2& origin, Index from, Index to) const {
    double sum = 0.0;
    const Index step = to > from ? 1 : -1;
    for (Index i = from; i != to; i += step) sum += turn(uv(i) - origin, uv(i + step) - origin);
    return sum;
  }
};

// True if at every vertex of the polygon the angles of the triangles (given by ids) sum to the
// developed one, up to less than a turn; also if none are given.
bool angles_are_developed(std::vector<double> developed, const std::vector<PolygonVertex>& polygon,
                          const std::vector<PolygonTriangle>& triangles) {
  if (developed.empty()) return true;
  std::array<std::size_t, 3> place{};
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] = 0;
      while (polygon[place[k]].id != t[k]) ++place[k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector2 &a = polygon[place[k]].uv, &b = polygon[place[(k + 1) % 3]].uv,
                    &c = polygon[place[(k + 2) % 3]].uv;
      developed[place[k]] -= turn(b - a, c - a);
    }
  }
  return std::all_of(developed.begin(), developed.end(),
                     [](double angle) { return std::abs(angle) < kAngleSlack; });
}

// A vertex in the plane of two weights of a face, whichever face its record names.
Vector2 place_in(const mesh::Surface& input, FaceId parent, const mesh::SurfacePoint& point) {
  Vector2 place = Vector2::Zero();
  for (int k = 0; k < 3; ++k) {
    for (int own = 1; own < 3; ++own) {
      if (input.faces(point.face, k) == input.faces(parent, own)) place[own - 1] = point.weight[k];
    }
  }
  return place;
}

}  // namespace

IndexPairs edges_on(const Triangles& faces, const EdgePointMap& map, const mesh::EdgeFlags& flagged,
                    const RefinedLayout& layout) {
  std::vector<std::array<Index, 2>> pairs;
  for (std::size_t e = 0; e < map.edge_halfedge.size(); ++e) {
    const HalfedgeId h = map.edge_halfedge[e];
    if (flagged[at(h)] == 0) continue;
    Index last = mesh::source(faces, h);
    for (std::int64_t p = map.begin[e]; p < map.begin[e + 1]; ++p) {
      const Index v = layout.edge_vertex[at(p)];
      if (v == kInvalid) continue;
      pairs.push_back({last, v});
      last = v;
    }
    pairs.push_back({last, mesh::target(faces, h)});
  }
  IndexPairs out(static_cast<Eigen::Index>(pairs.size()), 2);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    out.row(static_cast<Eigen::Index>(i)) << pairs[i][0], pairs[i][1];
  return out;
}

std::string find_broken_invariant(const mesh::Surface& input, const RefinedLayout& layout) {
  const Triangles& faces = layout.surface.faces;
  if (layout.uv.rows() != 3 * faces.rows()) return "not one place per corner";
  if (layout.provenance.vertex.size() != static_cast<std::size_t>(layout.surface.vertices.rows()))
    return "not one provenance per vertex";
  if (std::string broken = mesh::find_broken_provenance(input, faces, layout.provenance);
      !broken.empty())
    return broken;
  if (!layout.invalid.empty()) return {};
  for (Index f = 0; f < static_cast<Index>(faces.rows()); ++f) {
    const auto place = [&](int k) {
      return place_in(input, layout.provenance.face[static_cast<std::size_t>(f)],
                      layout.provenance.vertex[static_cast<std::size_t>(faces(f, k))]);
    };
    if (numeric::orientation(place(0), place(1), place(2)) <= 0)
      return "face " + std::to_string(f) + " does not turn as its parent does";
    const auto uv = [&](int k) { return Vector2(layout.uv.row(3 * f + k)); };
    if (numeric::orientation(uv(0), uv(1), uv(2)) <= 0)
      return "face " + std::to_string(f) + " is not positive";
  }
  return {};
}

namespace {

// Points nearer to each other or to an end than this part of their edge are not told apart where a
// face has a triangulation without: the 32-bit positions that Blender stores could not hold them
// either.
constexpr double kLeastGap = 1e-6;
// As doubles hold them.
constexpr double kFinestGap = 1e-14;
// A point is taken out if the triangles around it get no more distorted by it than this (K = |J|^2
// / (2 det J), 1 = conformal), or twice what they were.
constexpr double kGoodDistortion = 8.0;
constexpr int kThinningPasses = 4;
// From so many vertices on the cells are tried before the search among all diagonals.
constexpr std::size_t kLargePolygon = 48;
constexpr std::size_t kFacesPerChunk = 4096;  // of what threads share

class MapRefiner {
 public:
  // No point in use, every face whole. The arguments must outlive this.
  MapRefiner(const mesh::Surface& input, const EdgePointMap& map, Storage storage,
             const ExecutionContext& context)
      : input_(input),
        adjacency_(input.adjacency()),
        map_(map),
        storage_(storage),
        context_(context),
        vertex_count_(static_cast<Index>(input.vertices.rows())),
        used_(map.points.size(), 0),
        triangles_(static_cast<std::size_t>(input.faces.rows())) {}

  RefinedLayout run(Refinement refinement) {
    std::vector<FaceId> bad = find_bad();
    if (refinement == Refinement::kNever) {
      invalid_ = std::move(bad);
      return write();
    }
    by_cells_ = refinement == Refinement::kFull;
    if (by_cells_) {
      bad.resize(triangles_.size());
      std::iota(bad.begin(), bad.end(), 0);
    }
    std::vector<double> gaps = {by_cells_ ? kFinestGap : kLeastGap};
    if (refinement == Refinement::kClosely) gaps.push_back(kFinestGap);
    activate(std::move(bad), gaps);
    if (!by_cells_) thin_out();
    return write();
  }

 private:
  const mesh::Surface& input_;
  const mesh::Adjacency& adjacency_;
  const EdgePointMap& map_;
  Storage storage_;
  const ExecutionContext& context_;
  Index vertex_count_;
  std::vector<char> used_;  // per point
  // Per face; none: the face itself. Vertex count + p is point p.
  std::vector<std::vector<PolygonTriangle>> triangles_;
  std::vector<FaceId> invalid_;
  bool by_cells_ = false;  // along the final triangulation's edges wherever that is possible
  // Scratch, kept to avoid allocation.
  std::vector<PolygonVertex> polygon_, hole_;
  std::vector<PolygonTriangle> found_;

  HalfedgeId opposite(HalfedgeId h) const { return adjacency_.opposite[at(h)]; }
  bool uses(std::int64_t p) const { return used_[at(p)] != 0; }

  std::vector<PolygonTriangle>& triangles(FaceId f) {
    if (triangles_[at(f)].empty())
      triangles_[at(f)] = {{input_.faces(f, 0), input_.faces(f, 1), input_.faces(f, 2)}};
    return triangles_[at(f)];
  }

  // The face's image as a polygon of its corners and the points in use, in a frame isometric to the
  // surface.
  void build_polygon(FaceId f, std::vector<PolygonVertex>& polygon) const {
    polygon.clear();
    const Vector3 a = input_.vertices.row(input_.faces(f, 0));
    const Vector3 b = input_.vertices.row(input_.faces(f, 1));
    const Vector3 c = input_.vertices.row(input_.faces(f, 2));
    const double length = (b - a).norm();
    const Vector3 x = (b - a) / length;
    const double along = (c - a).dot(x);
    std::array<Vector2, 3> corner{Vector2(0.0, 0.0), Vector2(length, 0.0),
                                  Vector2(along, ((c - a) - along * x).norm())};
    // Positions that have no triangle here (the metric came from given lengths): any frame will do.
    if (!(corner[1].x() * corner[2].y() > 0.0))
      corner = {Vector2(0.0, 0.0), Vector2(1.0, 0.0), Vector2(0.5, 0.75)};
    for (Index k = 0; k < 3; ++k) {
      const Side side(map_, 3 * f + k);
      const auto add = [&](Index id, Index place, unsigned sides, const Vector2& domain) {
        const Vector2 uv = side.uv(place);
        polygon.push_back(
            {id, {k, place}, static_cast<std::uint8_t>(sides), domain, uv, as_stored(uv)});
      };
      add(input_.faces(f, k), 0, (1u << k) | (1u << ((k + 2) % 3)), corner[at(k)]);
      for (Index place = 1; place < side.last(); ++place) {
        const std::int64_t p = side.point_at(place);
        if (!uses(p)) continue;
        const Between& share = map_.points[at(p)].along;
        const double from = side.left ? share.source : share.target;
        const double to = side.left ? share.target : share.source;
        add(vertex_count_ + static_cast<Index>(p), place, 1u << k,
            from * corner[at(k)] + to * corner[at((k + 1) % 3)]);
      }
    }
  }

  // The angles that the vertices of a face's polygon have in the development; none where its sides
  // have no points, in use or not. Cost: O(points of the face's sides).
  std::vector<double> developed_angles(FaceId f, const std::vector<PolygonVertex>& polygon) const {
    const std::array<Side, 3> sides{Side(map_, 3 * f), Side(map_, 3 * f + 1),
                                    Side(map_, 3 * f + 2)};
    if (sides[0].last() == 1 && sides[1].last() == 1 && sides[2].last() == 1) return {};
    const std::size_t n = polygon.size();
    std::vector<double> angles(n);
    for (std::size_t i = 0; i < n; ++i) {
      const PolygonVertex& v = polygon[i];
      const PolygonVertex &before = polygon[(i + n - 1) % n], &after = polygon[(i + 1) % n];
      const bool corner = v.place.place == 0;
      const Side &way_in = sides[at(before.place.side)], &way_out = sides[at(v.place.side)];
      const Index place_in = corner ? way_in.last() : v.place.place;
      const Index next = after.place.place == 0 ? way_out.last() : after.place.place;
      double angle = map_.corner_angle[at(3 * f + v.place.side)];
      if (!corner) {
        angle = turn(way_out.uv(v.place.place + 1) - v.uv, way_in.uv(place_in - 1) - v.uv);
        if (angle < 0.0) angle += 2 * std::numbers::pi;
      }
      angles[i] = angle + way_in.winding(v.uv, place_in - 1, before.place.place) -
                  way_out.winding(v.uv, v.place.place + 1, next);
    }
    return angles;
  }

  // Faces whose own triangle is not valid or not the right one.
  std::vector<FaceId> find_bad() const {
    return indices_where(context_, triangles_.size(), kFacesPerChunk, [&](std::size_t i) {
      const auto f = static_cast<FaceId>(i);
      thread_local std::vector<PolygonVertex> p;  // its memory is kept
      build_polygon(f, p);
      if (!valid_triangle(p[0], p[1], p[2], storage_)) return true;
      const std::vector<double> angles = developed_angles(f, p);
      return !angles.empty() && !angles_are_developed(angles, p, {{p[0].id, p[1].id, p[2].id}});
    });
  }

  bool triangulate(FaceId f) {
    build_polygon(f, polygon_);
    const std::vector<double> angles = developed_angles(f, polygon_);
    bool found = false;
    if (by_cells_ || polygon_.size() > kLargePolygon) {
      std::array<Index, 3> count{};
      for (Index k = 0; k < 3; ++k) count[at(k)] = Side(map_, 3 * f + k).last() - 1;
      found =
          triangulate_cells(polygon_, face_chords(count, polygon_), storage_, found_, context_) &&
          angles_are_developed(angles, polygon_, found_);
    }
    if (!found && !triangulate_polygon(polygon_, angles, storage_, found_, context_)) return false;
    triangles_[at(f)] = found_;
    return true;
  }

  // Makes the points of h's edge active that lie so far from each other; true if any was not
  // before.
  bool activate_edge(HalfedgeId h, double gap) {
    const Index e = map_.edge_of[at(h)];
    const HalfedgeId own = map_.edge_halfedge[at(e)];
    const HalfedgeId other = opposite(own);
    const auto same = [this](const Vector2& a, const Vector2& b) {
      return storage_ == Storage::k64Only ? a == b : as_stored(a) == as_stored(b);
    };
    double last = 0.0;
    Vector2 left = map_.corner_uv.row(own);
    Vector2 right = other == kInvalid ? left : Vector2(map_.corner_uv.row(next_corner(other)));
    const Vector2 end_left = map_.corner_uv.row(next_corner(own));
    const Vector2 end_right = other == kInvalid ? end_left : Vector2(map_.corner_uv.row(other));
    bool changed = false;
    const std::int64_t end = map_.begin[at(e) + 1];
    std::int64_t ahead = map_.begin[at(e)];  // the next point in use
    for (std::int64_t p = ahead; p < end; ++p) {
      while (ahead < end && (ahead <= p || !uses(ahead))) ++ahead;
      const EdgePoint& point = map_.points[at(p)];
      const double t = point.along.target;
      const auto apart = [&](const Vector2& on_left, const Vector2& on_right) {
        return !same(point.uv_left, on_left) &&
               (other == kInvalid || !same(point.uv_right, on_right));
      };
      const auto apart_from = [&](const EdgePoint& next) {
        return next.along.target - t >= gap && apart(next.uv_left, next.uv_right);
      };
      const bool keep = uses(p) || (t - last >= gap && point.along.source >= gap &&
                                    apart(left, right) && apart(end_left, end_right) &&
                                    (ahead == end || apart_from(map_.points[at(ahead)])));
      if (!keep) continue;
      changed = changed || !uses(p);
      used_[at(p)] = 1;
      last = t;
      left = point.uv_left;
      right = point.uv_right;
    }
    return changed;
  }

  // Adds the points of bad faces, the nearer ones where the others do not do, until every face has
  // a triangulation or nothing is left to add. Every face enters the queue at most once more than
  // twice for each of its edges.
  void activate(std::vector<FaceId> queue, const std::vector<double>& gaps) {
    std::vector<char> waiting(triangles_.size(), 0), failed(triangles_.size(), 0);
    for (const FaceId f : queue) waiting[at(f)] = 1;
    for (std::size_t i = 0; i < queue.size(); ++i) {
      if (i % 256 == 0) context_.check();
      const FaceId f = queue[i];
      waiting[at(f)] = 0;
      bool done = !by_cells_ && triangulate(f);
      for (std::size_t attempt = 0; !done && attempt < gaps.size(); ++attempt) {
        bool added = by_cells_;
        for (Index k = 0; k < 3; ++k) {
          const HalfedgeId h = 3 * f + k;
          if (!activate_edge(h, gaps[attempt])) continue;
          added = true;
          const HalfedgeId o = opposite(h);
          if (o != kInvalid && !waiting[at(o / 3)]) {
            waiting[at(o / 3)] = 1;
            queue.push_back(o / 3);
          }
        }
        done = added && triangulate(f);
      }
      failed[at(f)] = !done;
    }
    for (FaceId f = 0; f < static_cast<FaceId>(failed.size()); ++f) {
      if (!failed[at(f)]) continue;
      invalid_.push_back(f);
      write_anyway(f);
    }
  }

  // A triangulation that is valid in the input triangle, flips or not: for the report of what
  // failed.
  void write_anyway(FaceId f) {
    build_polygon(f, polygon_);
    for (PolygonVertex& v : polygon_) v.uv = v.domain;
    if (!triangulate_polygon(polygon_, {}, Storage::k64Only, found_, context_)) {
      found_.clear();
      for (std::size_t i = 1; i + 1 < polygon_.size(); ++i)
        found_.push_back({polygon_[0].id, polygon_[i].id, polygon_[i + 1].id});
    }
    triangles_[at(f)] = found_;
  }

  // Removes point p from the triangulations of its faces if they stay valid and good without it.
  bool remove(std::int64_t p, HalfedgeId own) {
    const Index id = vertex_count_ + static_cast<Index>(p);
    std::vector<std::pair<FaceId, std::vector<PolygonTriangle>>> results;
    for (const HalfedgeId h : {own, opposite(own)}) {
      if (h == kInvalid) continue;
      results.emplace_back(h / 3, std::vector<PolygonTriangle>{});
      if (!without(h / 3, id, results.back().second)) return false;
    }
    used_[at(p)] = 0;
    for (const auto& [f, found] : results) {
      build_polygon(f, polygon_);
      if (angles_are_developed(developed_angles(f, polygon_), polygon_, found)) continue;
      used_[at(p)] = 1;
      return false;
    }
    for (auto& [f, found] : results) triangles_[at(f)] = std::move(found);
    return true;
  }

  const PolygonVertex& vertex(Index id) const {
    return *std::find_if(polygon_.begin(), polygon_.end(),
                         [&](const PolygonVertex& v) { return v.id == id; });
  }
  double distortion_of(const PolygonTriangle& t) const {
    return distortion(vertex(t[0]), vertex(t[1]), vertex(t[2]));
  }

  // The face's triangulation with the fan of `id` replaced by triangles without it.
  bool without(FaceId f, Index id, std::vector<PolygonTriangle>& result) {
    build_polygon(f, polygon_);
    double worst = 1.0;
    std::map<Index, Index> link;
    for (const PolygonTriangle& t : triangles(f)) {
      std::size_t k = 0;
      while (k < 3 && t[k] != id) ++k;
      if (k == 3) {
        result.push_back(t);
        continue;
      }
      link.emplace(t[(k + 1) % 3], t[(k + 2) % 3]);
      worst = std::max(worst, distortion_of(t));
    }
    // The fan runs from the point after p on its side to the point before it.
    const std::size_t own = static_cast<std::size_t>(&vertex(id) - polygon_.data());
    const std::size_t n = polygon_.size();
    Index v = polygon_[(own + 1) % n].id;
    hole_.assign(1, vertex(v));
    while (v != polygon_[(own + n - 1) % n].id) {
      const auto next = link.extract(v);
      if (next.empty()) return false;
      v = next.mapped();
      hole_.push_back(vertex(v));
    }
    if (!triangulate_polygon(hole_, {}, storage_, found_, context_)) return false;
    const double bound = std::max(kGoodDistortion, 2.0 * worst);
    result.insert(result.end(), found_.begin(), found_.end());
    return std::all_of(found_.begin(), found_.end(),
                       [&](const PolygonTriangle& t) { return distortion_of(t) <= bound; });
  }

  void thin_out() {
    std::vector<char> frozen(triangles_.size(), 0);
    for (const FaceId f : invalid_) frozen[at(f)] = 1;
    for (int pass = 0; pass < kThinningPasses; ++pass) {
      bool changed = false;
      for (Index e = 0; e < static_cast<Index>(map_.edge_halfedge.size()); ++e) {
        if (e % 1024 == 0) context_.check();
        const HalfedgeId own = map_.edge_halfedge[at(e)];
        const HalfedgeId other = opposite(own);
        if (frozen[at(own / 3)] || (other != kInvalid && frozen[at(other / 3)])) continue;
        for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
          if (!uses(p)) continue;
          context_.check();  // faces may have a hundred thousand points
          if (remove(p, own)) changed = true;
        }
      }
      if (!changed) break;
    }
  }

  RefinedLayout write() {
    RefinedLayout out;
    // Vertices: the input's, then points in use in order.
    out.edge_vertex.assign(map_.points.size(), kInvalid);
    Index count = vertex_count_;
    for (std::size_t p = 0; p < used_.size(); ++p) {
      if (used_[p]) out.edge_vertex[p] = count++;
    }
    write_points(count, out);
    write_faces(out);
    out.invalid = std::move(invalid_);
    return out;
  }

  void write_points(Index count, RefinedLayout& out) const {
    out.surface.vertices.resize(count, 3);
    out.surface.vertices.topRows(vertex_count_) = input_.vertices;
    std::vector<mesh::SurfacePoint>& where = out.provenance.vertex;
    where.resize(at(count));
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(input_.faces.size()); ++h) {
      mesh::SurfacePoint& point = where[at(mesh::source(input_.faces, h))];
      if (point.face == kInvalid) point = {h / 3, Vector3::Unit(h % 3)};
    }
    for (std::size_t e = 0; e < map_.edge_halfedge.size(); ++e) {
      const HalfedgeId h = map_.edge_halfedge[e], next = next_corner(h);
      for (std::int64_t p = map_.begin[e]; p < map_.begin[e + 1]; ++p) {
        const Index v = out.edge_vertex[at(p)];
        if (v == kInvalid) continue;
        const Between& along = map_.points[at(p)].along;
        where[at(v)].face = h / 3;
        where[at(v)].weight[h % 3] = along.source;
        where[at(v)].weight[next % 3] = along.target;
        out.surface.vertices.row(v) =
            along.source * input_.vertices.row(mesh::source(input_.faces, h)) +
            along.target * input_.vertices.row(mesh::source(input_.faces, next));
      }
    }
  }

  void write_faces(RefinedLayout& out) {
    std::size_t total = 0;
    for (const auto& t : triangles_) total += std::max<std::size_t>(1, t.size());
    Triangles faces(static_cast<Index>(total), 3);
    out.uv.resize(faces.size(), 2);
    for (FaceId f = 0; at(f) < triangles_.size(); ++f) {
      if (f % 1024 == 0) context_.check();
      auto row = static_cast<Index>(out.provenance.face.size());
      if (triangles_[at(f)].empty()) {
        faces.row(row) = input_.faces.row(f);
        out.uv.middleRows(3 * row, 3) = map_.corner_uv.middleRows(3 * f, 3);
        out.provenance.face.push_back(f);
        continue;
      }
      build_polygon(f, polygon_);
      for (const PolygonTriangle& t : triangles_[at(f)]) {
        if (row % 1024 == 0) context_.check();
        for (Index k = 0; k < 3; ++k) {
          const Index id = t[at(k)];
          faces(row, k) = id < vertex_count_ ? id : out.edge_vertex[at(id - vertex_count_)];
          out.uv.row(3 * row + k) = vertex(id).uv;
        }
        out.provenance.face.push_back(f);
        ++row;
      }
    }
    out.surface.faces = std::move(faces);
  }
};

}  // namespace

RefinedLayout refine_map(const mesh::Surface& input, const EdgePointMap& map, Refinement refinement,
                         Storage storage, const ExecutionContext& context) {
  RefinedLayout out = MapRefiner(input, map, storage, context).run(refinement);
  debug_check("refine_map", [&] { return find_broken_invariant(input, out); });
  return out;
}

}  // namespace flipfree::intrinsic
