#include "flipfree/intrinsic/layout/refine_map.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
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
  Index place_of(std::int64_t p) const {
    return static_cast<Index>(left ? p - begin + 1 : end - p);
  }

  // How far the direction from `origin` to the side turns between two places.
  double winding(const Vector2& origin, Index from, Index to) const {
    double sum = 0.0;
    const Index step = to > from ? 1 : -1;
    for (Index i = from; i != to; i += step) sum += turn(uv(i) - origin, uv(i + step) - origin);
    return sum;
  }
};

// The angles that the vertices of a polygon have in the development. `polygon`: corners and some
// points of face f in counter-clockwise order, corner 0 first; ids are vertices of the input below
// `vertex_count`, else vertex_count + point. Cost: O(points of the face's sides).
std::vector<double> developed_angles(const EdgePointMap& map, Index vertex_count, FaceId f,
                                     const std::vector<PolygonVertex>& polygon) {
  const std::size_t n = polygon.size();
  std::vector<double> angles(n);
  const std::array<Side, 3> sides{Side(map, 3 * f), Side(map, 3 * f + 1), Side(map, 3 * f + 2)};
  std::size_t side = 2;  // of the way into the current vertex
  for (std::size_t i = 0; i < n; ++i) {
    const PolygonVertex& v = polygon[i];
    const PolygonVertex &before = polygon[(i + n - 1) % n], &after = polygon[(i + 1) % n];
    const bool corner = v.id < vertex_count;
    const std::size_t in = side;
    if (corner) side = i == 0 ? 0 : side + 1;
    const Side &way_in = sides[in], &way_out = sides[side];
    const Index place_in = corner ? way_in.last() : way_in.place_of(v.id - vertex_count);
    const Index place_out = corner ? 0 : place_in;
    const Index previous = before.id < vertex_count ? 0 : way_in.place_of(before.id - vertex_count);
    const Index next =
        after.id < vertex_count ? way_out.last() : way_out.place_of(after.id - vertex_count);
    const Vector2 origin(v.uv[0], v.uv[1]);
    double angle = 0.0;
    if (corner) {
      angle = map.corner_angle[at(3 * f + static_cast<Index>(side))];
    } else {
      angle = turn(way_out.uv(place_out + 1) - origin, way_in.uv(place_in - 1) - origin);
      if (angle < 0.0) angle += 2 * std::numbers::pi;
    }
    angles[i] = angle + way_in.winding(origin, place_in - 1, previous) -
                way_out.winding(origin, place_out + 1, next);
  }
  return angles;
}

// True if at every vertex of the polygon the angles of the triangles (given by ids) sum to the
// developed one, up to less than a turn.
bool angles_are_developed(const std::vector<double>& developed,
                          const std::vector<PolygonVertex>& polygon,
                          const std::vector<std::array<Index, 3>>& triangles) {
  std::vector<double> left = developed;
  std::array<std::size_t, 3> place{};
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      place[k] = 0;
      while (polygon[place[k]].id != t[k]) ++place[k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      left[place[k]] -=
          corner_angle(polygon[place[k]], polygon[place[(k + 1) % 3]], polygon[place[(k + 2) % 3]]);
    }
  }
  for (const double angle : left) {
    if (!(std::abs(angle) < kAngleSlack)) return false;
  }
  return true;
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

