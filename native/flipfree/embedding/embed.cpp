#include "flipfree/embedding/embed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/embedding/disk/disk.h"
#include "flipfree/embedding/progressive/planar_map.h"
#include "flipfree/embedding/progressive/progressive.h"
#include "flipfree/embedding/progressive/room.h"
#include "flipfree/embedding/progressive/smoothing.h"
#include "flipfree/embedding/tutte/tutte.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/editable_triangulation.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// Does the polygon's point k lie beyond the chord from i to j by more than `resolution`?
bool beyond_chord(const Points2& p, Index i, Index k, Index j, double resolution) {
  const Vector2 a = p.row(i);
  const Vector2 b = p.row(k);
  const Vector2 c = p.row(j);
  if (numeric::orientation(a, b, c) <= 0) return false;
  const double area = (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
  return area > resolution * (c - a).norm();
}

// The first, last and middle point between the ends stand for all: on a convex polygon they lie on
// the chord together or not at all.
bool has_room(const Points2& p, Index i, Index j, double resolution) {
  const Index n = static_cast<Index>(p.rows());
  const Index gap = (j - i + n) % n;
  return beyond_chord(p, i, (i + 1) % n, j, resolution) &&
         beyond_chord(p, i, (j + n - 1) % n, j, resolution) &&
         beyond_chord(p, i, (i + gap / 2) % n, j, resolution);
}

}  // namespace

std::vector<HalfedgeId> chords_to_split(const Triangles& faces, Index vertex_count,
                                        const std::vector<VertexId>& loop, const Points2& boundary,
                                        bool float32) {
  if (loop.empty()) return {};
  const Index n = static_cast<Index>(loop.size());
  std::vector<Index> place(static_cast<Size>(vertex_count), kInvalid);
  for (Index i = 0; i < n; ++i) place[static_cast<Size>(loop[static_cast<Size>(i)])] = i;
  const Points2 stored = float32 ? as_stored(boundary) : boundary;
  const double resolution = 4 * (float32 ? 0x1p-24 : 0x1p-53) * boundary.cwiseAbs().maxCoeff();
  std::vector<HalfedgeId> chords;
  for (HalfedgeId h = 0; h < faces.size(); ++h) {
    const VertexId a = faces.data()[h];
    const VertexId b = faces.data()[next_corner(h)];
    const Index i = place[static_cast<Size>(a)];
    const Index j = place[static_cast<Size>(b)];
    if (i == kInvalid || j == kInvalid || a > b)
      continue;  // an inner edge has one half-edge with a < b
    if ((i + 1) % n == j || (j + 1) % n == i) continue;  // boundary edge
    const bool room = has_room(boundary, i, j, resolution) &&
                      has_room(boundary, j, i, resolution) && has_room(stored, i, j, resolution) &&
                      has_room(stored, j, i, resolution);
    if (!room) chords.push_back(h);
  }
  return chords;
}

namespace {

// Halves these edges. The result's uv is empty.
Embedding split_edges(const Triangles& faces, Index vertex_count,
                      const std::vector<HalfedgeId>& edges) {
  Embedding result;
  result.faces = faces;
  if (edges.empty()) return result;
  mesh::EditableTriangulation mesh(vertex_count, faces);
  for (const HalfedgeId h : edges)
    result.halved.emplace_back(mesh::source(faces, h), mesh::target(faces, h));
  for (const auto& [a, b] : result.halved) mesh.split_edge(mesh.find(a, b));
  result.faces = mesh.faces();
  return result;
}

// How far the progress bar is after the map that is tried first.
constexpr double kFirstShare = 0.2;

// Faces whose vertices all lie on the boundary have no freedom: they must be positive as they are.
void require_positive_fixed_faces(const PlanarMap& map) {
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) {
    const VertexId a = map.mesh.source(3 * f);
    const VertexId b = map.mesh.source(3 * f + 1);
    const VertexId c = map.mesh.source(3 * f + 2);
    if (!map.mesh.is_boundary(a) || !map.mesh.is_boundary(b) || !map.mesh.is_boundary(c)) continue;
    if (map.positive(f)) continue;
    throw_infeasible(ErrorCode::kNoRoomInPolygon,
                     "Face " + face_id(f) + " has all its vertices (" + vertex_id(a) + ", " +
                         vertex_id(b) + ", " + vertex_id(c) +
                         ") on the boundary, and their positions, as given or rounded to 32 bits, "
                         "do not turn left. "
                         "Move them apart, or nearer to the origin.",
                     {"fixed triangle",
                      {{"triangle",
                        {map.at(a).x(), map.at(a).y(), map.at(b).x(), map.at(b).y(), map.at(c).x(),
                         map.at(c).y()}}}},
                     ElementKind::kFace, {f});
  }
}

