// The sparse Newton system of a per-triangle energy: pattern, assembly, solve. Unknowns are the two
// coordinates of every free vertex; fixed vertices are eliminated, they have no row at all.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/lists.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::distortion {

class NewtonSystem {
 public:
  // `couplings` are vertex pairs beyond the mesh's edges that add_block() will be called for; their
  // vertices need no face. `fixed` has one entry per vertex.
  NewtonSystem(const Triangles& faces, const std::vector<char>& fixed,
               const std::vector<std::array<VertexId, 2>>& couplings, ExecutionContext& context);

  // Of face f: its energy, the gradient by its corners' UV and the Hessian, weighted, laid out as
  // corner_derivatives() does.
  using FaceEnergy = std::function<double(std::size_t f, double* gradient, double* hessian)>;
  // Gradient and Hessian of the sum over all faces, which is returned. The Hessian is positive
  // semi-definite if those of the faces are. Same bits for any number of threads.
  double assemble(const FaceEnergy& of_face, ExecutionContext& context);
  // The same of the symmetric Dirichlet energy at `uv`. `soft`: see
  // symmetric_dirichlet_derivatives().
  double assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                  ExecutionContext& context);

  // Adds to the gradient what moving fixed vertices by `motion` (#V x 2, zero elsewhere) does to it
  // to first order: the solution then is the best motion of the free vertices that goes with it. To
  // be called after assemble().
  void add_prescribed(const Points2& motion);
  // Adds to the assembled system: symmetric 2 x 2 diagonal block (uu, uv, vv) and gradient of
  // vertex v. Nothing happens if it is fixed.
  void add(VertexId v, const double gradient[2], const double block[3]);
  // Adds a block (uu, uv, vu, vv), first letter for v, between two different vertices. Nothing
  // happens if one is fixed. Returns false if the pair is neither an edge nor a coupling.
  [[nodiscard]] bool add_block(VertexId v, VertexId w, const double block[4]);

  // direction = -H^-1 gradient, zero on fixed vertices. The diagonal is raised by the least
  // relative amount for which the factorization succeeds. Returns the gradient's product with the
  // direction (<= 0). Throws NotConverged (kFactorizationFailed) if no amount helps.
  double solve(Points2& direction, ExecutionContext& context);

  const std::vector<double>& gradient() const { return gradient_; }  // 2 per free vertex
  int factorizations() const { return factorizations_; }

 private:
  void build_pattern(const Triangles& faces, const std::vector<std::array<VertexId, 2>>& couplings,
                     const ExecutionContext& context);

  const Triangles& faces_;
  std::vector<Index> number_of_;     // #V -> free number
  std::vector<VertexId> vertex_of_;  // free number -> #V
  Lists<CornerId> corners_;          // at each free vertex, ascending
  std::vector<Index> slot_;  // 3 #F: position of half-edge's block below the diagonal of its column
  numeric::SparseMatrix matrix_;  // lower triangle
  std::vector<double> diagonal_;  // of matrix_, before it is raised
  std::vector<double> gradient_;
  std::vector<double> face_gradient_;  // 6 per face
  std::vector<double> face_hessian_;   // kHessianEntries per face
  numeric::SparseCholesky cholesky_;
  double damping_ = 0;
  int factorizations_ = 0;
};

// Who finds the steps of a descent whose map has to meet constraints (minimizer.h).

class StepSystem {
 public:
  StepSystem() = default;
  StepSystem(const StepSystem&) = delete;
  StepSystem& operator=(const StepSystem&) = delete;
  virtual ~StepSystem() = default;

  // Gradient and projected Hessian of the energy at `uv`, as far as steps are free. `soft`: see
  // symmetric_dirichlet_derivatives(). Returns the energy. Same bits for any number of threads.
  virtual double assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                          ExecutionContext& context) = 0;
  // The Newton direction (#V x 2) among the steps that meet the constraints, zero on fixed
  // vertices; returns the gradient's product with it (<= 0). Throws NotConverged
  // (kFactorizationFailed).
  virtual double solve(Points2& direction, ExecutionContext& context) = 0;
};

}  // namespace flipfree::distortion