IndexPairs edges_on(const Triangles& faces, const EdgePointMap& map,
                    const std::vector<char>& flagged, const RefinedLayout& layout) {
  std::vector<std::array<Index, 2>> pairs;
  for (std::size_t e = 0; e < flagged.size(); ++e) {
    if (flagged[e] == 0) continue;
    const HalfedgeId h = map.edge_halfedge[e];
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

constexpr std::size_t kTriangulationsPerChunk = 4096;  // of what threads share

void set_uv(PolygonVertex& v, const Vector2& uv) {
  v.uv = {uv.x(), uv.y()};
  v.uv32 = {static_cast<float>(uv.x()), static_cast<float>(uv.y())};
}

// Which points of a map's edges are in use, and how each face is triangulated with them: what
// refine_map() works on.
class FaceTriangulations {
 public:
  using Triangle = std::array<Index, 3>;  // vertices of the input; vertex count + p is point p

  // No point in use, every face whole. The arguments must outlive this.
  FaceTriangulations(const mesh::Surface& input, const EdgePointMap& map)
      : input_(input),
        map_(map),
        vertex_count_(static_cast<Index>(input.vertices.rows())),
        active_(map.points.size(), 0),
        slot_(static_cast<std::size_t>(input.faces.rows()), kInvalid) {}

  Index vertex_count() const { return vertex_count_; }
  std::size_t face_count() const { return slot_.size(); }
  bool uses(std::int64_t p) const { return active_[static_cast<std::size_t>(p)] != 0; }
  void use(std::int64_t p, bool used) { active_[static_cast<std::size_t>(p)] = used ? 1 : 0; }

  // Does any side of the face have points, in use or not?
  bool has_points(FaceId f) const { return point_counts(f) != std::array<Index, 3>{}; }
  // Points on each side of the face, in use or not, and where those in use and the corners lie: one
  // place per vertex of the polygon.
  std::array<Index, 3> point_counts(FaceId f) const {
    std::array<Index, 3> count{};
    for (Index k = 0; k < 3; ++k) count[at(k)] = Side(map_, 3 * f + k).last() - 1;
    return count;
  }
  std::vector<SidePlace> places(FaceId f) const {
    std::vector<SidePlace> places;
    for (Index k = 0; k < 3; ++k) {
      const Side side(map_, 3 * f + k);
      places.push_back({k, 0});
      for (Index place = 1; place < side.last(); ++place) {
        if (uses(side.point_at(place))) places.push_back({k, place});
      }
    }
    return places;
  }
  // The face's image as a polygon of its corners and the points in use, in a frame isometric to the
  // surface.
  void build_polygon(FaceId f, std::vector<PolygonVertex>& polygon) const;
  // The face's own triangles, to be changed.
  std::vector<Triangle>& triangles(FaceId f) {
    if (slot_[at(f)] == kInvalid) {
      slot_[at(f)] = static_cast<Index>(triangulations_.size());
      triangulations_.push_back({{input_.faces(f, 0), input_.faces(f, 1), input_.faces(f, 2)}});
    }
    return triangulations_[at(slot_[at(f)])];
  }

  // The refined surface and its UVs; `invalid` is left empty. Cost: O(#F + points).
  RefinedLayout write(const ExecutionContext& context) const {
    RefinedLayout out;
    // Vertices: the input's, then active points in order.
    out.edge_vertex.assign(map_.points.size(), kInvalid);
    Index count = vertex_count_;
    for (std::size_t p = 0; p < active_.size(); ++p) {
      if (active_[p]) out.edge_vertex[p] = count++;
    }
    write_points(count, out);
    write_faces(out, context);
    return out;
  }

 private:
  void write_points(Index count, RefinedLayout& out) const;
  void write_faces(RefinedLayout& out, const ExecutionContext& context) const;

  const mesh::Surface& input_;
  const EdgePointMap& map_;
  Index vertex_count_;
  std::vector<char> active_;  // per point
  std::vector<Index> slot_;   // per face: its triangulation, kInvalid = the face itself
  std::vector<std::vector<Triangle>> triangulations_;
};

void FaceTriangulations::build_polygon(FaceId f, std::vector<PolygonVertex>& polygon) const {
  polygon.clear();
  const Vector3 a = input_.vertices.row(input_.faces(f, 0));
  const Vector3 b = input_.vertices.row(input_.faces(f, 1));
  const Vector3 c = input_.vertices.row(input_.faces(f, 2));
  const double length = (b - a).norm();
  const Vector3 x = (b - a) / length;
  const double along = (c - a).dot(x);
  std::array<std::array<double, 2>, 3> corner{
      {{0.0, 0.0}, {length, 0.0}, {along, ((c - a) - along * x).norm()}}};
  // Positions that have no triangle here (the metric came from given lengths): any frame will do.
  if (!(corner[1][0] * corner[2][1] > 0.0)) corner = {{{0.0, 0.0}, {1.0, 0.0}, {0.5, 0.75}}};
  for (Index k = 0; k < 3; ++k) {
    const HalfedgeId h = 3 * f + k;
    PolygonVertex v;
    v.id = input_.faces(f, k);
    v.sides = static_cast<std::uint8_t>((1u << k) | (1u << ((k + 2) % 3)));
    v.domain = corner[at(k)];
    set_uv(v, map_.corner_uv.row(h));
    polygon.push_back(v);
    const Side side(map_, h);
    for (Index place = 1; place < side.last(); ++place) {
      const std::int64_t p = side.point_at(place);
      if (!uses(p)) continue;
      const EdgePoint& point = map_.points[at(p)];
      const double from = side.left ? point.along.source : point.along.target;
      const double to = side.left ? point.along.target : point.along.source;
      const auto& s = corner[at(k)];
      const auto& t = corner[at((k + 1) % 3)];
      v.id = vertex_count_ + static_cast<Index>(p);
      v.sides = static_cast<std::uint8_t>(1u << k);
      v.domain = {from * s[0] + to * t[0], from * s[1] + to * t[1]};
      set_uv(v, side.uv(place));
      polygon.push_back(v);
    }
  }
}

void FaceTriangulations::write_points(Index count, RefinedLayout& out) const {
  out.surface.vertices.resize(count, 3);
  out.surface.vertices.topRows(vertex_count_) = input_.vertices;
  std::vector<mesh::SurfacePoint>& where = out.provenance.vertex;
  where.resize(at(count));
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(input_.faces.rows()); ++h) {
    const Index v = input_.faces(h / 3, h % 3);
    if (where[at(v)].face != kInvalid) continue;
    where[at(v)].face = h / 3;
    where[at(v)].weight[h % 3] = 1.0;
  }
  for (Index e = 0; e < static_cast<Index>(map_.edge_halfedge.size()); ++e) {
    const HalfedgeId h = map_.edge_halfedge[at(e)];
    const HalfedgeId next = next_corner(h);
    for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
      const Index v = out.edge_vertex[at(p)];
      if (v == kInvalid) continue;
      const Between& along = map_.points[at(p)].along;
      where[at(v)].face = h / 3;
      where[at(v)].weight[h % 3] = along.source;
      where[at(v)].weight[next % 3] = along.target;
      out.surface.vertices.row(v) =
          along.source * input_.vertices.row(input_.faces(h / 3, h % 3)) +
          along.target * input_.vertices.row(input_.faces(h / 3, next % 3));
    }
  }
}

