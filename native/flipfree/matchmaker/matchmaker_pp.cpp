#include <Eigen/LU>
#include <algorithm>
#include <map>

#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/coarsen.h"
#include "flipfree/matchmaker/outline_target.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/ways.h"
#include "flipfree/numeric/dense_factors.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

// Phase 3 of MatchMaker++ (thesis 3.3): every patch onto its convex polygon, welded.

using Mesh = mesh::EditableTriangulation;

struct SurfacePatch {
  std::vector<VertexId> loop;  // boundary, patch on the left
  std::vector<Index> side;     // per loop edge (from loop[i]): number of its straight side
  std::vector<FaceId> faces;
};

// An affine frame in which a polygon is about as wide as high, near the origin: thin polygons are
// judged and solved there as well as any other. Affine maps keep convex combinations, hence
// embeddings.
struct Frame {
  Vector2 origin;
  Eigen::Matrix2d to_round, from_round;
};

Frame round_frame(const Points2& polygon) {
  Frame frame;
  frame.origin = polygon.colwise().mean().transpose();
  const Eigen::Matrix<double, Eigen::Dynamic, 2> centred =
      polygon.rowwise() - frame.origin.transpose();
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
    std::vector<SurfacePatch> patches;
    for (const auto& polygon : partition_.polygons) {
      context.check();
      patches.push_back(outline(polygon));
      split_chords(patches.back());
    }
    place_paths();
    local_.assign(at(mesh_.vertex_count()), kInvalid);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      context.report("embedding patches",
                     static_cast<double>(i) / static_cast<double>(patches.size()));
      flood(patches[i]);
      embed(patches[i], context);
    }
    if (!distortion::is_flip_free(mesh_.faces(), uv_, context)) refuse_thin();
    return std::move(uv_);
  }

 private:
  // Loop of the patch left of the polygon's paths; sides are numbered by runs without a strict
  // corner.
  SurfacePatch outline(const std::vector<ConvexPartition::Side>& polygon) const {
    SurfacePatch patch;
    const std::size_t n = polygon.size();
    const auto corner = [&](std::size_t i) -> const Vector2& {
      const auto& [e, forward] = polygon[i % n];
      const auto& edge = partition_.edges[at(e)];
      return domain_.at(forward ? edge.a : edge.b);
    };
    // Samples of a straight side are collinear up to rounding only; embed_disk judges them by a
    // tolerance as well. A corner that is taken for straight costs a few splits, nothing else.
    constexpr double kStraight = 1e-5;
    const auto bend = [&](std::size_t i) {
      const Vector2 a = corner(i) - corner(i + n - 1);
      const Vector2 b = corner(i + 1) - corner(i);
      return cross(a, b) / (a.norm() * b.norm());
    };
    std::size_t strict = 0;
    for (std::size_t i = 0; i < n; ++i) strict += bend(i) > kStraight ? 1 : 0;
    const auto is_corner = [&](std::size_t i) {
      if (strict >= 3) return bend(i) > kStraight;
      return numeric::orientation(corner(i + n - 1), corner(i), corner(i + 1)) != 0;
    };
    std::size_t first = 0;
    while (first < n && !is_corner(first)) ++first;
    Index side = -1;
    for (std::size_t i = first; i < first + n; ++i) {
      if (is_corner(i)) ++side;
      std::vector<VertexId> path = paths_[at(polygon[i % n].edge)];
      if (!polygon[i % n].forward) std::reverse(path.begin(), path.end());
      for (std::size_t k = 0; k + 1 < path.size(); ++k) {
        patch.loop.push_back(path[k]);
        patch.side.push_back(side);
      }
    }
    return patch;
  }

  HalfedgeId loop_halfedge(const SurfacePatch& patch, std::size_t i) const {
    const HalfedgeId h = mesh_.find(patch.loop[i], patch.loop[(i + 1) % patch.loop.size()]);
    if (h == kInvalid || mesh_.source(h) != patch.loop[i])
      throw InternalError("a patch is not closed");
    return h;
  }

  // Splits inner edges whose two ends lie on one side (its corners included).
  void split_chords(const SurfacePatch& patch) {
    const std::size_t n = patch.loop.size();
    const Index sides = patch.side.back() + 1;
    std::map<VertexId, std::size_t> place;
    for (std::size_t i = 0; i < n; ++i) place.emplace(patch.loop[i], i);
    const auto on_side = [&](std::size_t i, Index side) {
      return patch.side[i] == side || patch.side[(i + n - 1) % n] == side;
    };
    const auto share_side = [&](std::size_t i, std::size_t j) {
      const Index a = patch.side[i];
      const Index b = patch.side[(i + n - 1) % n];
      return on_side(j, a) || (sides > 1 && on_side(j, b));
    };
    for (std::size_t i = 0; i < n; ++i) {
      // Around loop[i] inside the patch: from the loop's edge counter-clockwise to the one that
      // arrives.
      std::vector<VertexId> chords;
      for (HalfedgeId h = loop_halfedge(patch, i);;) {
        h = mesh_.rotate_ccw(h);
        if (h == kInvalid || mesh_.mark(h) != Mesh::kUnmarked) break;
        const auto found = place.find(mesh_.target(h));
        if (found != place.end() && share_side(i, found->second)) chords.push_back(found->first);
      }
      for (const VertexId w : chords) surface_.split_edge(mesh_.find(patch.loop[i], w));
    }
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

  void flood(SurfacePatch& patch) {
    visited_.resize(at(mesh_.face_slots()), false);
    patch.faces = {loop_halfedge(patch, 0) / 3};
    visited_[at(patch.faces.front())] = true;
    for (std::size_t i = 0; i < patch.faces.size(); ++i) {
      for (HalfedgeId h = 3 * patch.faces[i]; h < 3 * patch.faces[i] + 3; ++h) {
        if (mesh_.is_boundary(h) || mesh_.mark(h) != Mesh::kUnmarked) continue;
        const FaceId g = mesh_.opposite(h) / 3;
        if (visited_[at(g)]) continue;
        visited_[at(g)] = true;
        patch.faces.push_back(g);
      }
    }
    std::sort(patch.faces.begin(), patch.faces.end());
  }

  void embed(const SurfacePatch& patch, ExecutionContext& context) {
    std::vector<VertexId> vertices;
    Triangles faces(static_cast<Eigen::Index>(patch.faces.size()), 3);
    for (std::size_t f = 0; f < patch.faces.size(); ++f) {
      for (Index k = 0; k < 3; ++k) {
        const VertexId v = mesh_.source(3 * patch.faces[f] + k);
        Index& number = local_[at(v)];
        if (number == kInvalid) {
          number = static_cast<Index>(vertices.size());
          vertices.push_back(v);
        }
        faces(static_cast<Eigen::Index>(f), k) = number;
      }
    }
    std::vector<VertexId> loop;
    for (const VertexId v : patch.loop) loop.push_back(local_[at(v)]);
    for (const VertexId v : vertices) local_[at(v)] = kInvalid;
    if (vertices.size() <= loop.size()) return;
    const Points2 boundary = uv_(patch.loop, Eigen::all);
    uv_(vertices, Eigen::all) =
        filled({faces, static_cast<Index>(vertices.size()), loop, boundary}, context);
  }

  // Places the inner vertices of a patch; in the coordinates in which it will be judged where
  // rounding folds what was made in others.
  static Points2 filled(const embedding::Disk& disk, ExecutionContext& context) {
    const Frame plain{Vector2::Zero(), Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Identity()};
    for (const Frame& frame : {round_frame(disk.boundary), plain}) {
      const Points2 boundary =
          (disk.boundary.rowwise() - frame.origin.transpose()) * frame.to_round.transpose();
      const ProgressRange quiet(context, 0.0, 0.0);
      const Outcome<Points2> round = attempt([&] {
        return embedded({disk.faces, disk.vertex_count, disk.loop, boundary}, context);
      });
      if (!round) continue;
      Points2 uv = (*round * frame.from_round.transpose()).rowwise() + frame.origin.transpose();
      uv(disk.loop, Eigen::all) = disk.boundary;
      if (distortion::is_flip_free(disk.faces, uv, context)) return uv;
    }
    refuse_thin();  // ids would be the patch's own
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_ = surface_.mesh;
  const TargetDomain& domain_;
  const ConvexPartition& partition_;
  const Paths& paths_;
  Points2 uv_;
  std::vector<Index> local_;
  std::vector<bool> visited_;
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