Size count_bad(const PlanarMap& map) {
  Size bad = 0;
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) bad += !map.positive(f);
  return bad;
}

struct Ladder {
  Embedding& result;
  Index vertex_count;
  const std::vector<VertexId>& loop;
  const Points2& boundary;
  const EmbedOptions& options;
  ExecutionContext& context;
  Stats& stats;
  double done = 0.0;  // how far the progress bar is

  void climb() {
    if (options.method == EmbedMethod::kProgressive) {
      progressive(options.initial != nullptr || options.start_from_tutte);
      return;
    }
    if (first_map_holds() || options.method == EmbedMethod::kTutte) return;
    progressive(options.initial != nullptr);
  }

  PlanarMap start_map(const Points2& uv) {
    context.check();
    PlanarMap map = make_planar_map(result.faces, loop, uv, options.float32);
    context.check();
    require_positive_fixed_faces(map);
    return map;
  }

  // The initial map if there is one, else Tutte's: is it certified?
  bool first_map_holds() {
    const bool tutte = options.method == EmbedMethod::kTutte || options.initial == nullptr;
    const Stopwatch watch;
    const Points2 uv = tutte ? tutte_map() : initial_map();
    stats["seconds_tutte"] = watch.seconds();
    const PlanarMap map = start_map(uv);
    const Size bad = count_bad(map);
    stats["tutte_flips"] = static_cast<std::int64_t>(bad);
    done = kFirstShare;
    result.rung = tutte ? Rung::kTutte : Rung::kInitial;
    result.uv = options.method == EmbedMethod::kTutte ? uv : map.uv;
    return bad == 0;
  }

  // Progressive embedding, from a map or from nothing; from nothing where the map leads nowhere.
  void progressive(bool from_map) {
    const ProgressRange range(context, done, 1.0);
    if (from_map) {
      const Outcome<bool> valid = attempt_part([&] {
        PlanarMap map = start_map(options.initial != nullptr ? initial_map() : tutte_map());
        stats["tutte_flips"] = static_cast<std::int64_t>(count_bad(map));
        return finish(map, ProgressiveStart::kInitial);
      });
      if (valid && *valid) return;
      if (!valid) stats["restarts"] = std::int64_t{1};
    }
    const Outcome<bool> valid = attempt([&] {
      PlanarMap map = start_map(boundary_only());
      return finish(map, ProgressiveStart::kNothing);
    });
    if (!valid) {
      require_room_for_all();
      throw NotConverged(valid.error());
    }
    if (!*valid) {
      throw_not_converged(ErrorCode::kCertificateFailed,
                          "The embedding is not flip-free after all insertions.");
    }
  }

