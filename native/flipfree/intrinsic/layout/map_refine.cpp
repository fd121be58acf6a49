#include "flipfree/intrinsic/layout/map_refine.h"

#include <algorithm>
#include <cmath>

#include "flipfree/base/parallel.h"
#include "flipfree/intrinsic/layout/developed_angles.h"
#include "flipfree/intrinsic/layout/polygon_triangulation.h"

namespace flipfree::intrinsic {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }
std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

// Points nearer to each other or to an end than this part of their edge are not told apart: the
// 32-bit positions that Blender stores could not hold them either.
constexpr double kLeastGap = 1e-6;
// A point is taken out if the triangles around it get no more distorted by it than this (K = |J|^2
// / (2 det J), 1 = conformal), or twice what they were.
constexpr double kGoodDistortion = 8.0;
constexpr int kThinningPasses = 4;
constexpr std::size_t kFacesPerChunk = 4096;  // of what threads share

class Refiner {
 public:
  Refiner(const mesh::Surface& input, const mesh::Adjacency& adjacency, const EdgePointMap& map,
          Storage storage)
      : input_(input),
        adjacency_(adjacency),
        map_(map),
        storage_(storage),
        vertex_count_(static_cast<Index>(input.vertices.rows())),
        active_(map.points.size(), 0),
        slot_(at(static_cast<Index>(input.faces.rows())), kInvalid) {}

  void run(Refinement refinement, const ExecutionContext& context) {
    const auto faces = static_cast<FaceId>(input_.faces.rows());
    std::vector<FaceId> bad = find_bad(context);
    if (refinement == Refinement::kNever) {
      invalid = bad;
      return;
    }
    if (refinement == Refinement::kFull) {
      bad.resize(at(faces));
      for (FaceId f = 0; f < faces; ++f) bad[at(f)] = f;
    }
    activate(bad, refinement == Refinement::kFull, context);
    if (refinement == Refinement::kAuto) thin_out(context);
  }

  RefinedLayout write(const ExecutionContext& context) const;

  std::vector<FaceId> invalid;

 private:
  using GlobalTriangle = std::array<Index, 3>;  // vertex ids; point p is vertex_count_ + p

  const mesh::Surface& input_;
  const mesh::Adjacency& adjacency_;
  const EdgePointMap& map_;
  Storage storage_;
  Index vertex_count_;
  std::vector<char> active_;  // per point
  std::vector<Index> slot_;   // per face: its triangulation, kInvalid = the face itself
  std::vector<std::vector<GlobalTriangle>> triangulations_;
  // Scratch, kept to avoid allocation.
  std::vector<PolygonVertex> polygon_, hole_;
  std::vector<PolygonTriangle> local_;

  bool is_left(HalfedgeId h) const { return map_.edge_halfedge[at(map_.edge_of[at(h)])] == h; }

  void write_faces(RefinedLayout& out, const ExecutionContext& context) const;

