#include "flipfree/embedding/embed_surface.h"

#include <algorithm>
#include <numeric>
#include <string>

#include "flipfree/base/failure.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/valid_map.h"
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
    const Size i = at(place[at(mesh::source(faces, h))]);
    const Size j = at(place[at(mesh::target(faces, h))]);
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
                        const mesh::Surface& surface, const std::vector<VertexId>& loop,
                        const ExecutionContext& context) {
  const Points2 given = place_boundary(shape, lengths);
  if (shape != BoundaryShape::kCircle) return given;
  const auto count = static_cast<Index>(surface.vertices.rows());
  const auto without_room = [&](const Points2& positions) {
    context.check();
    return chords_to_split({surface.faces, count, loop, positions}, true);
  };
  std::vector<HalfedgeId> chords = without_room(given);
  const std::vector<Index> place = places_in(loop, count);
  std::vector<double> wider = lengths;
  for (int doubling = 0; doubling < kMostDoublings && !chords.empty(); ++doubling) {
    widen(wider, chords, surface.faces, place);
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

// Turns the caller's loop around if it runs against the surface's own loop. Returns whether it did.
bool orient_loop(std::vector<VertexId>& loop, const std::vector<VertexId>& own) {
  if (loop.size() < 3) return false;
  const auto found = std::find(own.begin(), own.end(), loop[0]);
  if (found == own.end()) return false;
  const Size i = at(found - own.begin());
  if (own[(i + own.size() - 1) % own.size()] != loop[1]) return false;
  std::reverse(loop.begin(), loop.end());
  return true;
}

Boundary placed_boundary(const mesh::Surface& surface, const EmbedSurfaceOptions& options,
                         const ExecutionContext& context) {
  Boundary boundary;
  const std::vector<VertexId> own =
      mesh::boundary_loops(surface.faces, surface.adjacency()).front();
  boundary.loop = options.loop.empty() ? own : options.loop;
  require_vertices(boundary.loop, static_cast<Index>(surface.vertices.rows()));
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
  boundary.positions = place_with_room(options.shape, lengths, surface, boundary.loop, context);
  return boundary;
}

template <typename Points>
Points corner_uv(const Triangles& faces, const Points& uv) {
  return uv(faces.reshaped<Eigen::RowMajor>(), Eigen::all);
}

double energy_of(const mesh::Surface& surface, const Points2& uv) {
  return certify::symmetric_dirichlet(surface, corner_uv(surface.faces, uv)).mean;
}

class SurfaceEmbedder {
 public:
  SurfaceEmbedder(const mesh::Surface& surface, const EmbedSurfaceOptions& options,
                  ExecutionContext& context)
      : surface_(surface), options_(options), context_(context) {}

  certify::Parametrization run() {
    const Stopwatch watch;
    context_.report("checking the mesh", 0.0);
    mesh::ValidateOptions rules;
    rules.require_disk = true;
    mesh::validate(surface_, rules, context_);
    context_.check();
    boundary_ = placed_boundary(surface_, options_, context_);
    context_.check();
    map_.stats["time_limit_reached"] = std::int64_t{0};
    const Rung rung = embed();
    context_.check();
    if (options_.optimise && options_.method != EmbedMethod::kTutte) {
      const MapInHand embedded(context_);
      improve_in_time(context_, map_.stats, [&] { lower_distortion(rung); });
    }
    const Grace finishing(context_);
    map_.uv = corner_uv(map_.surface.faces, uv_);
    map_.uv32 = corner_uv(map_.surface.faces, stored_);
    context_.check();
    certify::certify_map(map_, surface_, boundary_pins(), context_);
    map_.stats["seconds"] = watch.seconds();
    map_.stats["energy"] = map_.certificate.energy;
    certify::require_certificate(map_, "The embedding");
    context_.report("embedding", 1.0);
    return std::move(map_);
  }

 private:
  Disk disk() const {
    return {surface_.faces, static_cast<Index>(surface_.vertices.rows()), boundary_.loop,
            boundary_.positions};
  }

  // Embeds the surface, refined where it must be.
  Rung embed() {
    const ProgressRange range(context_, 0.0, options_.optimise ? 0.3 : 0.95);
    Embedding embedding;
    try {
      embedding = embed_disk_refined(disk(), options_, context_);
    } catch (const NotConverged& e) {
      throw NotConverged(with_cure(e.error()));
    }
    map_.stats.merge(embedding.stats);
    mesh::RefinedSurface refined = mesh::make_refined_surface(surface_);
    for (const auto& [a, b] : embedding.halved) refined.split_edge(refined.mesh.find(a, b));
    certify::set_refinement(map_, refined);
    uv_ = std::move(embedding.uv);
    stored_ = uv_.cast<float>();
    return embedding.rung;
  }

  // Edges whose ends lie on a line of the polygon, as 32 bits know it, are divided, and what
  // divides many of them lies one behind the other: where that failed, the cure is another polygon.
  Error with_cure(Error error) const {
    if (error.code != ErrorCode::kIterationLimit && error.code != ErrorCode::kNoRoomInPolygon)
      return error;
    const std::vector<HalfedgeId> chords = chords_to_split(disk(), true);
    if (chords.size() < 2) return error;
    const VertexId a = mesh::source(surface_.faces, chords.front());
    const VertexId b = mesh::target(surface_.faces, chords.front());
    const bool circle = !options_.polygon && options_.shape == BoundaryShape::kCircle;
    error.message = std::to_string(chords.size()) +
                    " edges join boundary vertices between which the polygon is straight, as far "
                    "as 32-bit coordinates can tell, the first vertices " +
                    vertex_id(a) + " and " + vertex_id(b) + ". " +
                    (circle ? "Cut the mesh into shorter parts."
                            : "Take the circle as the boundary: its points are spaced so that such "
                              "edges have room.");
    error.kind = ElementKind::kEdge;
    error.elements = {a, b};
    return error;
  }

  // Lowers the distortion with the boundary where it is, as far as time allows.
  void lower_distortion(Rung rung) {
    double energy = energy_of(map_.surface, uv_);
    if (!(energy < kPoorStart) && options_.method == EmbedMethod::kLadder &&
        rung != Rung::kProgressive) {
      // Valid, but so compressed that the optimiser would need hundreds of iterations to open it.
      const ProgressRange range(context_, 0.3, 0.4);
      EmbedOptions embed;
      embed.method = EmbedMethod::kProgressive;
      embed.start_from_tutte = false;
      const Points2 other = embed_disk_refined(disk(), embed, context_).uv;
      const double other_energy = energy_of(map_.surface, other);
      if (other_energy < energy) {
        energy = other_energy;
        uv_ = other;
        stored_ = other.cast<float>();
        report(Rung::kProgressive, map_.stats);
      }
    }
    map_.stats["energy_embedding"] = energy;
    const ProgressRange range(context_, 0.4, 0.95);
    distortion::MinimizeOptions minimize;
    minimize.fixed = boundary_.loop;
    minimize.max_iterations = options_.max_iterations;
    minimize.tolerance = options_.tolerance;
    distortion::Minimized descent = distortion::with_own_map(
        [&] { return distortion::minimize_distortion(map_.surface, uv_, minimize, context_); });
    report(descent, map_.stats);
    // Where floats are coarse, rounding to them can take more than the optimisation gave.
    Outcome<Points2f> rounded = attempt([&] {
      return distortion::round_to_storage(map_.surface.faces, descent.uv, {.fixed = boundary_.loop},
                                          context_, map_.stats);
    });
    if (rounded && energy_of(map_.surface, rounded->cast<double>()) <= energy) {
      uv_ = std::move(descent.uv);
      stored_ = std::move(*rounded);
    } else {
      map_.stats["optimisation_dropped"] = std::int64_t{1};
    }
  }

  // The certificate also judges that the boundary is bitwise where it was asked for.
  certify::CertifyRequest boundary_pins() const {
    const Triangles& faces = map_.surface.faces;
    const std::vector<Index> place =
        places_in(boundary_.loop, static_cast<Index>(map_.surface.vertices.rows()));
    certify::CertifyRequest request;
    for (CornerId c = 0; c < faces.size(); ++c) {
      const Index i = place[at(faces.data()[c])];
      if (i != kInvalid) request.pins.push_back({c, boundary_.positions.row(i).transpose()});
    }
    return request;
  }

  const mesh::Surface& surface_;
  const EmbedSurfaceOptions& options_;
  ExecutionContext& context_;
  Boundary boundary_;
  certify::Parametrization map_;
  Points2 uv_;
  Points2f stored_;
};

}  // namespace

certify::Parametrization embed_surface(const mesh::Surface& surface,
                                       const EmbedSurfaceOptions& options,
                                       ExecutionContext& context) {
  // Without vertices that were added, and faces that they are in.
  const auto of_input = [&](const Error& error) {
    return renumbered(error, known_in(static_cast<Index>(surface.vertices.rows()),
                                      static_cast<Index>(surface.faces.rows())));
  };
  return in_time(context, options.max_seconds, "No embedding was found",
                 "or choose a roomier polygon", [&] {
                   return with_errors(
                       of_input, [&] { return SurfaceEmbedder(surface, options, context).run(); });
                 });
}

}  // namespace flipfree::embedding
