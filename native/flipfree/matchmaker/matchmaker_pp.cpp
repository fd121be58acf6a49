#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <set>

#include "flipfree/base/failure.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/outline_target.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/ways.h"
#include "flipfree/numeric/dense_factors.h"

namespace flipfree::matchmaker {
namespace {

// Phase 3 of MatchMaker++ (thesis 3.3): every patch onto its convex polygon, welded.

using Mesh = mesh::EditableTriangulation;

// An affine frame in which a polygon is about as wide as high, near the origin: thin polygons are
// judged and solved there as well as any other. Affine maps keep convex combinations, hence
// embeddings.
struct Frame {
  Vector2 origin = Vector2::Zero();
  Eigen::Matrix2d to_round = Eigen::Matrix2d::Identity(), from_round = to_round;

  Points2 round(const Points2& points) const {
    return (points.rowwise() - origin.transpose()) * to_round.transpose();
  }
  Points2 plain(const Points2& points) const {
    return (points * from_round.transpose()).rowwise() + origin.transpose();
  }
};

Frame round_frame(const Points2& polygon) {
  Frame frame;
  frame.origin = polygon.colwise().mean().transpose();
  const Points2 centred = frame.round(polygon);
  const Eigen::Matrix2d spread =
      centred.transpose() * centred / static_cast<double>(polygon.rows());
  const auto [values, vectors] = numeric::symmetric_eigen(spread);
  const Vector2 size = values.cwiseMax(1e-30 * values[1]).cwiseSqrt();
  Eigen::Matrix2d axes = vectors;
  if (axes.determinant() < 0) axes.col(0) *= -1;
  frame.to_round = size.cwiseInverse().asDiagonal() * axes.transpose();
  frame.from_round = axes * size.asDiagonal();
  return frame;
}

[[noreturn]] void refuse_thin() {
  throw_not_converged(
      ErrorCode::kRoundingFlips,
      "A patch of the target is too thin to be mapped in 64-bit coordinates. Move the pins "
      "further apart, or make the target wider.");
}

// Positions of all mesh vertices (#V x 2 of the refined mesh). Points along a path are spread over
// its straight side by the lengths of the path's edges, once per path, so that patches fit together
// bit for bit. Inner edges of a patch that join two points of one straight side are split first.
// Isolated vertices keep (0, 0).
//
// Guarantee: every face is positively oriented by exact test.
class PatchEmbedder {
 public:
  PatchEmbedder(mesh::RefinedSurface& surface, const TargetDomain& domain,
                const ConvexPartition& partition, const Paths& paths)
      : surface_(surface), domain_(domain), partition_(partition), paths_(paths) {}

  Points2 run(ExecutionContext& context) {
    place_paths();
    const auto count = static_cast<double>(partition_.polygons.size());
    for (const auto& polygon : partition_.polygons) {
      context.report("embedding patches",
                     static_cast<double>(&polygon - partition_.polygons.data()) / count);
      embed(outline_of(polygon), context);
    }
    if (!distortion::is_flip_free(mesh_.faces(), uv_, context)) refuse_thin();
    return std::move(uv_);
  }

 private:
  // Of the patch left of the polygon's paths.
  std::vector<VertexId> outline_of(const std::vector<ConvexPartition::Side>& polygon) const {
    std::vector<VertexId> outline;
    for (const auto& [edge, forward] : polygon) {
      std::vector<VertexId> path = paths_[at(edge)];
      if (!forward) std::ranges::reverse(path);
      outline.insert(outline.end(), path.begin(), path.end() - 1);
    }
    return outline;
  }

  void place_paths() {
    uv_ = Points2::Zero(mesh_.vertex_count(), 2);
    for (std::size_t e = 0; e < paths_.size(); ++e) {
      const std::vector<VertexId>& path = paths_[e];
      const Vector2& a = domain_.at(partition_.edges[e].a);
      const Vector2& b = domain_.at(partition_.edges[e].b);
      const std::vector<double> along = lengths_along(surface_, path);
      // No step gets less than a tenth of the mean: equal points would leave no room for any map.
      const double total = along.back();
      const auto steps = static_cast<double>(path.size() - 1);
      for (std::size_t i = 0; i < path.size(); ++i) {
        const auto step = static_cast<double>(i);
        const double t = 0.9 * (total > 0 ? along[i] / total : step / steps) + 0.1 * step / steps;
        uv_.row(path[i]) = (a + t * (b - a)).transpose();
      }
      uv_.row(path.front()) = a.transpose();
      uv_.row(path.back()) = b.transpose();
    }
  }

  // Some of the surface's faces, with numbers of their own.
  struct SurfacePatch {
    std::vector<VertexId> vertices;  // of the surface
    Triangles faces;
    std::vector<VertexId> loop;  // boundary, patch on the left

    Index vertex_count() const { return static_cast<Index>(vertices.size()); }
  };

