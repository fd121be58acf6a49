// The Newton system of a map with seams, in its free coordinates: with uv = A x, the Hessian is
// A' H A and the gradient A' g. No multipliers: the matrix stays positive definite and as sparse as
// that of the closed surface, besides a few rows for translations.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/minimize/newton_system.h"
#include "flipfree/distortion/seams/constraints.h"

namespace flipfree::distortion {

class SeamSystem final : public StepSystem {
 public:
  // `faces`: of the cut surface, or some of them. `fixed`: #V of the cut surface; a fixed vertex
  // fixes its copies, and any one fixes all translations, and with them all cones.
  SeamSystem(const SeamConstraints& constraints, const Triangles& faces,
             const std::vector<char>& fixed, ExecutionContext& context);

  // `of_face` of each face, by its corners' UV as vertices of the cut surface; `direction` and
  // motions: per such vertex, and per node.
  void prescribe(Points2 motion) override { system_->prescribe(std::move(motion)); }

 private:
  double do_assemble(const FaceEnergy& of_face, ExecutionContext& context) override;
  double do_solve(Points2& direction, ExecutionContext& context) override;

  // Adds a face's part: gradient and Hessian in its corners' UV as corner_derivatives() has them.
  void add_face(FaceId f, const double gradient[6], const double hessian[kHessianEntries]);

  const SeamConstraints& constraints_;
  const Triangles& faces_;
  std::vector<FaceId> plain_;           // all corners are their own nodes
  std::vector<FaceId> seam_;            // the others
  Triangles plain_faces_;               // over nodes
  std::optional<NewtonSystem> system_;  // over nodes
};

}  // namespace flipfree::distortion