  // Faces whose own triangle is not valid or not the right one.
  std::vector<FaceId> find_bad(const ExecutionContext& context) const {
    const std::size_t faces = slot_.size();
    std::vector<std::vector<FaceId>> found(chunk_count(faces, kFacesPerChunk));
    parallel_for(
        context, faces, kFacesPerChunk, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
          std::vector<PolygonVertex> p;
          for (auto f = static_cast<FaceId>(begin); f < static_cast<FaceId>(end); ++f) {
            build_polygon(f, p);
            const GlobalTriangle whole{p[0].id, p[1].id, p[2].id};
            if (!valid_triangle(p[0], p[1], p[2], storage_) ||
                (has_points(f) &&
                 !angles_are_developed(developed_angles(map_, vertex_count_, f, p), p, {whole}))) {
              found[chunk].push_back(f);
            }
          }
        });
    std::vector<FaceId> bad;
    for (const auto& part : found) bad.insert(bad.end(), part.begin(), part.end());
    return bad;
  }

  // The face's image as a polygon of its corners and active points, in a frame isometric to the
  // surface.
  void build_polygon(FaceId f, std::vector<PolygonVertex>& polygon) const {
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
      const bool left = is_left(h);
      const Index e = map_.edge_of[at(h)];
      const std::int64_t begin = map_.begin[at(e)], end = map_.begin[at(e) + 1];
      for (std::int64_t i = 0; i < end - begin; ++i) {
        const std::int64_t p = left ? begin + i : end - 1 - i;
        if (!active_[at(p)]) continue;
        const EdgePoint& point = map_.points[at(p)];
        const double from = left ? point.along.source : point.along.target;
        const double to = left ? point.along.target : point.along.source;
        const auto& s = corner[at(k)];
        const auto& t = corner[at((k + 1) % 3)];
        v.id = vertex_count_ + static_cast<Index>(p);
        v.sides = static_cast<std::uint8_t>(1u << k);
        v.domain = {from * s[0] + to * t[0], from * s[1] + to * t[1]};
        set_uv(v, left ? point.uv_left : point.uv_right);
        polygon.push_back(v);
      }
    }
  }
  static void set_uv(PolygonVertex& v, const Vector2& uv) {
    v.uv = {uv.x(), uv.y()};
    v.uv32 = {static_cast<float>(uv.x()), static_cast<float>(uv.y())};
  }

  bool triangulate(FaceId f) {
    build_polygon(f, polygon_);
    const std::vector<double> angles =
        has_points(f) ? developed_angles(map_, vertex_count_, f, polygon_) : std::vector<double>();
    if (!triangulate_polygon(polygon_, angles, storage_, local_)) return false;
    std::vector<GlobalTriangle> found;
    for (const PolygonTriangle& t : local_) {
      found.push_back({polygon_[at(t[0])].id, polygon_[at(t[1])].id, polygon_[at(t[2])].id});
    }
    triangulation(f) = std::move(found);
    return true;
  }
  // Does any side of the face have points, active or not?
  bool has_points(FaceId f) const {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const Index e = map_.edge_of[at(h)];
      if (map_.begin[at(e)] != map_.begin[at(e) + 1]) return true;
    }
    return false;
  }
  std::vector<GlobalTriangle>& triangulation(FaceId f) {
    if (slot_[at(f)] == kInvalid) {
      slot_[at(f)] = static_cast<Index>(triangulations_.size());
      triangulations_.emplace_back();
      triangulations_.back().push_back(
          {input_.faces(f, 0), input_.faces(f, 1), input_.faces(f, 2)});
    }
    return triangulations_[at(slot_[at(f)])];
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
          active_[at(p)] || (t - last >= gap && point.along.source >= gap &&
                             !same(point.uv_left, left) && !same(point.uv_left, end_left) &&
                             (other == kInvalid ||
                              (!same(point.uv_right, right) && !same(point.uv_right, end_right))));
      if (!keep) continue;
      if (!active_[at(p)]) changed = true;
      active_[at(p)] = 1;
      last = t;
      left = point.uv_left;
      right = point.uv_right;
    }
    return changed;
  }

  // Adds the points of bad faces until every face has a triangulation or nothing is left to add.
  // Every face enters the queue at most once more than it has edges.
  void activate(std::vector<FaceId> queue, bool all, const ExecutionContext& context) {
    std::vector<char> waiting(slot_.size(), 0);
    for (const FaceId f : queue) waiting[at(f)] = 1;
    std::vector<char> failed(slot_.size(), 0);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      if (i % 256 == 0) context.check();
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
    build_polygon(f, polygon_);
    for (PolygonVertex& v : polygon_) v.uv = v.domain;
    std::vector<GlobalTriangle>& out = triangulation(f);
    if (!triangulate_polygon(polygon_, {}, Storage::k64Only, local_)) {
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
    const Index id = vertex_count_ + static_cast<Index>(p);
    std::array<FaceId, 2> faces{own / 3, other == kInvalid ? kInvalid : other / 3};
    std::array<std::vector<GlobalTriangle>, 2> result;
    for (std::size_t side = 0; side < 2; ++side) {
      if (faces[side] == kInvalid) continue;
      if (!without(faces[side], id, result[side])) return false;
    }
    active_[at(p)] = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      if (faces[side] == kInvalid) continue;
      build_polygon(faces[side], polygon_);
      if (angles_are_developed(developed_angles(map_, vertex_count_, faces[side], polygon_),
                               polygon_, result[side]))
        continue;
      active_[at(p)] = 1;
      return false;
    }
    for (std::size_t side = 0; side < 2; ++side) {
      if (faces[side] != kInvalid) triangulation(faces[side]) = std::move(result[side]);
    }
    return true;
  }

  // The face's triangulation with the fan of `id` replaced by triangles without it.
  bool without(FaceId f, Index id, std::vector<GlobalTriangle>& result) {
    build_polygon(f, polygon_);
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
    for (const GlobalTriangle& t : triangulation(f)) {
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
    if (v != last || !triangulate_polygon(hole_, {}, storage_, local_)) return false;
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

  void thin_out(const ExecutionContext& context) {
    std::vector<char> frozen(slot_.size(), 0);
    for (const FaceId f : invalid) frozen[at(f)] = 1;
    for (int pass = 0; pass < kThinningPasses; ++pass) {
      bool changed = false;
      for (Index e = 0; e < static_cast<Index>(map_.edge_halfedge.size()); ++e) {
        if (e % 1024 == 0) context.check();
        const HalfedgeId own = map_.edge_halfedge[at(e)];
        const HalfedgeId other = adjacency_.opposite[at(own)];
        if (frozen[at(own / 3)] || (other != kInvalid && frozen[at(other / 3)])) continue;
        for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
          if (active_[at(p)] && remove(p, own)) changed = true;
        }
      }
      if (!changed) break;
    }
  }
};

