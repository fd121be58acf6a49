// A triangle mesh as plain arrays: what stages hand each other.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::mesh {

// Flat half-edge adjacency of a triangle array: the fast, read-only view of connectivity.
//
//      .            half-edge h = 3 f + k runs from corner k of face f, which is
//     / \           v = faces(f, k), to corner k + 1, with the face on its left;
//  h /   \          half-edge and corner share the number. next_corner(h) and
//   /  f  \         previous_corner(h) are the other half-edges of the face.
//  v-------.
//
// opposite[h] is the half-edge of the neighbouring face along the same edge, kInvalid on
// the boundary.
struct Adjacency {
  std::vector<HalfedgeId> opposite;  // 3 #F
  std::vector<HalfedgeId>
      vertex_halfedge;  // #V: an outgoing half-edge; for a boundary vertex the one from which
                        //     counter-clockwise rotation visits the whole fan; kInvalid if isolated
};

// Triangles that change no more, shared by all copies together with their adjacency: who wants
// others makes new ones, so that the adjacency kept is always theirs.
class Faces {
 public:
  Faces(Triangles triangles = {}) : shared_(std::make_shared<Shared>(std::move(triangles))) {}
  // Copied where it is moved, too: none is ever without triangles.
  Faces(const Faces&) = default;
  Faces& operator=(const Faces&) = default;

  const Triangles& triangles() const { return shared_->triangles; }
  operator const Triangles&() const { return shared_->triangles; }
  VertexId operator()(Eigen::Index f, Eigen::Index k) const { return shared_->triangles(f, k); }
  auto row(Eigen::Index f) const { return std::as_const(shared_->triangles).row(f); }
  Eigen::Index rows() const { return shared_->triangles.rows(); }
  Eigen::Index size() const { return shared_->triangles.size(); }
  const VertexId* data() const { return shared_->triangles.data(); }

  // Made when it is first asked for, by whatever thread; it lives as long as the faces.
  // Precondition: `vertex_count` is that of every call before; the faces passed validate()
  // (manifold, oriented). Cost of the first call: O(#F).
  const Adjacency& adjacency(Index vertex_count) const;

 private:
  struct Shared {
    explicit Shared(Triangles given) : triangles(std::move(given)) {}
    Triangles triangles;
    std::mutex mutex;
    std::unique_ptr<const Adjacency> adjacency;
    std::atomic<const Adjacency*> made = nullptr;  // what is asked for in loops takes no lock
  };
  std::shared_ptr<Shared> shared_;
};

struct Surface {
  Points3 vertices;  // #V x 3
  Faces faces;       // #F x 3, consistently oriented

  const Adjacency& adjacency() const {
    return faces.adjacency(static_cast<Index>(vertices.rows()));
  }
  // A face's corners in space; and what is upright on the face, twice its area long.
  std::array<Vector3, 3> corners(FaceId f) const;
  Vector3 area_vector(FaceId f) const;
};

// Where the parts of a refined surface lie on the user's one (G7): the record that stages hand on.
//
// While a surface is being refined, a vertex is known by weights of input vertices instead
// (Support, refined_surface.h): a point on an edge or at a vertex lies in several faces, and only
// the ends of an edge together say which.

struct SurfacePoint {
  FaceId face = kInvalid;            // of the input
  Vector3 weight = Vector3::Zero();  // of the face's corners: multiples of 2^-52 that sum to one
                                     // where they were chosen, rounded where they were computed
};

struct Provenance {
  std::vector<FaceId> face;          // #F: the input face that contains each face
  std::vector<SurfacePoint> vertex;  // #V
};

}  // namespace flipfree::mesh