void FaceTriangulations::write_faces(RefinedLayout& out, const ExecutionContext& context) const {
  std::vector<Index> first_row(slot_.size() + 1, 0);
  for (std::size_t f = 0; f < slot_.size(); ++f) {
    const Index s = slot_[f];
    first_row[f + 1] =
        first_row[f] + (s == kInvalid ? 1 : static_cast<Index>(triangulations_[at(s)].size()));
  }
  const Index total = first_row.back();
  Triangles faces(total, 3);
  out.uv.resize(3 * total, 2);
  out.provenance.face.resize(at(total));
  const auto write_face = [&](FaceId f, std::vector<PolygonVertex>& polygon) {
    Index row = first_row[at(f)];
    if (slot_[at(f)] == kInvalid) {
      faces.row(row) = input_.faces.row(f);
      out.uv.middleRows(3 * row, 3) = map_.corner_uv.middleRows(3 * f, 3);
      out.provenance.face[at(row)] = f;
      return;
    }
    build_polygon(f, polygon);
    for (const Triangle& t : triangulations_[at(slot_[at(f)])]) {
      for (Index k = 0; k < 3; ++k) {
        const Index id = t[at(k)];
        faces(row, k) = id < vertex_count_ ? id : out.edge_vertex[at(id - vertex_count_)];
        for (const PolygonVertex& v : polygon) {
          if (v.id == id) out.uv.row(3 * row + k) = Vector2(v.uv[0], v.uv[1]);
        }
      }
      out.provenance.face[at(row++)] = f;
    }
  };
  parallel_for(context, slot_.size(), kTriangulationsPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::vector<PolygonVertex> polygon;
                 for (auto f = static_cast<FaceId>(begin); f < static_cast<FaceId>(end); ++f)
                   write_face(f, polygon);
               });
  out.surface.faces = std::move(faces);
}

