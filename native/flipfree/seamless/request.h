// What is asked of a seamless map, checked before any work: errors name the place in the caller's
// mesh, whatever part of it is at fault.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Which cones and loop angles a seamless map can have (thesis 5.1, 6.2; issue of strata without
// surfaces).
//
// A flat metric with cone angles k pi / 2 and holonomies in quarter turns is a quartic differential
// with zeros of order k - 4. Where there is a metric at all is known (Bainbridge, Chen, Gendron,
// Grushevsky, Moeller 2019, "Strata of k-differentials"; Chen, Gendron 2022, "Towards a
// classification of connected components of strata of k-differentials"; Boissy 2015):
//
//   genus 0: always. genus >= 3: always.
//   genus 1: no cones: only if no loop turns at all. Two cones 4 + m and 4 - m: not if m divides
//            the turns of all loops; so never for m = 1, the cones (3, 5).
//   genus 2: one cone of 12, or two of 6 and 10 quarter turns: not if all loops turn by half turns,
//            unless (12 only) all turn by whole ones.

// Quarter turns around a vertex where the surface is flat.
inline constexpr Index kFlat = 4;

// Quarter turns of the vertices that are not flat, sorted.
std::vector<Index> cone_list(const std::vector<Index>& cones);

// Genus of a closed connected surface whose cone quarter turns fit, by Gauss-Bonnet.
// `cones`: quarter turns k of every vertex, 4 where the surface is flat. Throws InvalidInput
// (kBadAngles) for k < 1, Infeasible (kGaussBonnet) with what is missing if the sum of 4 - k is not
// 8 - 8 genus, Infeasible (kBadAngles) for cones that no metric has, whatever its loops: 3 and 5 on
// a torus.
void check_cones(const std::vector<Index>& cones, Index genus);

// Why there is no metric with these cones and loop turns (quarter turns of a homology basis); empty
// if there is one. Precondition: check_cones() passed.
std::string why_impossible(const std::vector<Index>& cones, Index genus,
                           const std::vector<Index>& loop_turns);

// Angles at the boundary of a seamless map, in quarter turns.
//
// A seamless map of a surface with boundary is a flat metric on its double whose cones and loops
// turn by quarters. Aligned: the boundary is straight but for corners of whole quarters, so that it
// runs along the axes; sum over inner vertices (4 - k) + sum over boundary vertices (2 - k) = 4 chi
// (Gauss-Bonnet). Free: its angles are any, and each curve of it turns by whole quarters in all.

enum class Boundary {
  kAligned,        // straight along the axes, corners in quarter turns
  kAlignedOrFree,  // free in connected parts for which no aligned map is found
  kFree,           // as near to the surface's own metric as the inside allows
  kTurning,        // the same, but every curve of it turns in all as the given corners do
  kGiven,          // aligned in connected parts whose boundary angles are all given, free in others
};

// An angle that is not given: inside, the vertex is flat.
inline constexpr Index kNotGiven = 0;

// Where the boundary of a seamless map has its corners, if nobody says so.
//
// An aligned curve runs along the axes: each of its edges has one of four directions, and where
// that changes there is a corner. The edges get the directions that lie nearest to their own,
// corners where these are sharp, and as many more as the turning asks for; found by dynamic
// programming along the curve. A corner costs so much that short teeth are ridden over.

// `cones` with 4, flat, where nothing is given inside. No vertex without a face.
std::vector<Index> flat_inside(std::vector<Index> cones, const mesh::Surface& surface);

// `cones`: quarter turns per vertex of a connected surface; kNotGiven at boundary vertices, or what
// the caller wants there. Returns them with all boundary vertices given: if the caller gave any,
// the others are straight (2); else corners are put where the boundary is sharp, and what
// Gauss-Bonnet then asks for is spread along its curves; the same for every size of the surface.
// Closed surfaces: as they are. Throws InvalidInput (kBadAngles) for k < 1, Infeasible
// (kGaussBonnet) with what is missing, Cancelled.
std::vector<Index> aligned_cones(const mesh::Surface& surface, const std::vector<Index>& cones,
                                 ExecutionContext& context);

// What a certificate is to check: the angles (radians) of inner vertices that are not flat, and of
// all boundary vertices that have one if `aligned`.
std::vector<std::pair<VertexId, double>> prescribed_angles(const std::vector<Index>& cones,
                                                           const mesh::Surface& surface,
                                                           bool aligned);

// Throws InvalidInput (kBadAngles) naming the boundary vertex whose angle is given. Any number of
// components.
void check_free(const mesh::Surface& surface, const std::vector<Index>& cones);

// Total angles (radians) at all vertices for a free boundary: k quarter turns inside, at the
// boundary those of the discretely conformal metric with scale 1 there, corrected evenly along each
// curve so that it turns by whole quarters: the nearest that Gauss-Bonnet allows (`boundary`:
// kFree), or the sum of 2 - k of its vertices (kTurning), where k may be any number. Throws
// InvalidInput (kBadAngles) for k < 1 inside and, for kFree, as check_free(); Infeasible
// (kGaussBonnet) if the turning that is asked for is not what the inside needs; Cancelled. Cost: a
// conformal metric.
std::vector<double> free_angles(const mesh::Surface& surface, const std::vector<Index>& cones,
                                Boundary boundary, ExecutionContext& context);

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
                                         const std::vector<Index>& cones);
// Adds the faces of a chart that was refined into `part`, and the vertices that this has more, to a
// surface whose vertices begin with those of the one that the chart is of. Returns the numbers that
// the part's vertices have there.
std::vector<VertexId> append_part(const mesh::Chart& chart, const mesh::Surface& part,
                                  mesh::Surface& whole);

// Flags of the components that have a boundary, and whether one has.
std::vector<char> open_parts(const mesh::Surface& surface, const mesh::Components& parts);
bool has_boundary(const mesh::Surface& surface);

// Errors of a part, or of a refined map, with the places of the caller's mesh.

// To be called in a catch block: throws the exception at hand again, NotConverged (a failed
// certificate too), InvalidInput and Infeasible with its places; others as they are.
[[noreturn]] void rethrow_placed(const std::vector<FaceId>& faces,
                                 const std::vector<VertexId>& vertices);

// What work() returns, or its errors with these places.
template <typename Work>
auto placed(const std::vector<FaceId>& faces, const std::vector<VertexId>& vertices,
            const Work& work) {
  try {
    return work();
  } catch (...) {
    rethrow_placed(faces, vertices);
  }
}

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
