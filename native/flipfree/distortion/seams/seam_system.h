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

class SeamSystem : public StepSystem {
 public:
  // `faces`: of the cut surface, or some of them. `fixed`: #V of the cut surface; a fixed vertex
  // fixes its copies, and any one fixes all translations, and with them all cones.
  SeamSystem(const SeamConstraints& constraints, const Triangles& faces,
             const std::vector<char>& fixed, ExecutionContext& context);

  // `rest` per face, `uv` and `direction` per vertex of the cut surface.
  double assemble(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                  ExecutionContext& context) override;
  double solve(Points2& direction, ExecutionContext& context) override;
  // Adds to a face's part, after assemble(): gradient and Hessian in its corners' UV as
  // corner_derivatives() has them.
  void add_face(FaceId f, const double gradient[6], const double hessian[kHessianEntries]);
  // From now on fixed nodes move by `motion` (per node; zero where it is not fixed) with every
  // step, and the free ones as goes best with it. Empty: they stay.
  void prescribe(Points2 motion) { motion_ = std::move(motion); }

 private:
  double add_seam_faces(const std::vector<RestTriangle>& rest, const Points2& uv, bool soft,
                        ExecutionContext& context);

  const SeamConstraints& constraints_;
  const Triangles& faces_;
  std::vector<FaceId> plain_;  // all corners are their own nodes
  std::vector<FaceId> seam_;   // the others
  Triangles plain_faces_;      // over nodes
  std::vector<RestTriangle> plain_rest_;
  std::optional<NewtonSystem> system_;  // over nodes
  Points2 nodes_;
  Points2 motion_;
};

}  // namespace flipfree::distortion