  SurfacePatch patch_inside(const std::vector<VertexId>& outline) {
    const HalfedgeId first = mesh_.find(outline[0], outline[1]);
    if (first == kInvalid || mesh_.source(first) != outline[0])
      throw InternalError("a patch is not closed");
    std::vector<FaceId> found = {first / 3};
    std::set<FaceId> seen = {first / 3};
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (HalfedgeId h = 3 * found[i]; h < 3 * found[i] + 3; ++h) {
        if (mesh_.is_boundary(h) || mesh_.mark(h) != Mesh::kUnmarked) continue;
        if (seen.insert(mesh_.opposite(h) / 3).second) found.push_back(mesh_.opposite(h) / 3);
      }
    }
    SurfacePatch patch;
    std::map<VertexId, Index> number;
    const auto number_of = [&](VertexId v) {
      const auto [place, fresh] = number.emplace(v, patch.vertex_count());
      if (fresh) patch.vertices.push_back(v);
      return place->second;
    };
    std::vector<Mesh::Triangle> faces;
    for (const FaceId f : seen) {
      const auto [a, b, c] = mesh_.corners(f);
      faces.push_back({number_of(a), number_of(b), number_of(c)});
    }
    patch.faces = rows_of(faces);
    for (const VertexId v : outline) patch.loop.push_back(number_of(v));
    return patch;
  }

  // Places the inner vertices of a patch; in the coordinates in which it will be judged where
  // rounding folds what was made in others.
  void embed(const std::vector<VertexId>& outline, ExecutionContext& context) {
    const Points2 boundary = uv_(outline, Eigen::all);
    const Frame frame = round_frame(boundary);
    SurfacePatch patch = patch_inside(outline);
    // Inner edges that join two points of one straight side, up to rounding: points of a side are
    // collinear so far only. What is taken for straight costs a few splits, nothing else.
    const std::vector<HalfedgeId> chords = embedding::chords_to_split(
        {patch.faces, patch.vertex_count(), patch.loop, frame.round(boundary)}, true);
    for (const HalfedgeId h : chords) {
      surface_.split_edge(mesh_.find(patch.vertices[at(mesh::source(patch.faces, h))],
                                     patch.vertices[at(mesh::target(patch.faces, h))]));
    }
    if (!chords.empty()) patch = patch_inside(outline);
    if (patch.vertices.size() <= outline.size()) return;
    uv_.conservativeResize(mesh_.vertex_count(), 2);
    for (const Frame& in : {frame, Frame()}) {
      const Points2 polygon = in.round(boundary);
      const ProgressRange quiet(context, 0.0, 0.0);
      const Outcome<Points2> placed = attempt([&] {
        return embedded({patch.faces, patch.vertex_count(), patch.loop, polygon}, context);
      });
      if (!placed) continue;
      Points2 uv = in.plain(*placed);
      uv(patch.loop, Eigen::all) = boundary;
      if (!distortion::is_flip_free(patch.faces, uv, context)) continue;
      uv_(patch.vertices, Eigen::all) = uv;
      return;
    }
    refuse_thin();  // ids would be the patch's own
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_ = surface_.mesh;
  const TargetDomain& domain_;
  const ConvexPartition& partition_;
  const Paths& paths_;
  Points2 uv_;
};

// Guarantee: the result exists for every target that full_target() accepts, up to the resolution of
// 64-bit coordinates (NotConverged if a piece of the target is thinner). With a free boundary the
// map is one-to-one. It is refined generously and distorted. Precondition:
// at least one pin, or a prescribed boundary.
mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context) {
  mesh::RefinedSurface work = constraints.free_boundary() ? mesh::with_collar(surface) : surface;
  const Target target = full_target(work, constraints, context);
  const ConvexPartition partition = merge_convex(target.domain);
  const Paths paths = in_range(context, 0.0, 0.5, [&] {
    return trace_paths(work, target.domain, partition, target.given, context);
  });
  const ProgressRange range(context, 0.5, 1.0);
  const Points2 uv = PatchEmbedder(work, target.domain, partition, paths).run(context);
  return mesh::compacted_map({std::move(work), uv});  // without collar and unused vertices
}

}  // namespace

mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap fine =
      in_range(context, 0.0, 0.3, [&] { return run_matchmaker(surface, constraints, context); });
  {
    const ProgressRange range(context, 0.3, 0.65);
    const TimeLimit share(context, kShareOfStep * context.seconds_left());
    // Its distortion is enormous at first; what counts is that the refinement can be taken back.
    constexpr int kIterations = 40;
    optimise(fine, held_vertices(fine.surface, constraints), kIterations, bijective, context,
             stats);
  }
  const ProgressRange range(context, 0.65, 1.0);
  const TimeLimit share(context, (1 - kShareOfStep) * context.seconds_left());
  mesh::RefinedMap coarse = fine;
  coarsen(coarse, held_vertices(surface, constraints), surface.mesh.vertex_count(), {}, context,
          stats);
  return bijective && overlaps(coarse, context) ? fine : coarse;
}

}  // namespace flipfree::matchmaker
