// Discretely conformally equivalent metric with prescribed angles (thesis 4.2-4.4, Algorithm 3).
//
// Guarantee: the metric (mesh, length) that comes back is intrinsically Delaunay and has at every
// vertex the prescribed total angle up to `angle_error` (measured on the returned lengths in the
// precision of the run, at most the tolerance); it is discretely conformally equivalent to the
// input in the sense of Definition 4.2: `flips` leads from the input triangulation through Delaunay
// ones to the final one.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/conformal/engine/engine.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {

// What the search for a metric starts from, checked: the words for everything that is wrong with a
// mesh, lengths, options or target angles.

// A number for people, with so many significant digits.
std::string number_text(double value, int digits = 6);

inline constexpr int kLargestBits = 4096;
inline constexpr mesh::ValidateOptions kConnected{.require_connected = true,
                                                  .allow_isolated_vertices = false};

struct MetricOptions {
  double tolerance = 1e-10;  // of every vertex' total angle, radians
  int bits =
      0;  // mantissa: 0 = auto (double, then only as many as needed); 53 = double; up to 4096
  int max_iterations = 500;  // Newton steps, all precisions together
  double max_seconds = 0.0;  // give up after so many seconds of wall time; 0 = never
  bool require_convergence =
      true;  // throw NotConverged; else return what was reached, converged = false
};

// `target_angles`: per vertex the total angle, interior 2 pi - curvature, boundary pi - geodesic
// curvature. Errors: InvalidInput (mesh not valid, connected and free of isolated vertices; angles
// not positive or not finite), Infeasible/kGaussBonnet (names the remainder), NotConverged (says
// what was reached), Cancelled.
// `lengths`: null, or those to start from instead of the positions', which are not read then:
// lengths(f, k) belongs to the edge from corner k to k + 1 of face f; both sides of an edge must
// agree and every face must satisfy the strict triangle inequality.
ConformalMetric compute_conformal_metric(const mesh::Surface& surface,
                                         const std::vector<double>& target_angles,
                                         const MetricOptions& options, ExecutionContext& context,
                                         const Points3* lengths = nullptr);

// The conformal metric with one scale factor at all `pinned` vertices (flags, one at least), whose
// angles follow from the surface, and prescribed angles at all others: free boundaries, and cones
// (thesis 4.2.1: the energy restricted to a subspace of u is convex as well; Springborn, Schröder,
// Pinkall 2008, section 6: u = 0 on the boundary distorts least). By the engine and the line search
// of the metric of prescribed angles; its result are target angles, the prescribed ones bit for
// bit, which the full solver then meets to any accuracy.
// `target`: #V, read where pinned[v] = 0. `angle_error` is that of the vertices not pinned.
// Precondition: a valid connected surface. Targets that no metric meets are no error: the result
// says so. Errors: NotConverged, where triangles are so degenerate that no angle was measured.
ConformalMetric compute_pinned_metric(const mesh::Surface& surface,
                                      const std::vector<double>& target,
                                      const std::vector<char>& pinned, double tolerance,
                                      ExecutionContext& context);

// The conformal metric from a refined start: points are added so that the intrinsic Delaunay
// triangulation has no needles (delaunay_refinement.h), then the metric of the refined surface is
// computed, flat at the points added (thesis 4.6.4).
//
// More vertices mean another discrete conformal class: the refined metric approximates the same
// smooth one, but is not the same as that of the input's own vertices. It is therefore only used
// where it is asked for.

struct RefinedMetric {
  ConformalMetric metric;  // of `split` if there is one: the input's vertices first, then its own
  std::unique_ptr<intrinsic::SplitSurface> split;
};

// `lengths`: #F x 3, or null: those of the vertex positions. `refine`: first from a refined start,
// and only where there is nothing to refine, or that fails, the plain way. Errors as
// compute_conformal_metric. Of max_seconds the first of two ways gets a share. stats:
// "intrinsic_refinement" (vertices added), and where refined "smallest_start_angle",
// "seconds_refinement", "refinement_complete"; "refined_start_error" where that failed.
RefinedMetric compute_refined_metric(const mesh::Surface& surface, const Points3* lengths,
                                     const std::vector<double>& target_angles,
                                     const MetricOptions& options, bool refine,
                                     ExecutionContext& context);

}  // namespace flipfree::conformal
