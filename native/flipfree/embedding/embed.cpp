#include "flipfree/embedding/embed.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <string>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/embedding/star.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/editable_triangulation.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// The boundary in its place, all else at the origin.
Points2 boundary_only(const Disk& disk) {
  Points2 uv = Points2::Zero(disk.vertex_count, 2);
  uv(disk.loop, Eigen::all) = disk.boundary;
  return uv;
}

// Tutte's embedding of a disk (Tutte 1963, Floater 1997): boundary fixed on a convex polygon, every
// inner vertex in the mean of its neighbours; one Cholesky factorization. Isolated vertices get
// (0, 0).
//
// Guarantee: in exact arithmetic a bijection, if the polygon is convex and no inner edge joins two
// vertices of one side. In floating point it may fold over (thesis 3.2.1).
Points2 tutte_embedding(const Disk& disk, ExecutionContext& context) {
  const VertexId* corner = disk.faces.data();
  const auto corners = static_cast<CornerId>(disk.faces.size());
  // Every neighbour of an inner vertex is the target of one half-edge out of it.
  std::vector<Index> degree(at(disk.vertex_count), 0);
  for (CornerId c = 0; c < corners; ++c) ++degree[at(corner[c])];
  for (const VertexId v : disk.loop) degree[at(v)] = 0;  // no unknown
  Points2 uv = boundary_only(disk);
  std::vector<Index> unknown(degree.size(), kInvalid);
  std::vector<VertexId> inner;
  for (VertexId v = 0; v < disk.vertex_count; ++v) {
    if (degree[at(v)] == 0) continue;
    unknown[at(v)] = static_cast<Index>(inner.size());
    inner.push_back(v);
  }
  const auto n = static_cast<Index>(inner.size());
  if (n == 0) return uv;
  context.check();

  // Graph Laplacian with the boundary moved to the right-hand side, lower triangle.
  std::vector<Eigen::Triplet<double, Index>> entries;
  Points2 fixed_sum = Points2::Zero(n, 2);
  for (Index i = 0; i < n; ++i) entries.emplace_back(i, i, degree[at(inner[at(i)])]);
  for (HalfedgeId h = 0; h < corners; ++h) {
    const Index i = unknown[at(corner[h])];
    const VertexId neighbour = corner[next_corner(h)];
    const Index j = unknown[at(neighbour)];
    if (i == kInvalid) continue;
    if (j == kInvalid) fixed_sum.row(i) += uv.row(neighbour);
    if (j > i) entries.emplace_back(j, i, -1.0);
  }
  numeric::SparseMatrix matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());

  context.report("Tutte embedding", 0.1);
  numeric::SparseCholesky cholesky;
  cholesky.analyze(matrix, context);
  context.report("Tutte embedding", 0.5);
  if (!cholesky.factorize(matrix, context)) {
    throw_not_converged(
        ErrorCode::kFactorizationFailed,
        "Tutte's matrix is not positive definite: a vertex has no path to the boundary.");
  }
  uv(inner, Eigen::all) = cholesky.solve(fixed_sum, context);
  return uv;
}

// Does the polygon's point k lie beyond the chord from i to j by more than `resolution`?
bool beyond_chord(const Points2& p, Index i, Index k, Index j, double resolution) {
  const Vector2 a = p.row(i), b = p.row(k), c = p.row(j);
  return numeric::orientation(a, b, c) > 0 && twice_area(a, b, c) > resolution * (c - a).norm();
}

// The first, last and middle point between the ends stand for all: on a convex polygon they lie on
// the chord together or not at all.
bool has_room(const Points2& p, Index i, Index j, double resolution) {
  const auto n = static_cast<Index>(p.rows());
  const Index gap = (j - i + n) % n;
  return beyond_chord(p, i, (i + 1) % n, j, resolution) &&
         beyond_chord(p, i, (j + n - 1) % n, j, resolution) &&
         beyond_chord(p, i, (i + gap / 2) % n, j, resolution);
}

}  // namespace

