#include "flipfree/certify/measures/provenance.h"

#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/base/failure/elements.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/mesh/adjacency.h"

namespace flipfree::certify {
namespace {

struct Checker {
  const mesh::Surface& refined;
  const Provenance& provenance;
  ProvenanceReport report;
  void fail(const std::string& what, FaceId face) {
    if (report.failures++ == 0) report.first = what;
    if (face != kInvalid && report.faces.size() < kMostElements) report.faces.push_back(face);
  }

  bool shapes_fit() const {
    const auto faces = static_cast<std::size_t>(refined.faces.rows());
    const auto vertices = static_cast<std::size_t>(refined.vertices.rows());
    return provenance.parent_face->size() == faces &&
           provenance.vertex_parent->size() == vertices &&
           provenance.vertex_barycentric->rows() == refined.vertices.rows() &&
           refined.vertices.rows() >= provenance.parent->vertices.rows();
  }

  void check_vertices() {
    const mesh::Surface& parent = *provenance.parent;
    const Eigen::Index kept = parent.vertices.rows();
    for (Eigen::Index v = 0; v < refined.vertices.rows(); ++v) {
      if (v < kept) {
        if (refined.vertices.row(v) != parent.vertices.row(v)) {
          fail("vertex " + std::to_string(v) + " of the input was moved", kInvalid);
        }
        continue;
      }
      const FaceId f = (*provenance.vertex_parent)[static_cast<std::size_t>(v)];
      const Vector3 weights = provenance.vertex_barycentric->row(v);
      if (f < 0 || f >= parent.faces.rows() || !(weights.minCoeff() >= 0.0) ||
          !(std::abs(weights.sum() - 1.0) <= kProvenanceTolerance)) {
        fail("added vertex " + std::to_string(v) + " has no valid place in an input face",
             kInvalid);
        continue;
      }
      Vector3 expected = Vector3::Zero();
      double size = 0.0;
      for (Index k = 0; k < 3; ++k) {
        expected += weights[k] * parent.vertices.row(parent.faces(f, k)).transpose();
        size = std::max(size, parent.vertices.row(parent.faces(f, k)).cwiseAbs().maxCoeff());
      }
      // (The largest of some coefficients, one of them NaN, may be any.)
      const Vector3 off = refined.vertices.row(v).transpose() - expected;
      if (!off.allFinite() || !(off.cwiseAbs().maxCoeff() <= kProvenanceTolerance * size)) {
        fail("added vertex " + std::to_string(v) + " does not lie where its weights say", kInvalid);
      }
    }
  }

  // Weights of vertex v in face f of the parent; false if v does not lie in that face.
  bool weights_in(VertexId v, FaceId f, Vector3& weights) const {
    const mesh::Surface& parent = *provenance.parent;
    weights.setZero();
    const auto add = [&](VertexId corner, double weight) {
      for (Index k = 0; k < 3; ++k) {
        if (parent.faces(f, k) == corner) {
          weights[k] += weight;
          return true;
        }
      }
      return weight == 0.0;
    };
    if (v < parent.vertices.rows()) return add(v, 1.0);
    const FaceId own = (*provenance.vertex_parent)[static_cast<std::size_t>(v)];
    if (own < 0 || own >= parent.faces.rows()) return false;
    if (own == f) {
      weights = provenance.vertex_barycentric->row(v).transpose();
      return true;
    }
    bool inside = true;
    for (Index k = 0; k < 3; ++k) {
      inside = add(parent.faces(own, k), (*provenance.vertex_barycentric)(v, k)) && inside;
    }
    return inside;
  }

  void check_faces() {
    const mesh::Surface& parent = *provenance.parent;
    std::vector<double> covered(static_cast<std::size_t>(parent.faces.rows()), 0.0);
    std::vector<FaceId> first(covered.size(), kInvalid);
    for (FaceId f = 0; f < refined.faces.rows(); ++f) {
      const FaceId p = (*provenance.parent_face)[static_cast<std::size_t>(f)];
      if (p < 0 || p >= parent.faces.rows()) {
        fail("face " + std::to_string(f) + " has no parent face", f);
        continue;
      }
      FaceId& first_part = first[static_cast<std::size_t>(p)];
      if (first_part == kInvalid) first_part = f;
      Vector3 a;
      Vector3 b;
      Vector3 c;
      if (!weights_in(refined.faces(f, 0), p, a) || !weights_in(refined.faces(f, 1), p, b) ||
          !weights_in(refined.faces(f, 2), p, c)) {
        fail("face " + std::to_string(f) + " leaves its parent face " + std::to_string(p), f);
        continue;
      }
      const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      if (!(area >= -kProvenanceTolerance)) {
        fail("face " + std::to_string(f) + " is turned over within its parent face " +
                 std::to_string(p),
             f);
      }
      covered[static_cast<std::size_t>(p)] += area;
    }
    for (std::size_t p = 0; p < covered.size(); ++p) {
      if (!(std::abs(covered[p] - 1.0) <= kProvenanceTolerance)) {
        fail("input face " + std::to_string(p) + " is not covered exactly once by its parts",
             first[p]);
      }
    }
  }

  // Every edge glued as the parent's surface is there. For faces that passed check_faces().
  void check_gluing() {
    const auto adjacency_of = [](const mesh::Surface& surface) {
      return mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
    };
    const mesh::Adjacency adjacency = adjacency_of(refined);
    const mesh::Adjacency across = adjacency_of(*provenance.parent);
    const auto neighbour = [](const mesh::Adjacency& of, HalfedgeId h) {
      const HalfedgeId o = of.opposite[static_cast<std::size_t>(h)];
      return o == kInvalid ? kInvalid : o / 3;
    };
    for (FaceId f = 0; f < refined.faces.rows(); ++f) {
      const FaceId p = (*provenance.parent_face)[static_cast<std::size_t>(f)];
      Vector3 corner[3];
      for (Index k = 0; k < 3; ++k) weights_in(refined.faces(f, k), p, corner[k]);
      for (Index k = 0; k < 3; ++k) {
        const FaceId other = neighbour(adjacency, 3 * f + k);
        const FaceId parent = other == kInvalid
                                  ? kInvalid
                                  : (*provenance.parent_face)[static_cast<std::size_t>(other)];
        bool glued = parent == p;
        for (Index m = 0; m < 3 && !glued; ++m) {
          const bool along_side = corner[k][m] <= kProvenanceTolerance &&
                                  corner[(k + 1) % 3][m] <= kProvenanceTolerance;
          glued = along_side && parent == neighbour(across, 3 * p + (m + 1) % 3);
        }
        if (!glued) {
          fail("face " + std::to_string(f) + " is torn off at the edge of vertices " +
                   std::to_string(refined.faces(f, k)) + " and " +
                   std::to_string(refined.faces(f, (k + 1) % 3)),
               f);
        }
      }
    }
  }
};

}  // namespace

ProvenanceReport check_provenance(const mesh::Surface& refined, const Provenance& provenance) {
  Checker checker{refined, provenance, {}};
  if (!checker.shapes_fit()) {
    checker.fail("the provenance arrays do not have the sizes of the refined mesh", kInvalid);
    return checker.report;
  }
  checker.check_vertices();
  checker.check_faces();
  if (checker.report.failures == 0) checker.check_gluing();
  return checker.report;
}

}  // namespace flipfree::certify
