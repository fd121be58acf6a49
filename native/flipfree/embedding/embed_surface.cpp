#include "flipfree/embedding/embed_surface.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/embedding/disk/disk.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/embedding/tutte/tutte.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/refined_surface.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::embedding {
namespace {

// A circle for a disk's boundary, with room where the disk's own edges need it.
//
// An edge between two boundary vertices is a chord, fixed by its ends. Where vertices are many the
// circle turns between the ends of short chords by less than 32 bits can tell: the tip of a strip
// of 100 000 squares, spaced by length, is 1600 chords one behind the other between points that lie
// on one line as stored. There the points have to be further apart.

using Size = std::size_t;

// An edge's share grows by at most 2^this; a strip of a million squares needs 2^12.
constexpr int kMostDoublings = 24;

// Doubles the edges on the shorter side of each chord.
void widen(std::vector<double>& lengths, const std::vector<HalfedgeId>& chords,
           const Triangles& faces, const std::vector<Index>& place) {
  const Size n = lengths.size();
  std::vector<double> along(n + 1, 0.0);  // up to point i
  std::partial_sum(lengths.begin(), lengths.end(), along.begin() + 1);
  std::vector<int> starts(n + 1, 0);  // of arcs to double at edge i, less those that have ended
  const auto mark = [&](Size from, Size to) {
    ++starts[from];
    --starts[to];
  };
  for (const HalfedgeId h : chords) {
    const auto i = static_cast<Size>(place[static_cast<Size>(faces.data()[h])]);
    const auto j = static_cast<Size>(place[static_cast<Size>(faces.data()[next_corner(h)])]);
    const Size low = std::min(i, j), high = std::max(i, j);
    const double between = along[high] - along[low];
    if (2.0 * between <= along[n]) {
      mark(low, high);
    } else {
      mark(0, low);
      mark(high, n);
    }
  }
  int arcs = 0;
  for (Size i = 0; i < n; ++i) {
    arcs += starts[i];
    if (arcs > 0) lengths[i] *= 2.0;
  }
}

// place_boundary(), but of a circle the edges beyond chords without room get twice as
// much of it until all have room; positions that 32 bits cannot keep in strictly convex order are
// 64-bit numbers then. Where that does not come to an end, and for other shapes:
// place_boundary()'s. loop: the boundary vertices in order; lengths as place_boundary() has them.
// Throws what that does, Cancelled. Cost: O(#F) for each doubling, none as a rule.
Points2 place_with_room(BoundaryShape shape, const std::vector<double>& lengths,
                        const Triangles& faces, Index vertex_count,
                        const std::vector<VertexId>& loop, const ExecutionContext& context) {
  const Points2 given = place_boundary(shape, lengths).positions;
  if (shape != BoundaryShape::kCircle) return given;
  const auto without_room = [&](const Points2& positions) {
    context.check();
    return chords_to_split(faces, vertex_count, loop, positions, true);
  };
  std::vector<HalfedgeId> chords = without_room(given);
  std::vector<Index> place(static_cast<Size>(vertex_count), kInvalid);
  for (Size i = 0; i < loop.size(); ++i) place[static_cast<Size>(loop[i])] = static_cast<Index>(i);
  std::vector<double> wider = lengths;
  for (int doubling = 0; doubling < kMostDoublings && !chords.empty(); ++doubling) {
    widen(wider, chords, faces, place);
    const Points2 positions = spread_on_circle(wider);
    chords = without_room(positions);
    if (chords.empty() && is_strictly_convex(positions)) return positions;
  }
  return given;
}

// Energy of a start map above which a start from nothing is tried too.
constexpr double kPoorStart = 10.0;

struct Boundary {
  std::vector<VertexId> loop;
  Points2 positions;
};

std::vector<VertexId> own_loop(const mesh::Surface& surface) {
  const mesh::Adjacency& adjacency = surface.adjacency();
  return mesh::boundary_loops(surface.faces, adjacency).front();
}

// Turns the caller's loop around if it runs against the surface's own loop. Returns whether it did.
bool orient_loop(std::vector<VertexId>& loop, const std::vector<VertexId>& own) {
  if (loop.size() < 3) return false;
  const auto at = std::find(own.begin(), own.end(), loop[0]);
  if (at == own.end()) return false;
  const Size i = static_cast<Size>(at - own.begin());
  if (own[(i + own.size() - 1) % own.size()] != loop[1]) return false;
  std::reverse(loop.begin(), loop.end());
  return true;
}

Boundary placed_boundary(const mesh::Surface& surface, const EmbedSurfaceOptions& options,
                         const ExecutionContext& context) {
  Boundary boundary;
  const std::vector<VertexId> own = own_loop(surface);
  boundary.loop = options.loop.empty() ? own : options.loop;
  for (const VertexId v : boundary.loop) {
    if (v >= 0 && v < static_cast<Index>(surface.vertices.rows())) continue;
    throw_invalid(ErrorCode::kIndexOutOfRange,
                  "The boundary loop names vertex " + vertex_id(v) +
                      ", which does not exist. List vertices of the mesh.");
  }
  const bool turned = orient_loop(boundary.loop, own);
  if (options.polygon) {
    boundary.positions = *options.polygon;
    if (turned) boundary.positions = options.polygon->colwise().reverse();
    return boundary;
  }
  std::vector<double> lengths(boundary.loop.size());
  for (Size i = 0; i < lengths.size(); ++i) {
    const VertexId a = boundary.loop[i];
    const VertexId b = boundary.loop[(i + 1) % lengths.size()];
    lengths[i] = (surface.vertices.row(a) - surface.vertices.row(b)).norm();
  }
  boundary.positions =
      place_with_room(options.shape, lengths, surface.faces,
                      static_cast<Index>(surface.vertices.rows()), boundary.loop, context);
  return boundary;
}

template <typename Points>
Points corner_uv(const Triangles& faces, const Points& uv) {
  Points corners(faces.size(), 2);
  for (CornerId c = 0; c < faces.size(); ++c) corners.row(c) = uv.row(faces.data()[c]);
  return corners;
}

// The certificate also judges that the boundary is bitwise where it was asked for.
certify::CertifyRequest boundary_pins(const Triangles& faces, const Boundary& boundary) {
  std::vector<Index> place(static_cast<Size>(faces.maxCoeff()) + 1, kInvalid);
  for (Size i = 0; i < boundary.loop.size(); ++i) {
    place[static_cast<Size>(boundary.loop[i])] = static_cast<Index>(i);
  }
  certify::CertifyRequest request;
  for (CornerId c = 0; c < faces.size(); ++c) {
    const Index i = place[static_cast<Size>(faces.data()[c])];
    if (i != kInvalid) request.pins.push_back({c, boundary.positions.row(i).transpose()});
  }
  return request;
}

// Lowers the distortion of `uv` with the boundary where it is, as far as time allows.
void lower_distortion(const mesh::Surface& surface, const Boundary& boundary,
                      const EmbedSurfaceOptions& options, EmbedOptions embed, Rung rung,
                      certify::Parametrization& map, Points2& uv, Points2f& stored,
                      ExecutionContext& context) {
  const auto n = static_cast<Index>(surface.vertices.rows());
  double energy = certify::symmetric_dirichlet(map.surface, corner_uv(map.surface.faces, uv)).mean;
  if (!(energy < kPoorStart) && options.method == EmbedMethod::kLadder &&
      rung != Rung::kProgressive) {
    // Valid, but so compressed that the optimiser would need hundreds of iterations to open it.
    const ProgressRange range(context, 0.3, 0.4);
    embed.method = EmbedMethod::kProgressive;
    embed.initial = nullptr;
    embed.start_from_tutte = false;
    Stats stats;
    const Points2 other = embed_disk_refined(surface.faces, n, boundary.loop, boundary.positions,
                                             embed, context, stats)
                              .uv;
    const double other_energy =
        certify::symmetric_dirichlet(map.surface, corner_uv(map.surface.faces, other)).mean;
    if (other_energy < energy) {
      energy = other_energy;
      uv = other;
      stored = other.cast<float>();
      report(Rung::kProgressive, map.stats);
    }
  }
  map.stats["energy_embedding"] = energy;
  const ProgressRange range(context, 0.4, 0.95);
  distortion::MinimizeOptions minimize;
  minimize.fixed = boundary.loop;
  minimize.max_iterations = options.max_iterations;
  minimize.tolerance = options.tolerance;
  distortion::Minimized descent = distortion::with_own_map(
      [&] { return distortion::minimize_distortion(map.surface, uv, minimize, context); });
  report(descent, map.stats);
  // Where floats are coarse, rounding to them can take more than the optimisation gave.
  const Triangles& faces = map.surface.faces;
  Outcome<Points2f> rounded = attempt([&] {
    return distortion::round_to_storage(faces, descent.uv, {.fixed = boundary.loop}, context,
                                        map.stats);
  });
  if (rounded &&
      certify::symmetric_dirichlet(map.surface, corner_uv(faces, Points2(rounded->cast<double>())))
              .mean <= energy) {
    uv = std::move(descent.uv);
    stored = std::move(*rounded);
  } else {
    map.stats["optimisation_dropped"] = std::int64_t{1};
  }
}

// Without vertices that were added, and faces that they are in.
Error of_input(Error error, const mesh::Surface& surface) {
  return renumbered(std::move(error), known_in(static_cast<Index>(surface.vertices.rows()),
                                               static_cast<Index>(surface.faces.rows())));
}

// Edges whose ends lie on a line of the polygon, as 32 bits know it, are divided, and what divides
// many of them lies one behind the other: where that failed, the cure is another polygon.
Error with_cure(Error error, const mesh::Surface& surface, const Boundary& boundary,
                const EmbedSurfaceOptions& options) {
  if (error.code != ErrorCode::kIterationLimit && error.code != ErrorCode::kNoRoomInPolygon)
    return error;
  const std::vector<HalfedgeId> chords =
      chords_to_split(surface.faces, static_cast<Index>(surface.vertices.rows()), boundary.loop,
                      boundary.positions, true);
  if (chords.size() < 2) return error;
  const VertexId a = mesh::source(surface.faces, chords.front());
  const VertexId b = mesh::target(surface.faces, chords.front());
  const bool circle = !options.polygon && options.shape == BoundaryShape::kCircle;
  error.message = std::to_string(chords.size()) +
                  " edges join boundary vertices between which the polygon is straight, as far as "
                  "32-bit coordinates can tell, the first vertices " +
                  vertex_id(a) + " and " + vertex_id(b) + ". " +
                  (circle ? "Cut the mesh into shorter parts."
                          : "Take the circle as the boundary: its points are spaced so that such "
                            "edges have room.");
  error.kind = ElementKind::kEdge;
  error.elements = {a, b};
  return error;
}

certify::Parametrization embed_within(const mesh::Surface& surface,
                                      const EmbedSurfaceOptions& options,
                                      ExecutionContext& context) {
  Stopwatch watch;
  context.report("checking the mesh", 0.0);
  mesh::ValidateOptions rules;
  rules.require_disk = true;
  mesh::validate(surface, rules, context);
  context.check();
  const Boundary boundary = placed_boundary(surface, options, context);
  context.check();
  certify::Parametrization map;
  map.stats["time_limit_reached"] = std::int64_t{0};
  EmbedOptions embed;
  embed.method = options.method;
  embed.initial = options.initial ? &*options.initial : nullptr;
  embed.start_from_tutte = options.start_from_tutte;
  const Index n = static_cast<Index>(surface.vertices.rows());
  Embedding embedding;
  {
    const ProgressRange range(context, 0.0, options.optimise ? 0.3 : 0.95);
    try {
      embedding = embed_disk_refined(surface.faces, n, boundary.loop, boundary.positions, embed,
                                     context, map.stats);
    } catch (const NotConverged& e) {
      throw NotConverged(with_cure(e.error(), surface, boundary, options));
    }
  }
  context.check();
  mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  for (const auto& [a, b] : embedding.halved) refined.split_edge(refined.mesh.find(a, b));
  certify::set_refinement(map, refined);
  Points2 uv = embedding.uv;
  Points2f stored = uv.cast<float>();
  if (options.optimise && options.method != EmbedMethod::kTutte) {
    const MapInHand embedded(context);
    improve_in_time(context, map.stats, [&] {
      lower_distortion(surface, boundary, options, embed, embedding.rung, map, uv, stored, context);
    });
  }
  const Grace finishing(context);
  map.uv = corner_uv(map.surface.faces, uv);
  map.uv32 = corner_uv(map.surface.faces, stored);
  context.check();
  certify::certify_map(map, surface, boundary_pins(map.surface.faces, boundary), context);
  map.stats["seconds"] = watch.seconds();
  map.stats["energy"] = map.certificate.energy;
  certify::require_certificate(map, "The embedding");
  context.report("embedding", 1.0);
  return map;
}

}  // namespace

certify::Parametrization embed_surface(const mesh::Surface& surface,
                                       const EmbedSurfaceOptions& options,
                                       ExecutionContext& context) {
  return in_time(context, options.max_seconds, "No embedding was found",
                 "or choose a roomier polygon", [&] {
                   return with_errors([&](const Error& error) { return of_input(error, surface); },
                                      [&] { return embed_within(surface, options, context); });
                 });
}

}  // namespace flipfree::embedding