RefinedLayout Refiner::write(const ExecutionContext& context) const {
  RefinedLayout out;
  out.invalid = invalid;
  // Vertices: the input's, then active points in order.
  out.edge_vertex.assign(map_.points.size(), kInvalid);
  Index count = vertex_count_;
  for (std::size_t p = 0; p < active_.size(); ++p) {
    if (active_[p]) out.edge_vertex[p] = count++;
  }
  out.surface.vertices.resize(count, 3);
  out.surface.vertices.topRows(vertex_count_) = input_.vertices;
  out.vertex_parent.assign(at(count), kInvalid);
  out.vertex_barycentric.setZero(count, 3);
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(input_.faces.rows()); ++h) {
    const Index v = input_.faces(h / 3, h % 3);
    if (out.vertex_parent[at(v)] != kInvalid) continue;
    out.vertex_parent[at(v)] = h / 3;
    out.vertex_barycentric(v, h % 3) = 1.0;
  }
  for (Index e = 0; e < static_cast<Index>(map_.edge_halfedge.size()); ++e) {
    const HalfedgeId h = map_.edge_halfedge[at(e)];
    const HalfedgeId next = next_corner(h);
    for (std::int64_t p = map_.begin[at(e)]; p < map_.begin[at(e) + 1]; ++p) {
      const Index v = out.edge_vertex[at(p)];
      if (v == kInvalid) continue;
      const Between& along = map_.points[at(p)].along;
      out.vertex_parent[at(v)] = h / 3;
      out.vertex_barycentric(v, h % 3) = along.source;
      out.vertex_barycentric(v, next % 3) = along.target;
      out.surface.vertices.row(v) =
          along.source * input_.vertices.row(input_.faces(h / 3, h % 3)) +
          along.target * input_.vertices.row(input_.faces(h / 3, next % 3));
    }
  }
  write_faces(out, context);
  return out;
}

void Refiner::write_faces(RefinedLayout& out, const ExecutionContext& context) const {
  std::vector<Index> first_row(slot_.size() + 1, 0);
  for (std::size_t f = 0; f < slot_.size(); ++f) {
    const Index s = slot_[f];
    first_row[f + 1] =
        first_row[f] + (s == kInvalid ? 1 : static_cast<Index>(triangulations_[at(s)].size()));
  }
  const Index total = first_row.back();
  out.surface.faces.resize(total, 3);
  out.uv.resize(3 * total, 2);
  out.parent_face.resize(at(total));
  const auto write_face = [&](FaceId f, std::vector<PolygonVertex>& polygon) {
    Index row = first_row[at(f)];
    if (slot_[at(f)] == kInvalid) {
      out.surface.faces.row(row) = input_.faces.row(f);
      out.uv.middleRows(3 * row, 3) = map_.corner_uv.middleRows(3 * f, 3);
      out.parent_face[at(row)] = f;
      return;
    }
    build_polygon(f, polygon);
    for (const GlobalTriangle& t : triangulations_[at(slot_[at(f)])]) {
      for (Index k = 0; k < 3; ++k) {
        const Index id = t[at(k)];
        out.surface.faces(row, k) =
            id < vertex_count_ ? id : out.edge_vertex[at(id - vertex_count_)];
        for (const PolygonVertex& v : polygon) {
          if (v.id == id) out.uv.row(3 * row + k) = Vector2(v.uv[0], v.uv[1]);
        }
      }
      out.parent_face[at(row++)] = f;
    }
  };
  parallel_for(context, slot_.size(), kFacesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::vector<PolygonVertex> polygon;
                 for (auto f = static_cast<FaceId>(begin); f < static_cast<FaceId>(end); ++f)
                   write_face(f, polygon);
               });
}

}  // namespace

RefinedLayout refine_map(const mesh::Surface& input, const mesh::Adjacency& adjacency,
                         const EdgePointMap& map, Refinement refinement, Storage storage,
                         const ExecutionContext& context) {
  Refiner refiner(input, adjacency, map, storage);
  refiner.run(refinement, context);
  return refiner.write(context);
}

}  // namespace flipfree::intrinsic
