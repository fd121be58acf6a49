#include "flipfree/intrinsic/loops/surface_loops.h"

#include <limits>
#include <string>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::intrinsic {
// Distance between the centres of two triangles across each edge: two thirds of the height of the
// edge over them, as far as doubles tell.
std::vector<double> steps_across(const mesh::Surface& surface, const IntrinsicSetup& setup) {
  std::vector<double> step(setup.mesh.edge_count(), 1e-12);
  for (Index f = 0; f < static_cast<Index>(surface.faces.rows()); ++f) {
    Vector3 centre = Vector3::Zero();
    for (int k = 0; k < 3; ++k) centre += surface.vertices.row(surface.faces(f, k)) / 3.0;
    for (int k = 0; k < 3; ++k) {
      const Vector3 a = surface.vertices.row(surface.faces(f, k));
      const Vector3 b = surface.vertices.row(surface.faces(f, (k + 1) % 3));
      step[at(setup.input_halfedge[at(3 * f + k)] >> 1)] += (centre - 0.5 * (a + b)).norm();
    }
  }
  return step;
}

std::vector<double> steps_inside(const mesh::Surface& surface, const IntrinsicSetup& setup) {
  std::vector<double> step = steps_across(surface, setup);
  for (std::size_t e = 0; e < step.size(); ++e) {
    if (setup.mesh.label_of_edge(static_cast<EdgeId>(e)) == EdgeLabel::kParallel)
      step[e] = std::numeric_limits<double>::infinity();
  }
  return step;
}

DualLoop closed_by_reflection(const IntrinsicMesh& mesh, const DualLoop& strip) {
  DualLoop loop = strip;
  for (std::size_t i = strip.size() - 2; i > 0; --i)
    loop.push_back(mesh.reflection[at(FlipMesh::opposite(strip[i]))]);
  return loop;
}

std::vector<DualLoop> on_setup(const std::vector<DualLoop>& loops, const Triangles& faces,
                               const IntrinsicSetup& setup) {
  const auto corner_count = static_cast<HalfedgeId>(3 * faces.rows());
  std::vector<HalfedgeId> corner_of(setup.mesh.halfedge_count(), kInvalid);
  for (HalfedgeId c = 0; c < corner_count; ++c) corner_of[at(setup.input_halfedge[at(c)])] = c;
  std::vector<DualLoop> out;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const DualLoop& loop = loops[i];
    DualLoop own;
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const HalfedgeId after = loop[(k + 1) % loop.size()];
      const bool inside =
          loop[k] >= 0 && loop[k] < corner_count && after >= 0 && after < corner_count;
      const HalfedgeId entered =
          inside ? corner_of[at(setup.input_halfedge[at(loop[k])] ^ 1)] : kInvalid;
      if (!inside || entered / 3 != after / 3 || entered == after) {
        throw_invalid(ErrorCode::kBadOption,
                      "Loop " + std::to_string(i) + " is not a closed strip of faces at place " +
                          std::to_string(k) +
                          ". Give half-edges across each of which the loop enters the face of the "
                          "next one, without turning back.");
      }
      own.push_back(setup.input_halfedge[at(loop[k])]);
    }
    if (own.empty())
      throw_invalid(ErrorCode::kBadOption,
                    "Loop " + std::to_string(i) + " is empty. Leave it out.");
    out.push_back(std::move(own));
  }
  return out;
}

}  // namespace flipfree::intrinsic
