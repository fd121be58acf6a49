#include "faults/poison.h"

#include <atomic>
#include <iterator>
#include <limits>

#include "flipfree/base/stats.h"
#include "flipfree/conformal/newton_system.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/distortion/minimize/newton_system.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/unwrap/packing/rectangles.h"

namespace flipfree::test {
namespace {

enum Step : std::size_t {
  kCholeskySolve,
  kCholeskyFactorize,
  kDistortionAssemble,
  kDistortionDirection,
  kDistortionPromise,
  kEnergySum,
  kStepToFirstFlip,
  kBarrierValue,
  kRestShapes,
  kSpectralStart,
  kRounding,
  kRectangle,
  kPackingScale,
  kPackingPlace,
  kConformalGradient,
  kConformalCotangents,
  kConformalDirection,
  kSteps
};
constexpr const char* kNames[kSteps] = {
    "Cholesky solve",       "Cholesky factorize", "distortion assemble",
    "distortion direction", "distortion promise", "energy sum",
    "step to first flip",   "barrier value",      "rest shapes",
    "spectral start",       "rounding",           "smallest rectangle",
    "packing scale",        "packing place",      "conformal gradient",
    "conformal cotangents", "conformal direction"};

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::size_t active = kSteps;
std::int64_t first = 0;
std::int64_t last = 0;
std::atomic<std::int64_t> calls{0};
std::atomic<std::int64_t> spoilt{0};

bool poisons(Step step) {
  if (step != active) return false;
  const std::int64_t n = ++calls;
  if (first == 0 || n < first || n > last) return false;
  ++spoilt;
  return true;
}

// One number of the matrix, at about two thirds of it.
template <typename Matrix>
void spoil_matrix(Matrix& values) {
  if (values.size() > 0)
    values.data()[values.size() * 2 / 3] =
        std::numeric_limits<typename Matrix::Scalar>::quiet_NaN();
}
void spoil_vector(std::vector<double>& values) {
  if (!values.empty()) values[values.size() * 2 / 3] = kNaN;
}

}  // namespace

std::vector<std::string> poisoned_steps() { return {std::begin(kNames), std::end(kNames)}; }

Poison::Poison(std::size_t step, std::int64_t at, bool and_all_later) {
  calls = 0;
  spoilt = 0;
  first = at;
  last = and_all_later ? std::numeric_limits<std::int64_t>::max() : at;
  active = step;
}
Poison::~Poison() { active = kSteps; }
std::int64_t Poison::count() const { return calls; }
std::int64_t Poison::spoiled() const { return spoilt; }

// Each step twice: `real_x` is the library's own, `x` what the library calls instead. Member
// functions take `this` as their first argument.
using Rest = std::vector<distortion::RestTriangle>;
using Dense = Eigen::MatrixXd;

#define STEP(symbol, result, name, ...)                  \
  result real_##name(__VA_ARGS__) asm("__real_" symbol); \
  result name(__VA_ARGS__) asm("__wrap_" symbol);        \
  result name(__VA_ARGS__)

// Symbols stay on one line: CMakeLists.txt reads them.
// clang-format off
STEP("_ZNK8flipfree7numeric14SparseCholesky5solveERKN5Eigen3RefIKNS2_6MatrixIdLin1ELin1ELi0ELin1ELin1EEELi0ENS2_11OuterStrideILin1EEEEERNS_16ExecutionContextE",
     Dense, cholesky_solve, const numeric::SparseCholesky* self, const Eigen::Ref<const Dense>& rhs,
     ExecutionContext& context) {
  Dense x = real_cholesky_solve(self, rhs, context);
  if (poisons(kCholeskySolve)) spoil_matrix(x);
  return x;
}

STEP("_ZN8flipfree7numeric14SparseCholesky9factorizeERKN5Eigen12SparseMatrixIdLi0EiEERNS_16ExecutionContextE",
     bool, cholesky_factorize, numeric::SparseCholesky* self, const numeric::SparseMatrix& matrix,
     ExecutionContext& context) {
  if (!poisons(kCholeskyFactorize)) return real_cholesky_factorize(self, matrix, context);
  numeric::SparseMatrix spoiled = matrix;
  if (spoiled.nonZeros() > 0) spoiled.valuePtr()[spoiled.nonZeros() * 2 / 3] = kNaN;
  return real_cholesky_factorize(self, spoiled, context);
}

STEP("_ZN8flipfree10distortion10StepSystem8assembleERKSt8functionIFdmPdS3_EERNS_16ExecutionContextE",
     double, assemble, distortion::StepSystem* self, const distortion::FaceEnergy& of_face,
     ExecutionContext& context) {
  const double energy = real_assemble(self, of_face, context);
  return poisons(kDistortionAssemble) ? kNaN : energy;
}

STEP("_ZN8flipfree10distortion10StepSystem5solveERN5Eigen6MatrixIdLin1ELi2ELi1ELin1ELi2EEERNS_16ExecutionContextE",
     double, distortion_solve, distortion::StepSystem* self, Points2& direction,
     ExecutionContext& context) {
  const double promise = real_distortion_solve(self, direction, context);
  if (poisons(kDistortionDirection)) spoil_matrix(direction);
  return poisons(kDistortionPromise) ? kNaN : promise;
}

STEP("_ZN8flipfree10distortion10sum_energyERKN5Eigen6MatrixIiLin1ELi3ELi1ELin1ELi3EEERKSt6vectorINS0_12RestTriangleESaIS7_EERKNS2_IdLin1ELi2ELi1ELin1ELi2EEERKNS_16ExecutionContextE",
     distortion::EnergySums, sum, const Triangles& faces, const Rest& rest, const Points2& uv,
     const ExecutionContext& context) {
  distortion::EnergySums sums = real_sum(faces, rest, uv, context);
  if (poisons(kEnergySum)) sums.stretch = kNaN;
  return sums;
}

STEP("_ZN8flipfree10distortion18step_to_first_flipERKN5Eigen6MatrixIiLin1ELi3ELi1ELin1ELi3EEERKNS2_IdLin1ELi2ELi1ELin1ELi2EEES8_RKNS_16ExecutionContextE",
     double, step, const Triangles& faces, const Points2& uv, const Points2& direction,
     const ExecutionContext& context) {
  const double length = real_step(faces, uv, direction, context);
  return poisons(kStepToFirstFlip) ? kNaN : length;
}

STEP("_ZNK8flipfree10distortion15BoundaryBarrier5valueERKN5Eigen6MatrixIdLin1ELi2ELi1ELin1ELi2EEERKNS1_5ReachE",
     double, barrier, const distortion::BoundaryBarrier* self, const Points2& uv,
     const distortion::BoundaryBarrier::Reach& reach) {
  const double value = real_barrier(self, uv, reach);
  return poisons(kBarrierValue) ? kNaN : value;
}

STEP("_ZN8flipfree10distortion17build_rest_shapesERKNS_4mesh7SurfaceERKNS_16ExecutionContextE",
     distortion::RestShapes, rest_shapes, const mesh::Surface& surface,
     const ExecutionContext& context) {
  distortion::RestShapes rest = real_rest_shapes(surface, context);
  if (poisons(kRestShapes)) rest.triangles[rest.triangles.size() / 2].gradient[0][1] = kNaN;
  return rest;
}

STEP("_ZN8flipfree10distortion22spectral_conformal_mapERKNS_4mesh7SurfaceERKN5Eigen6MatrixIdLin1ELi2ELi1ELin1ELi2EEERNS_16ExecutionContextE",
     Points2, spectral, const mesh::Surface& chart, const Points2& seed, ExecutionContext& context) {
  Points2 uv = real_spectral(chart, seed, context);
  if (poisons(kSpectralStart)) spoil_matrix(uv);
  return uv;
}

STEP("_ZN8flipfree10distortion16round_to_storageERKN5Eigen6MatrixIiLin1ELi3ELi1ELin1ELi3EEERKNS2_IdLin1ELi2ELi1ELin1ELi2EEERKNS0_15RoundingOptionsERNS_16ExecutionContextERSt3mapINSt7__cxx1112basic_stringIcSt11char_traitsIcESaIcEEENS_7VariantIdJlSK_EEESt4lessISK_ESaISt4pairIKSK_SM_EEE",
     Points2f, rounding, const Triangles& faces, const Points2& uv, const distortion::RoundingOptions& options,
     ExecutionContext& context, Stats& stats) {
  Points2f stored = real_rounding(faces, uv, options, context, stats);
  if (poisons(kRounding)) spoil_matrix(stored);
  return stored;
}

STEP("_ZN8flipfree6unwrap26turn_to_smallest_rectangleERKN5Eigen6MatrixIdLin1ELi2ELi1ELin1ELi2EEE",
     Vector2, rectangle, const Points2& uv) {
  Vector2 turn = real_rectangle(uv);
  if (poisons(kRectangle)) turn.x() = kNaN;
  return turn;
}

STEP("_ZN8flipfree6unwrap15pack_rectanglesERKSt6vectorIN5Eigen6MatrixIdLi2ELi1ELi0ELi2ELi1EEESaIS4_EERKNS0_11RoomOptionsE",
     unwrap::Placement, packing, const std::vector<Vector2>& sizes, const unwrap::RoomOptions& options) {
  unwrap::Placement placement = real_packing(sizes, options);
  if (poisons(kPackingScale)) placement.scale = kNaN;
  if (poisons(kPackingPlace) && !placement.corner.empty()) placement.corner.back().y() = kNaN;
  return placement;
}

STEP("_ZN8flipfree9conformal12NewtonSystem5solveERKNS_9intrinsic13IntrinsicMeshERKNS0_8GradientEiRNS0_10FineVectorERNS_16ExecutionContextE",
     bool, conformal_solve, conformal::NewtonSystem* self, const intrinsic::IntrinsicMesh& mesh,
     const conformal::Gradient& gradient, int bits, conformal::FineVector& direction,
     ExecutionContext& context) {
  conformal::Gradient spoiled = gradient;
  if (poisons(kConformalGradient)) spoil_vector(spoiled.value);
  if (poisons(kConformalCotangents)) spoil_vector(spoiled.half_cotangent);
  const bool solved = real_conformal_solve(self, mesh, spoiled, bits, direction, context);
  if (poisons(kConformalDirection)) spoil_vector(direction.high);
  return solved;
}

// clang-format on
#undef STEP

}  // namespace flipfree::test
