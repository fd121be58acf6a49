// What is asked of a seamless map, checked before any work: errors name the place in the caller's
// mesh, whatever part of it is at fault.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Throws InvalidInput: defects of the mesh, vertices without a face among them.
void check_surface(const mesh::Surface& surface, ExecutionContext& context);

// `cones`: quarter turns per vertex, 4 or kNotGiven where it is flat. Throws
// InvalidInput (check_surface(); k < 1) and, for closed parts, Infeasible (Gauss-Bonnet; cones that
// no metric has, whatever its loops), naming the cones of the connected part at fault, or its faces
// if it has none. Parts with a boundary are aligned_cones()' and free_angles()' to judge. Cost:
// O(#F).
void check_request(const mesh::Surface& surface, const std::vector<Index>& cones,
                   ExecutionContext& context);

// A connected part of a surface, whose numbers its `faces` and `vertices` are.
struct SurfacePart : mesh::Chart {
  std::vector<Index> cones;  // per vertex of it
  bool bordered = false;
  bool corners_given = false;  // are there angles at its boundary?
};
// In the order of their smallest face. `cones`: per vertex; kNotGiven where nothing is given.
std::vector<SurfacePart> connected_parts(const mesh::Surface& surface,
                                         const mesh::Adjacency& adjacency,
                                         const std::vector<Index>& cones);

// Errors of a part, or of a refined map, with the places of the caller's mesh.

// To be called in a catch block: throws the exception at hand again, NotConverged (a failed
// certificate too), InvalidInput and Infeasible with its places; others as they are.
[[noreturn]] void rethrow_placed(const std::vector<FaceId>& faces,
                                 const std::vector<VertexId>& vertices);

// A map of a surface that was refined into these faces as one of the input: its provenance is put
// together. The certificate is left as it is.
void name_input_places(const mesh::Surface& input, const mesh::Provenance& provenance,
                       const Triangles& refined, certify::Parametrization& map);

// Which quarter turns loops are given that nobody gave any: those of some metric that are nearest
// to the loop angles of another one.
//
// What is near is told by a norm, the length of the change of the metric that the angles need
// (penner/penner_newton.h). Counted loop by loop it would depend on the basis of the homology: two
// loops that turn a third of a quarter too far, and whose difference is a short one, are nearer to
// numbers that neither of them rounds to. The nearest whole numbers in a norm are a closest vector
// of a lattice, nearly found by rounding one number after the other (Babai 1986, "On Lovasz'
// lattice reduction and the nearest lattice point problem").

// `angles`: of n loops, radians; `norm`: n x n, symmetric and positive definite, only its lower
// half is read: e' norm e is what it costs that loops turn by e more. If it is no norm, by rounding
// or otherwise, loops count one by one. Returns: the nearest turns, or, where `why` says why there
// is no metric with them (empty if there is one), the nearest with one loop turned otherwise;
// nullopt if it forbids all. Cost: O(n^3).
std::optional<std::vector<Index>> near_turns(
    const std::vector<double>& angles, const Eigen::MatrixXd& norm,
    const std::function<std::string(const std::vector<Index>&)>& why);

// The same on a closed surface with `cones` (quarter turns of every vertex). Throws Infeasible
// (kBadAngles) if there are none: cones 3 and 5 on a torus.
std::vector<Index> near_turns(const std::vector<Index>& cones, Index genus,
                              const std::vector<double>& angles, const Eigen::MatrixXd& norm);

}  // namespace flipfree::seamless
