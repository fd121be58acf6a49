// The metric while it evolves: intrinsic triangulation and lengths in one precision, behind an
// interface in doubles.
//
// The Newton iteration (newton.h) works in double whatever the precision; only what suffers from
// cancellation is computed in the engine's scalar type: lengths, the Delaunay test where a filter
// in double leaves it open, and the differences of lengths from which angles follow. Scaling uses
// factors that are doubles and exact by definition: vertex v's factor exp(u_v / 2) is the product
// of all factors it was given, so u is known to full precision although every step is a vector of
// doubles.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/intrinsic/symmetric_flips.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::conformal {
// What the search for a discretely conformally equivalent metric found (metric.h).

// How a search for a metric ended.
enum class NewtonEnd {
  kConverged,
  kPrecision,  // rounding decides from here on: go on with more bits
  kIterations,
  kSeconds,
};
// For people: tolerance, precision, iterations, seconds.
inline const char* name_of(NewtonEnd end) {
  switch (end) {
    case NewtonEnd::kConverged:
      return "tolerance";
    case NewtonEnd::kPrecision:
      return "precision";
    case NewtonEnd::kIterations:
      return "iterations";
    case NewtonEnd::kSeconds:
      return "seconds";
  }
  return "";
}

// Per input vertex: with those of a refined start, if there was one (FlippedMetric::added).
struct ConformalMetric : intrinsic::FlippedMetric {
  // `length` of edge (i, j) = Penner length of the replayed flips * exp((u_i + u_j) / 2); u has
  // mean 0.
  std::vector<double> scale_factors;  // u, rounded
  std::vector<double> angles;         // per input vertex: total angle reached
  double angle_error = 0.0;           // max |angles - target|, before rounding
  double scale_range = 0.0;           // max u - min u
  int bits = 53;
  int iterations = 0;
  std::vector<double> error_history;  // max angle error at the start and after every Newton step
  std::array<std::size_t, intrinsic::kFlipTypes> flip_counts{};  // Ptolemy flips in `flips` by type
  bool converged = false;
  NewtonEnd end = NewtonEnd::kIterations;
  Stats stats;
};

struct Gradient {
  std::vector<double> value;  // per unknown: target angle - angle
  double max_error = 0.0;     // largest |value|; infinite if some angle is not a number
  // Half-cotangents of the angles opposite each half-edge, times the weight of its face (symmetric
  // faces count half, copy 2 not at all): what the Hessian is assembled from. Zero on diagonals.
  std::vector<double> half_cotangent;
  double noise = 0.0;  // estimate of the rounding error in `value`
};

// Numbers per unknown: where triangles are needles, scale factors of neighbours must agree to far
// more places than a double has. `high` rounds them; `low`, if not empty, is what that lost, as
// doubles; `full`, if not empty, are the numbers themselves.
struct FineVector {
  std::vector<double> high;
  std::vector<double> low{};
  std::vector<numeric::BigFloat<16>> full{};
};

// The convex energy whose gradient is target - angle, up to a constant of the input; and an
// estimate of its rounding error.
struct Energy {
  double value = 0.0;
  double noise = 0.0;
};

// The same in any precision, to hand over from one engine to the next.
using ScaleLogarithms = std::vector<numeric::BigFloat<64>>;

class MetricEngine {
 public:
  virtual ~MetricEngine() = default;

  virtual int bits() const = 0;
  // False if rounding kept it from the Delaunay triangulation of the input, as needles may with few
  // bits. Nothing else may be asked for then.
  virtual bool started() const = 0;
  virtual const intrinsic::IntrinsicMesh& mesh() const = 0;
  // Per edge, rounded.
  virtual std::vector<double> lengths() const = 0;
  // Whether every face's sides are those of a triangle, with room for what finish() rounds. Angles
  // can be right to the tolerance where a needle's sides have lost it.
  virtual bool has_triangles() const = 0;