std::vector<HalfedgeId> chords_to_split(const Disk& disk, bool float32) {
  if (disk.loop.empty()) return {};
  const auto n = static_cast<Index>(disk.loop.size());
  const std::vector<Index> place = places_in(disk.loop, disk.vertex_count);
  const Points2& boundary = disk.boundary;
  const Points2 stored = float32 ? as_stored(boundary) : boundary;
  const double resolution = 4 * (float32 ? 0x1p-24 : 0x1p-53) * boundary.cwiseAbs().maxCoeff();
  std::vector<HalfedgeId> chords;
  for (HalfedgeId h = 0; h < disk.faces.size(); ++h) {
    const VertexId a = disk.faces.data()[h];
    const VertexId b = disk.faces.data()[next_corner(h)];
    const Index i = place[at(a)];
    const Index j = place[at(b)];
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
Embedding split_edges(const Disk& disk, const std::vector<HalfedgeId>& edges) {
  Embedding result;
  result.faces = disk.faces;
  if (edges.empty()) return result;
  mesh::EditableTriangulation mesh(disk.vertex_count, disk.faces);
  for (const HalfedgeId h : edges)
    result.halved.emplace_back(mesh::source(disk.faces, h), mesh::target(disk.faces, h));
  for (const auto& [a, b] : result.halved) mesh.split_edge(mesh.find(a, b));
  result.faces = mesh.faces();
  return result;
}

// How far the progress bar is after the map that is tried first.
constexpr double kFirstShare = 0.2;

// Faces whose vertices all lie on the boundary have no freedom: they must be positive as they are.
void require_positive_fixed_faces(const PlanarMap& map) {
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) {
    const auto [a, b, c] = map.mesh.corners(f);
    if (!map.mesh.is_boundary(a) || !map.mesh.is_boundary(b) || !map.mesh.is_boundary(c)) continue;
    if (map.positive(f)) continue;
    const Vector2 p = map.at(a), q = map.at(b), r = map.at(c);
    throw_infeasible(
        ErrorCode::kNoRoomInPolygon,
        "Face " + face_id(f) + " has all its vertices (" + vertex_id(a) + ", " + vertex_id(b) +
            ", " + vertex_id(c) +
            ") on the boundary, and their positions, as given or rounded to 32 bits, do not turn "
            "left. Move them apart, or nearer to the origin.",
        {"fixed triangle", {{"triangle", {p.x(), p.y(), q.x(), q.y(), r.x(), r.y()}}}},
        ElementKind::kFace, {f});
  }
}

std::int64_t count_bad(const PlanarMap& map) {
  std::int64_t bad = 0;
  for (FaceId f = 0; f < map.mesh.face_count(); ++f) bad += !map.positive(f);
  return bad;
}

struct Ladder {
  Embedding& result;
  const Disk& disk;  // with the halved edges
  const EmbedOptions& options;
  ExecutionContext& context;

  void climb() {
    if (options.method == EmbedMethod::kProgressive) {
      progressive(options.initial || options.start_from_tutte, 0.0);
      return;
    }
    if (first_map_holds() || options.method == EmbedMethod::kTutte) return;
    progressive(options.initial.has_value(), kFirstShare);
  }

  PlanarMap start_map(const Points2& uv) {
    context.check();
    PlanarMap map = make_planar_map(disk.faces, disk.loop, uv, options.float32);
    context.check();
    require_positive_fixed_faces(map);
    return map;
  }

  // The initial map if there is one, else Tutte's: is it certified?
  bool first_map_holds() {
    const bool alone = options.method == EmbedMethod::kTutte;
    const bool tutte = alone || !options.initial;
    const Stopwatch watch;
    const Points2 uv = tutte ? tutte_map() : initial_map();
    result.stats["seconds_tutte"] = watch.seconds();
    const PlanarMap map = start_map(uv);
    const std::int64_t bad = count_bad(map);
    result.stats["tutte_flips"] = bad;
    result.rung = tutte ? Rung::kTutte : Rung::kInitial;
    result.uv = alone ? uv : map.uv;
    return bad == 0;
  }

  // Progressive embedding, from a map or from nothing; from nothing where the map leads nowhere.
  // `done`: how far the progress bar is.
  void progressive(bool from_map, double done) {
    const ProgressRange range(context, done, 1.0);
    if (from_map) {
      const Outcome<bool> valid = attempt_part([&] {
        PlanarMap map = start_map(options.initial ? initial_map() : tutte_map());
        result.stats["tutte_flips"] = count_bad(map);
        return finish(std::move(map), ProgressiveStart::kInitial);
      });
      if (valid && *valid) return;
    }
    const Outcome<bool> valid =
        attempt([&] { return finish(start_map(boundary_only(disk)), ProgressiveStart::kNothing); });
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
    const PlanarMap map = start_map(boundary_only(disk));
    const PlanarMesh& mesh = map.mesh;
    const auto halfedges = static_cast<HalfedgeId>(disk.faces.size());
    const auto fixed = [&](HalfedgeId h) {
      return mesh.is_boundary(mesh.source(h)) && mesh.is_boundary(mesh.target(h));
    };
    DisjointSets parts(mesh.face_count());
    for (HalfedgeId h = 0; h < halfedges; ++h) {
      if (!fixed(h)) parts.join(h / 3, mesh.opposite(h) / 3);
    }
    std::map<Index, std::map<VertexId, VertexId>> outline;  // part -> corner -> next corner
    std::map<Index, std::set<VertexId>> inner;
    for (HalfedgeId h = 0; h < halfedges; ++h) {
      const VertexId v = mesh.source(h);
      if (fixed(h)) outline[parts.find(h / 3)][v] = mesh.target(h);
      if (!mesh.is_boundary(v)) inner[parts.find(h / 3)].insert(v);
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

  bool finish(PlanarMap map, ProgressiveStart start) {
    progressive_embedding(map, start, context);
    if (count_bad(map) > 0) return false;
    result.uv = map.uv;
    result.rung = Rung::kProgressive;
    return true;
  }

  Points2 tutte_map() {
    const bool alone = options.method == EmbedMethod::kTutte;
    const ProgressRange range(context, 0.0, alone ? 1.0 : kFirstShare);
    return tutte_embedding(disk, context);
  }

  Points2 initial_map() const {
    Eigen::Index row = options.initial->rows();
    Points2 uv = Points2::Zero(disk.vertex_count, 2);
    uv.topRows(row) = *options.initial;
    uv(disk.loop, Eigen::all) = disk.boundary;
    for (const auto& [a, b] : result.halved) uv.row(row++) = 0.5 * uv.row(a) + 0.5 * uv.row(b);
    return uv;
  }
};

}  // namespace

void report(Rung rung, Stats& stats) {
  constexpr std::array kNames = {"tutte", "initial", "progressive"};
  stats["rung"] = std::string(kNames.at(static_cast<Size>(rung)));
}

Embedding embed_disk_refined(const Disk& disk, const EmbedOptions& options,
                             ExecutionContext& context) {
  require_disk(disk);
  require_convex(disk.boundary, disk.loop);
  if (options.initial &&
      (options.initial->rows() != disk.vertex_count || !options.initial->allFinite())) {
    throw_invalid(ErrorCode::kBadShape,
                  "The initial map must have one finite position per vertex (" +
                      std::to_string(disk.vertex_count) + ").");
  }
  context.report("embedding", 0.0);
  const Stopwatch watch;
  const std::vector<HalfedgeId> chords = chords_to_split(disk, options.float32);
  context.check();
  Embedding result = split_edges(disk, chords);
  const auto added = static_cast<Index>(result.halved.size());
  result.stats["added_vertices"] = std::int64_t{added};
  context.check();
  const Disk refined{result.faces, disk.vertex_count + added, disk.loop, disk.boundary};
  Ladder{result, refined, options, context}.climb();
  report(result.rung, result.stats);
  result.stats["seconds_embedding"] = watch.seconds();
  context.report("embedding", 1.0);
  return result;
}

Embedding embed_disk(const Disk& disk, const EmbedOptions& options, ExecutionContext& context) {
  Embedding result = embed_disk_refined(disk, options, context);
  if (result.halved.empty()) return result;
  const auto& [a, b] = result.halved.front();
  throw_infeasible(
      ErrorCode::kNoRoomInPolygon,
      "The edge between vertices " + vertex_id(a) + " and " + vertex_id(b) +
          " joins two points of one straight side. Allow refinement, or bend the side.",
      {"straight side", {}}, ElementKind::kEdge, {a, b});
}

}  // namespace flipfree::embedding
