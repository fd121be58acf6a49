#include "flipfree/matchmaker/patches/matchmaker_pp.h"

#include <Eigen/LU>
#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/failure.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/stats.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/embedding/tutte/tutte.h"
#include "flipfree/matchmaker/finish/usable_map.h"
#include "flipfree/matchmaker/patches/trace_paths.h"
#include "flipfree/matchmaker/target/outline_target.h"
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

// A patch by itself: faces, loop and boundary by place in `vertices`.
struct Disk {
  std::vector<VertexId> vertices;
  Triangles faces;
  std::vector<VertexId> loop;
  Points2 boundary;  // where the loop lies
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

class PatchEmbedder {
 public:
  PatchEmbedder(mesh::RefinedSurface& surface, const TargetDomain& domain,
                const ConvexPartition& partition, const Paths& paths)
      : surface_(surface),
        mesh_(surface.mesh),
        domain_(domain),
        partition_(partition),
        paths_(paths) {}

  Points2 run(ExecutionContext& context) {
    std::vector<SurfacePatch> patches;
    for (const auto& polygon : partition_.polygons) {
      context.check();
      patches.push_back(outline(polygon));
      split_chords(patches.back());
    }
    place_paths();
    local_.assign(static_cast<std::size_t>(mesh_.vertex_count()), kInvalid);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      context.report("embedding patches",
                     static_cast<double>(i) / static_cast<double>(patches.size()));
      flood(patches[i]);
      embed(patches[i], context);
    }
    return uv_;
  }

 private:
  const Vector2& point(Index domain_vertex) const { return domain_.point[at(domain_vertex)]; }

  // Loop of the patch left of the polygon's paths; sides are numbered by runs without a strict
  // corner.
  SurfacePatch outline(const std::vector<ConvexPartition::Side>& polygon) const {
    SurfacePatch patch;
    const std::size_t n = polygon.size();
    const auto start = [&](std::size_t i) {
      const auto& edge = partition_.edges[at(polygon[i % n].edge)];
      return polygon[i % n].forward ? edge.a : edge.b;
    };
    std::size_t first = 0;
    // Samples of a straight side are collinear up to rounding only; embed_disk judges them by a
    // tolerance as well. A corner that is taken for straight costs a few splits, nothing else.
    constexpr double kStraight = 1e-5;
    const auto bend = [&](std::size_t i) {
      const Vector2 a = point(start(i)) - point(start(i + n - 1));
      const Vector2 b = point(start(i + 1)) - point(start(i));
      return cross(a, b) / (a.norm() * b.norm());
    };
    std::size_t strict = 0;
    for (std::size_t i = 0; i < n; ++i) strict += bend(i) > kStraight ? 1 : 0;
    const auto is_corner = [&](std::size_t i) {
      if (strict >= 3) return bend(i) > kStraight;
      return numeric::orientation(point(start(i + n - 1)), point(start(i)), point(start(i + 1))) !=
             0;
    };
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
    std::vector<std::pair<VertexId, std::size_t>> place;
    for (std::size_t i = 0; i < n; ++i) place.emplace_back(patch.loop[i], i);
    std::sort(place.begin(), place.end());
    const auto find = [&](VertexId v) {
      const auto it = std::lower_bound(place.begin(), place.end(), std::pair(v, std::size_t{0}));
      return it != place.end() && it->first == v ? it->second : n;
    };
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
        const std::size_t j = find(mesh_.target(h));
        if (j != n && share_side(i, j)) chords.push_back(mesh_.target(h));
      }
      for (const VertexId w : chords) surface_.split_edge(mesh_.find(patch.loop[i], w));
    }
  }

  void place_paths() {
    uv_ = Points2::Zero(mesh_.vertex_count(), 2);
    for (std::size_t e = 0; e < paths_.size(); ++e) {
      const std::vector<VertexId>& path = paths_[e];
      const Vector2& a = point(partition_.edges[e].a);
      const Vector2& b = point(partition_.edges[e].b);
      std::vector<double> along = {0.0};
      for (std::size_t i = 0; i + 1 < path.size(); ++i) {
        const auto from = static_cast<std::size_t>(path[i]);
        const auto to = static_cast<std::size_t>(path[i + 1]);
        along.push_back(along.back() + (surface_.position[to] - surface_.position[from]).norm());
      }
      // No step gets less than a tenth of the mean: equal points would leave no room for any map.
      const double total = along.back();
      const auto steps = static_cast<double>(path.size() - 1);
      for (std::size_t i = 0; i < path.size(); ++i) {
        const double t = 0.9 * (total > 0 ? along[i] / total : static_cast<double>(i) / steps) +
                         0.1 * static_cast<double>(i) / steps;
        uv_.row(path[i]) = (a + t * (b - a)).transpose();
      }
      uv_.row(path.front()) = a.transpose();
      uv_.row(path.back()) = b.transpose();
    }
  }

  void flood(SurfacePatch& patch) {
    visited_.resize(static_cast<std::size_t>(mesh_.face_slots()), false);
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
    Disk disk{std::move(vertices), std::move(faces), {}, {}};
    disk.boundary.resize(static_cast<Eigen::Index>(patch.loop.size()), 2);
    for (std::size_t i = 0; i < patch.loop.size(); ++i) {
      disk.loop.push_back(local_[at(patch.loop[i])]);
      disk.boundary.row(static_cast<Eigen::Index>(i)) = uv_.row(patch.loop[i]);
    }
    if (disk.vertices.size() > disk.loop.size()) fill(disk, context);
    for (const VertexId v : disk.vertices) local_[at(v)] = kInvalid;
  }

  // Places the inner vertices of a patch; in the coordinates in which it will be judged where
  // rounding folds what was made in others.
  void fill(const Disk& disk, ExecutionContext& context) {
    const Frame plain{Vector2::Zero(), Eigen::Matrix2d::Identity(), Eigen::Matrix2d::Identity()};
    for (const Frame& frame : {round_frame(disk.boundary), plain}) {
      const Points2 boundary =
          (disk.boundary.rowwise() - frame.origin.transpose()) * frame.to_round.transpose();
      const ProgressRange quiet(context, 0.0, 0.0);
      const Outcome<Points2> round = attempt([&] {
        return distortion::with_own_map([&] {
          embedding::EmbedOptions options;
          options.float32 = false;
          Stats unused;
          return embedding::embed_disk(disk.faces, static_cast<Index>(disk.vertices.size()),
                                       disk.loop, boundary, options, context, unused);
        });
      });
      if (!round) continue;
      Points2 uv = (*round * frame.from_round.transpose()).rowwise() + frame.origin.transpose();
      for (std::size_t i = 0; i < disk.loop.size(); ++i)
        uv.row(disk.loop[i]) = disk.boundary.row(static_cast<Eigen::Index>(i));
      if (!distortion::is_flip_free(disk.faces, uv, context)) continue;
      for (std::size_t v = 0; v < disk.vertices.size(); ++v)
        uv_.row(disk.vertices[v]) = uv.row(static_cast<Eigen::Index>(v));
      return;
    }
    refuse_thin();  // ids would be the patch's own
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_;
  const TargetDomain& domain_;
  const ConvexPartition& partition_;
  const Paths& paths_;
  Points2 uv_;
  std::vector<Index> local_;
  std::vector<bool> visited_;
};