// Points nearer to each other or to an end than this part of their edge are not told apart: the
// 32-bit positions that Blender stores could not hold them either.
constexpr double kLeastGap = 1e-6;
// A point is taken out if the triangles around it get no more distorted by it than this (K = |J|^2
// / (2 det J), 1 = conformal), or twice what they were.
constexpr double kGoodDistortion = 8.0;
constexpr int kThinningPasses = 4;
// From so many vertices on the cells are tried before the search among all diagonals.
constexpr std::size_t kLargePolygon = 48;
constexpr std::size_t kFacesPerChunk = 4096;  // of what threads share

class MapRefiner {
 public:
  MapRefiner(const mesh::Surface& input, const mesh::Adjacency& adjacency, const EdgePointMap& map,
             Storage storage, const ExecutionContext& context)
      : adjacency_(adjacency),
        map_(map),
        storage_(storage),
        context_(context),
        faces_(input, map) {}

  void run(Refinement refinement) {
    const auto faces = static_cast<FaceId>(faces_.face_count());
    std::vector<FaceId> bad = find_bad();
    if (refinement == Refinement::kNever) {
      invalid = bad;
      return;
    }
    if (refinement == Refinement::kFull) {
      bad.resize(at(faces));
      for (FaceId f = 0; f < faces; ++f) bad[at(f)] = f;
    }
    by_cells_ = refinement == Refinement::kFull;
    activate(bad, by_cells_);
    if (refinement == Refinement::kAuto) thin_out();
  }

  RefinedLayout write() {
    RefinedLayout out = faces_.write(context_);
    out.invalid = std::move(invalid);
    return out;
  }

  std::vector<FaceId> invalid;

 private:
  using Triangle = FaceTriangulations::Triangle;

  const mesh::Adjacency& adjacency_;
  const EdgePointMap& map_;
  Storage storage_;
  const ExecutionContext& context_;
  FaceTriangulations faces_;
  bool by_cells_ = false;  // along the final triangulation's edges wherever that is possible
  // Scratch, kept to avoid allocation.
  std::vector<PolygonVertex> polygon_, hole_;
  std::vector<PolygonTriangle> local_;

  // Faces whose own triangle is not valid or not the right one.
  std::vector<FaceId> find_bad() const {
    const std::size_t faces = faces_.face_count();
    std::vector<std::vector<FaceId>> found(chunk_count(faces, kFacesPerChunk));
    parallel_for(context_, faces, kFacesPerChunk,
                 [&](std::size_t begin, std::size_t end, std::size_t chunk) {
                   std::vector<PolygonVertex> p;
                   for (auto f = static_cast<FaceId>(begin); f < static_cast<FaceId>(end); ++f) {
                     faces_.build_polygon(f, p);
                     const Triangle whole{p[0].id, p[1].id, p[2].id};
                     if (!valid_triangle(p[0], p[1], p[2], storage_) ||
                         (faces_.has_points(f) &&
                          !angles_are_developed(developed_angles(map_, faces_.vertex_count(), f, p),
                                                p, {whole}))) {
                       found[chunk].push_back(f);
                     }
                   }
                 });
    std::vector<FaceId> bad;
    for (const auto& part : found) bad.insert(bad.end(), part.begin(), part.end());
    return bad;
  }

  bool triangulate(FaceId f) {
    faces_.build_polygon(f, polygon_);
    const std::vector<double> angles =
        faces_.has_points(f) ? developed_angles(map_, faces_.vertex_count(), f, polygon_)
                             : std::vector<double>();
    std::vector<Triangle> found;
    if (!find_triangles(f, angles, found)) return false;
    faces_.triangles(f) = std::move(found);
    return true;
  }