  // Multiplies the length of every edge (i, j) by exp(x_i + x_j). If x is high parts only, what is
  // taken for exp(x) - 1 is the nearest double, exactly; else exp is computed in full.
  virtual void scale(const FineVector& x, ExecutionContext& context) = 0;
  // Multiplies the length of every edge e by exp(x[e]), which leaves the conformal class; the scale
  // factors stay what they are. On a double cover those in copy 1 and across the line count.
  virtual void stretch(const std::vector<double>& x, ExecutionContext& context) = 0;
  // Logarithms of all factors so far (u / 2), and a fresh engine's way to there: in stages, since a
  // long way at once would go through triangulations far from both ends and cost many times the
  // flips. False if lengths leave the exponent range.
  virtual ScaleLogarithms scaled_so_far(const ExecutionContext& context) const = 0;
  virtual bool go_to(const ScaleLogarithms& x, ExecutionContext& context) = 0;
  // Ptolemy flips until every edge is Delaunay (Weeks' algorithm, 4.2.4). False if it gave up:
  // lengths left the exponent range, or the number of flips exceeded a multiple of the number of
  // edges.
  virtual bool restore_delaunay(ExecutionContext& context) = 0;
  // Angles, gradient and cotangents. `accuracy`: absolute error of an angle that is good enough;
  // below 1e-14 angles are computed in the precision of the engine, else in double from
  // well-conditioned quotients.
  virtual void evaluate(double accuracy, Gradient& out, ExecutionContext& context) = 0;

  // tan(angle / 2) of the angle opposite each half-edge, in every face; small relative errors.
  virtual void half_tangents(std::vector<double>& tangent, ExecutionContext& context) const = 0;

  // The convex energy of the present metric (Springborn, Schroeder, Pinkall 2008; across flips
  // Springborn 2019). Costs about as much as the angles.
  virtual Energy energy(ExecutionContext& context) const = 0;

  // Nonlinear relaxation: for each unknown listed, in order, moves its scale factor alone until its
  // own angle error is at most `accuracy` (a monotone equation in one variable; the triangulation
  // around it is kept Delaunay). Every move lowers the convex energy.
  // False if the engine could not follow. Bounded moves and flips; leaves the rest undone when
  // `stop` says so.
  virtual bool relax(const std::vector<VertexId>& unknowns, double accuracy,
                     const std::function<bool()>& stop, ExecutionContext& context) = 0;

  // Another engine with the same state.
  virtual std::unique_ptr<MetricEngine> copy() const = 0;
  // Remembers the present metric, and returns to the one remembered last. Copies all arrays.
  virtual void remember() = 0;
  virtual void go_back() = 0;
  // Changes of the scale factors u since remember().
  virtual std::vector<double> moved() const = 0;
  // Flips done so far, of which the first euclidean_flips() are Euclidean.
  virtual const std::vector<intrinsic::FlipRecord>& flips() const = 0;
  virtual std::size_t euclidean_flips() const = 0;
  // Delaunay tests that the filter in double left to the scalar type.
  virtual std::size_t exact_tests() const = 0;

  // Fills mesh, lengths, u, flips and bits of the result; u only to double unless in_full.
  virtual void finish(ConformalMetric& result, bool in_full,
                      const ExecutionContext& context) const = 0;
};

// What an engine starts from: plain data, shared by the rungs of the precision ladder.
struct EngineInput {
  intrinsic::IntrinsicSetup setup;
  Index vertex_count = 0;
  const Points3* positions = nullptr;  // lengths come from positions,
  std::vector<double> edge_length;     // or are given per edge of the mesh
  std::vector<double> target;          // per input vertex
  // Flags of those whose angles are as they come, whose targets are 0; null: none.
  const std::vector<char>* pinned = nullptr;
};

// From the positions of a valid surface, without targets.
EngineInput input_of(const mesh::Surface& surface);

// Starts at u = 0 with the Euclidean intrinsic Delaunay triangulation of the input. bits 53 is
// double, up to 4096 MPFR.
std::unique_ptr<MetricEngine> make_engine(const EngineInput& input, int bits,
                                          ExecutionContext& context);

}  // namespace flipfree::conformal