// Positions of all mesh vertices (#V x 2 of the refined mesh). Points along a path are spread over
// its straight side by the lengths of the path's edges, once per path, so that patches fit together
// bit for bit. Inner edges of a patch that join two points of one straight side are split first.
// Isolated vertices keep (0, 0).
//
// Guarantee: every face is positively oriented by exact test. Throws what embed_disk throws.
Points2 embed_patches(mesh::RefinedSurface& surface, const TargetDomain& domain,
                      const ConvexPartition& partition, const Paths& paths,
                      ExecutionContext& context) {
  Points2 uv = PatchEmbedder(surface, domain, partition, paths).run(context);
  if (!distortion::is_flip_free(surface.mesh.faces(), uv, context)) refuse_thin();
  return uv;
}

// given[e] for every edge of the partition, from the target's list.
Paths given_paths(const Target& target, const ConvexPartition& partition) {
  Paths given(partition.edges.size());
  std::map<std::pair<VertexId, VertexId>, Index> edge_between;
  for (std::size_t e = 0; e < partition.edges.size(); ++e) {
    const VertexId a = target.domain.mesh_vertex[at(partition.edges[e].a)];
    const VertexId b = target.domain.mesh_vertex[at(partition.edges[e].b)];
    edge_between[{a, b}] = static_cast<Index>(e);
  }
  for (std::vector<VertexId> path : target.given) {
    auto it = edge_between.find({path.front(), path.back()});
    if (it == edge_between.end()) {
      std::reverse(path.begin(), path.end());
      it = edge_between.find({path.front(), path.back()});
    }
    if (it == edge_between.end()) throw InternalError("a prescribed path is no edge of the target");
    const auto e = static_cast<std::size_t>(it->second);
    if (!partition.edges[e].boundary) given[e] = std::move(path);
  }
  return given;
}

// Guarantee: the result exists for every target that full_target() accepts, up to the resolution of
// 64-bit coordinates (NotConverged if a piece of the target is thinner). With a free boundary the
// map is one-to-one. It is refined generously and distorted. Precondition:
// at least one pin, or a prescribed boundary.
mesh::RefinedMap run_matchmaker(const mesh::RefinedSurface& surface, const Constraints& constraints,
                                ExecutionContext& context) {
  mesh::RefinedSurface work = constraints.free_boundary() ? mesh::with_collar(surface) : surface;
  const Target target = full_target(work, constraints, context);
  const ConvexPartition partition = merge_convex(target.domain);
  Paths paths;
  {
    const ProgressRange range(context, 0.0, 0.5);
    paths = trace_paths(work, target.domain, partition, given_paths(target, partition), context);
  }
  const ProgressRange range(context, 0.5, 1.0);
  const Points2 uv = embed_patches(work, target.domain, partition, paths, context);
  return mesh::compacted_map({std::move(work), uv});  // without collar and unused vertices
}

}  // namespace

mesh::RefinedMap guaranteed(const mesh::RefinedSurface& surface, const Constraints& constraints,
                            bool bijective, ExecutionContext& context, Stats& stats) {
  mesh::RefinedMap fine;
  {
    const ProgressRange range(context, 0.0, 0.3);
    fine = run_matchmaker(surface, constraints, context);
  }
  const ProgressRange range(context, 0.3, 1.0);
  return made_usable(std::move(fine), surface, constraints, bijective, context, stats);
}

}  // namespace flipfree::matchmaker
