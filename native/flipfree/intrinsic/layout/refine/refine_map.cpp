#include "flipfree/intrinsic/layout/refine/refine_map.h"

#include <algorithm>
#include <utility>

#include "flipfree/base/debug_check.h"
#include "flipfree/base/parallel.h"
#include "flipfree/intrinsic/layout/polygon/face_cells.h"
#include "flipfree/intrinsic/layout/polygon/polygon_triangulation.h"
#include "flipfree/intrinsic/layout/refine/developed_angles.h"
#include "flipfree/intrinsic/layout/refine/face_triangulations.h"

namespace flipfree::intrinsic {
namespace {

// Points nearer to each other or to an end than this part of their edge are not told apart: the
// 32-bit positions that Blender stores could not hold them either.
constexpr double kLeastGap = 1e-6;
// A point is taken out if the triangles around it get no more distorted by it than this (K = |J|^2
// / (2 det J), 1 = conformal), or twice what they were.
constexpr double kGoodDistortion = 8.0;
constexpr int kThinningPasses = 4;
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
    activate(bad, refinement == Refinement::kFull);
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
    if (triangulate_small_or_by_ears(polygon_, angles, storage_, local_, context_)) return named();
    if (polygon_.size() <= kExactPolygon) return false;
    if (triangulate_cells(polygon_, face_chords(faces_.point_counts(f), faces_.places(f)), storage_,
                          local_, context_) &&
        named() && angles_are_developed(angles, polygon_, found)) {
      return true;
    }
    return triangulate_exactly(polygon_, angles, storage_, local_, context_) && named();
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
