// The sparse Newton system of a per-triangle energy: pattern, assembly, solve. Unknowns are the two
// coordinates of every free vertex; fixed vertices are eliminated, they have no row at all.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::distortion {

// Of face f: its energy, the gradient by its corners' UV and the Hessian, weighted, laid out as
// corner_derivatives() does.
using FaceEnergy = std::function<double(std::size_t f, double* gradient, double* hessian)>;
// The symmetric Dirichlet energy at `uv`; all must outlive it. `soft`: see
// symmetric_dirichlet_derivatives().
FaceEnergy symmetric_dirichlet_energy(const Triangles& faces, const std::vector<RestTriangle>& rest,
                                      const Points2& uv, bool soft);

// Who finds the steps of a descent, whose map may have to meet constraints (minimizer.h).
class StepSystem {
 public:
  StepSystem() = default;
  StepSystem(const StepSystem&) = delete;
  StepSystem& operator=(const StepSystem&) = delete;
  virtual ~StepSystem() = default;

  // Gradient and Hessian of the sum over all faces, which is returned, as far as steps are free.
  // The Hessian is positive semi-definite if those of the faces are. Same bits for any number of
  // threads.
  double assemble(const FaceEnergy& of_face, ExecutionContext& context);
  // The Newton direction (#V x 2) among the steps that meet the constraints, zero on fixed
  // vertices; returns the gradient's product with it (<= 0). The diagonal is raised by the least
  // relative amount for which the factorization succeeds. Throws NotConverged
  // (kFactorizationFailed) if no amount helps.
  double solve(Points2& direction, ExecutionContext& context);
  // From the next assemble() on what is fixed moves by `motion` with every step (a row for each
  // unknown, zero where it is free), and the rest as goes best with it to first order. Empty: it
  // stays.
  virtual void prescribe(Points2 motion) = 0;

 private:
  virtual double do_assemble(const FaceEnergy& of_face, ExecutionContext& context) = 0;
  virtual double do_solve(Points2& direction, ExecutionContext& context) = 0;
};

class NewtonSystem final : public StepSystem {
 public:
  // `couplings` are vertex pairs beyond the mesh's edges that add_block() will be called for; their
  // vertices need no face. `fixed` has one entry per vertex.
  NewtonSystem(const Triangles& faces, const std::vector<char>& fixed,
               const std::vector<std::array<VertexId, 2>>& couplings, ExecutionContext& context);

  void prescribe(Points2 motion) override { motion_ = std::move(motion); }

  // Adds to the assembled system: symmetric 2 x 2 diagonal block (uu, uv, vv) and gradient of
  // vertex v. Nothing happens if it is fixed.
  void add(VertexId v, const double gradient[2], const double block[3]);
  // Adds a block (uu, uv, vu, vv), first letter for v, between two different vertices. If one is
  // fixed, its motion pulls at the other. Returns false if the pair is neither an edge nor a
  // coupling.
  [[nodiscard]] bool add_block(VertexId v, VertexId w, const double block[4]);

  bool all_fixed() const { return vertex_of_.empty(); }

 private:
  double do_assemble(const FaceEnergy& of_face, ExecutionContext& context) override;
  double do_solve(Points2& direction, ExecutionContext& context) override;
  void build_pattern(const std::vector<std::array<VertexId, 2>>& couplings,
                     const ExecutionContext& context);

  // Of a pair's block in its column of matrix_, counted from the column's begin; kInvalid if one is
  // fixed, or the pattern has no such pair.
  Index place_of(VertexId v, VertexId w) const;
  // As add_block(), of a pair in the pattern.
  void add_at(Index place, VertexId v, VertexId w, const double block[4]);

  const Triangles& faces_;
  std::vector<Index> place_;           // 3 #F: of the block of each half-edge
  std::vector<Index> number_of_;       // #V -> free number
  std::vector<VertexId> vertex_of_;    // free number -> #V
  numeric::SparseMatrix matrix_;       // lower triangle
  std::vector<double> diagonal_;       // of matrix_, before it is raised
  Eigen::VectorXd gradient_;           // 2 per free vertex
  std::vector<double> face_gradient_;  // 6 per face
  std::vector<double> face_hessian_;   // kHessianEntries per face
  Points2 motion_;
  numeric::SparseCholesky cholesky_;
  double damping_ = 0;
};

}  // namespace flipfree::distortion