  // Edges between boundary vertices are fixed and divide the polygon. Throws Infeasible if one of
  // the parts holds fewer grid points than it has inner vertices.
  void require_room_for_all() {
    const PlanarMap map = start_map(boundary_only());
    const Triangles& faces = result.faces;
    const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, faces);
    const auto halfedges = static_cast<HalfedgeId>(faces.size());
    const auto fixed = [&](HalfedgeId h) {
      return map.mesh.is_boundary(mesh::source(faces, h)) &&
             map.mesh.is_boundary(mesh::target(faces, h));
    };
    DisjointSets parts(static_cast<Index>(faces.rows()));
    for (HalfedgeId h = 0; h < halfedges; ++h) {
      if (!fixed(h)) parts.join(h / 3, adjacency.opposite[static_cast<Size>(h)] / 3);
    }
    std::map<Index, std::map<VertexId, VertexId>> outline;  // part -> corner -> next corner
    std::map<Index, std::set<VertexId>> inner;
    for (HalfedgeId h = 0; h < halfedges; ++h) {
      if (fixed(h)) outline[parts.find(h / 3)][mesh::source(faces, h)] = mesh::target(faces, h);
      if (!map.mesh.is_boundary(mesh::source(faces, h)))
        inner[parts.find(h / 3)].insert(mesh::source(faces, h));
    }
    for (const auto& [part, vertices] : inner) {
      context.check();
      const std::map<VertexId, VertexId>& next = outline.at(part);
      Star ring;
      VertexId v = next.begin()->first;
      for (Size i = 0; i < next.size(); ++i, v = next.at(v)) {
        ring.ring.push_back(v);
        ring.at.push_back(map.at(v));
      }
      require_room(map, ring, vertices.size(), kRoomBudget / inner.size());
    }
  }

  void require_room(const PlanarMap& map, const Star& ring, Size needed, std::uint64_t budget) {
    const Room room = find_room(map, ring, budget);
    if (!room.exact || room.points >= needed) return;
    std::vector<double> polygon;
    for (const Vector2& p : ring.at) polygon.insert(polygon.end(), {p.x(), p.y()});
    throw_infeasible(ErrorCode::kNoRoomInPolygon,
                     "The polygon holds " + std::to_string(room.points) + " points with " +
                         (options.float32 ? "32-bit" : "64-bit") + " coordinates where " +
                         std::to_string(needed) + " inner vertices need one each. Make it wider " +
                         narrowest_extent(ring) + ", or move it to the origin.",
                     {"too few points",
                      {{"polygon", polygon},
                       {"points", {static_cast<double>(room.points)}},
                       {"needed", {static_cast<double>(needed)}},
                       {"bits", {options.float32 ? 32.0 : 64.0}}}});
  }

  bool finish(PlanarMap& map, ProgressiveStart start) {
    progressive_embedding(map, start, context);
    if (count_bad(map) > 0) return false;
    result.uv = map.uv;
    result.rung = Rung::kProgressive;
    return true;
  }

  Points2 boundary_only() const {
    Points2 uv = Points2::Zero(vertex_count, 2);
    for (Size i = 0; i < loop.size(); ++i) uv.row(loop[i]) = boundary.row(static_cast<Index>(i));
    return uv;
  }

  Points2 tutte_map() {
    const bool alone = options.method == EmbedMethod::kTutte;
    const ProgressRange range(context, 0.0, alone ? 1.0 : kFirstShare);
    return tutte_uniform(result.faces, vertex_count, loop, boundary, context);
  }

  Points2 initial_map() const {
    const Index given = static_cast<Index>(options.initial->rows());
    Points2 uv = Points2::Zero(vertex_count, 2);
    uv.topRows(given) = *options.initial;
    for (Size i = 0; i < loop.size(); ++i) uv.row(loop[i]) = boundary.row(static_cast<Index>(i));
    for (Size k = 0; k < result.halved.size(); ++k) {
      const auto& [a, b] = result.halved[k];
      uv.row(given + static_cast<Index>(k)) = 0.5 * uv.row(a) + 0.5 * uv.row(b);
    }
    return uv;
  }
};

}  // namespace

void report(Rung rung, Stats& stats) {
  constexpr std::array kNames = {"tutte", "initial", "progressive"};
  stats["rung"] = std::string(kNames.at(static_cast<Size>(rung)));
}

Embedding embed_disk_refined(const Triangles& faces, Index vertex_count,
                             const std::vector<VertexId>& loop, const Points2& boundary,
                             const EmbedOptions& options, ExecutionContext& context, Stats& stats) {
  require_disk_with_boundary(faces, vertex_count, loop, boundary);
  require_convex(boundary, loop);
  if (options.initial != nullptr &&
      (options.initial->rows() != vertex_count || !options.initial->allFinite())) {
    throw_invalid(ErrorCode::kBadShape,
                  "The initial map must have one finite position per vertex (" +
                      std::to_string(vertex_count) + ").");
  }
  context.report("embedding", 0.0);
  Stopwatch watch;
  const std::vector<HalfedgeId> chords =
      chords_to_split(faces, vertex_count, loop, boundary, options.float32);
  context.check();
  Embedding result = split_edges(faces, vertex_count, chords);
  stats["added_vertices"] = static_cast<std::int64_t>(result.halved.size());
  context.check();
  const Index total = vertex_count + static_cast<Index>(result.halved.size());
  Ladder{result, total, loop, boundary, options, context, stats}.climb();
  report(result.rung, stats);
  stats["seconds_embedding"] = watch.seconds();
  context.report("embedding", 1.0);
  return result;
}

Points2 embed_disk(const Triangles& faces, Index vertex_count, const std::vector<VertexId>& loop,
                   const Points2& boundary, const EmbedOptions& options, ExecutionContext& context,
                   Stats& stats) {
  Embedding result =
      embed_disk_refined(faces, vertex_count, loop, boundary, options, context, stats);
  if (!result.halved.empty()) {
    const auto& [a, b] = result.halved.front();
    throw_infeasible(
        ErrorCode::kNoRoomInPolygon,
        "The edge between vertices " + vertex_id(a) + " and " + vertex_id(b) +
            " joins two points of one straight side. Allow refinement, or bend the side.",
        {"straight side", {}}, ElementKind::kEdge, {a, b});
  }
  return result.uv;
}

}  // namespace flipfree::embedding