  // The triangles of polygon_, the image of face f.
  bool find_triangles(FaceId f, const std::vector<double>& angles, std::vector<Triangle>& found) {
    const auto named = [&] {
      found.clear();
      for (const PolygonTriangle& t : local_)
        found.push_back({polygon_[at(t[0])].id, polygon_[at(t[1])].id, polygon_[at(t[2])].id});
      return true;
    };
    const auto cells = [&] {
      return triangulate_cells(polygon_, face_chords(faces_.point_counts(f), faces_.places(f)),
                               storage_, local_, context_) &&
             named() && (angles.empty() || angles_are_developed(angles, polygon_, found));
    };
    const bool large = polygon_.size() > kLargePolygon;
    if ((by_cells_ || large) && cells()) return true;
    return triangulate_polygon(polygon_, angles, storage_, local_, context_) && named();
  }
  // Makes the points of h's edge active that can be told apart from each other; true if any was not
  // before.
  bool activate_edge(HalfedgeId h, bool all) {
    const Index e = map_.edge_of[at(h)];
    const HalfedgeId own = map_.edge_halfedge[at(e)];
    const HalfedgeId other = adjacency_.opposite[at(own)];
    const auto same = [this](const Vector2& a, const Vector2& b) {
      if (storage_ == Storage::k64Only) return a == b;
      return static_cast<float>(a.x()) == static_cast<float>(b.x()) &&
             static_cast<float>(a.y()) == static_cast<float>(b.y());
    };
    const double gap = all ? 1e-14 : kLeastGap;
    double last = 0.0;
    Vector2 left = map_.corner_uv.row(own);
    Vector2 right = other == kInvalid ? left : Vector2(map_.corner_uv.row(next_corner(other)));
    const Vector2 end_left = map_.corner_uv.row(next_corner(own));
    const Vector2 end_right = other == kInvalid ? end_left : Vector2(map_.corner_uv.row(other));
    bool changed = false;
    for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
      const EdgePoint& point = map_.points[at(p)];
      const double t = point.along.target;
      const bool keep =
          faces_.uses(p) || (t - last >= gap && point.along.source >= gap &&
                             !same(point.uv_left, left) && !same(point.uv_left, end_left) &&
                             (other == kInvalid ||
                              (!same(point.uv_right, right) && !same(point.uv_right, end_right))));
      if (!keep) continue;
      if (!faces_.uses(p)) changed = true;
      faces_.use(p, true);
      last = t;
      left = point.uv_left;
      right = point.uv_right;
    }
    return changed;
  }

  // Adds the points of bad faces until every face has a triangulation or nothing is left to add.
  // Every face enters the queue at most once more than it has edges.
  void activate(std::vector<FaceId> queue, bool all) {
    std::vector<char> waiting(faces_.face_count(), 0);
    for (const FaceId f : queue) waiting[at(f)] = 1;
    std::vector<char> failed(faces_.face_count(), 0);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      if (i % 256 == 0) context_.check();
      const FaceId f = queue[i];
      waiting[at(f)] = 0;
      if (!all && triangulate(f)) {
        failed[at(f)] = 0;
        continue;
      }
      for (Index k = 0; k < 3; ++k) {
        const HalfedgeId h = 3 * f + k;
        if (!activate_edge(h, all)) continue;
        const HalfedgeId o = adjacency_.opposite[at(h)];
        if (o != kInvalid && !waiting[at(o / 3)]) {
          waiting[at(o / 3)] = 1;
          queue.push_back(o / 3);
        }
      }
      failed[at(f)] = !triangulate(f);
    }
    for (FaceId f = 0; f < static_cast<FaceId>(failed.size()); ++f) {
      if (!failed[at(f)]) continue;
      invalid.push_back(f);
      write_anyway(f);
    }
  }

  // A triangulation that is valid in the input triangle, flips or not: for the report of what
  // failed.
  void write_anyway(FaceId f) {
    faces_.build_polygon(f, polygon_);
    for (PolygonVertex& v : polygon_) v.uv = v.domain;
    std::vector<Triangle>& out = faces_.triangles(f);
    if (!triangulate_polygon(polygon_, {}, Storage::k64Only, local_, context_)) {
      local_.clear();
      for (Index i = 1; i + 1 < static_cast<Index>(polygon_.size()); ++i)
        local_.push_back({0, i, i + 1});
    }
    out.clear();
    for (const PolygonTriangle& t : local_) {
      out.push_back({polygon_[at(t[0])].id, polygon_[at(t[1])].id, polygon_[at(t[2])].id});
    }
  }

  // Removes point p from the triangulations of its faces if they stay valid and good without it.
  bool remove(std::int64_t p, HalfedgeId own) {
    const HalfedgeId other = adjacency_.opposite[at(own)];
    const Index id = faces_.vertex_count() + static_cast<Index>(p);
    std::array<FaceId, 2> faces{own / 3, other == kInvalid ? kInvalid : other / 3};
    std::array<std::vector<Triangle>, 2> result;
    for (std::size_t side = 0; side < 2; ++side) {
      if (faces[side] == kInvalid) continue;
      if (!without(faces[side], id, result[side])) return false;
    }
    faces_.use(p, false);
    for (std::size_t side = 0; side < 2; ++side) {
      if (faces[side] == kInvalid) continue;
      faces_.build_polygon(faces[side], polygon_);
      if (angles_are_developed(developed_angles(map_, faces_.vertex_count(), faces[side], polygon_),
                               polygon_, result[side]))
        continue;
      faces_.use(p, true);
      return false;
    }
    for (std::size_t side = 0; side < 2; ++side) {
      if (faces[side] != kInvalid) faces_.triangles(faces[side]) = std::move(result[side]);
    }
    return true;
  }

  // The face's triangulation with the fan of `id` replaced by triangles without it.
  bool without(FaceId f, Index id, std::vector<Triangle>& result) {
    faces_.build_polygon(f, polygon_);
    const auto position = [&](Index v) {
      for (std::size_t i = 0; i < polygon_.size(); ++i) {
        if (polygon_[i].id == v) return i;
      }
      return polygon_.size();
    };
    const std::size_t own = position(id), n = polygon_.size();
    hole_.clear();
    double worst_before = 1.0;
    std::vector<std::array<Index, 2>> link;
    for (const Triangle& t : faces_.triangles(f)) {
      std::size_t k = 0;
      while (k < 3 && t[k] != id) ++k;
      if (k == 3) {
        result.push_back(t);
        continue;
      }
      const Index b = t[(k + 1) % 3], c = t[(k + 2) % 3];
      link.push_back({b, c});
      worst_before = std::max(
          worst_before, distortion(polygon_[own], polygon_[position(b)], polygon_[position(c)]));
    }
    // The fan runs from the point after p on its side to the point before it.
    Index v = polygon_[(own + 1) % n].id;
    const Index last = polygon_[(own + n - 1) % n].id;
    hole_.push_back(polygon_[position(v)]);
    for (std::size_t guard = 0; v != last && guard <= link.size(); ++guard) {
      for (const auto& [b, c] : link) {
        if (b == v) {
          v = c;
          hole_.push_back(polygon_[position(v)]);
          break;
        }
      }
    }
    if (v != last || !triangulate_polygon(hole_, {}, storage_, local_, context_)) return false;
    const double bound = std::max(kGoodDistortion, 2.0 * worst_before);
    for (const PolygonTriangle& t : local_) {
      const PolygonVertex &a = hole_[at(t[0])], &b = hole_[at(t[1])], &c = hole_[at(t[2])];
      if (!(distortion(a, b, c) <= bound)) return false;
      result.push_back({a.id, b.id, c.id});
    }
    return true;
  }
  static double distortion(const PolygonVertex& a, const PolygonVertex& b, const PolygonVertex& c) {
    const double area = (b.domain[0] - a.domain[0]) * (c.domain[1] - a.domain[1]) -
                        (b.domain[1] - a.domain[1]) * (c.domain[0] - a.domain[0]);
    return distortion_cost(a, b, c) / area;
  }

  void thin_out() {
    std::vector<char> frozen(faces_.face_count(), 0);
    for (const FaceId f : invalid) frozen[at(f)] = 1;
    for (int pass = 0; pass < kThinningPasses; ++pass) {
      bool changed = false;
      for (Index e = 0; e < static_cast<Index>(map_.edge_halfedge.size()); ++e) {
        if (e % 1024 == 0) context_.check();
        const HalfedgeId own = map_.edge_halfedge[at(e)];
        const HalfedgeId other = adjacency_.opposite[at(own)];
        if (frozen[at(own / 3)] || (other != kInvalid && frozen[at(other / 3)])) continue;
        for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
          if (!faces_.uses(p)) continue;
          context_.check();  // faces may have a hundred thousand points
          if (remove(p, own)) changed = true;
        }
      }
      if (!changed) break;
    }
  }
};

}  // namespace

RefinedLayout refine_map(const mesh::Surface& input, const mesh::Adjacency& adjacency,
                         const EdgePointMap& map, Refinement refinement, Storage storage,
                         const ExecutionContext& context) {
  MapRefiner refiner(input, adjacency, map, storage, context);
  refiner.run(refinement);
  RefinedLayout out = refiner.write();
  debug_check("refine_map", [&] { return find_broken_invariant(input, out); });
  return out;
}

}  // namespace flipfree::intrinsic
