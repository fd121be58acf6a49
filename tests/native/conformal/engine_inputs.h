// What metric engines start from.
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "flipfree/conformal/engine/engine.h"
#include "support/shapes.h"

namespace flipfree::test {

// Angles of all vertices 2 pi but for one cone, which takes what is left: of a closed surface,
// which must outlive the result.
inline conformal::EngineInput flat_but_one(const mesh::Surface& surface, VertexId cone) {
  conformal::EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  const double pi = std::numbers::pi;
  input.target.assign(static_cast<std::size_t>(input.vertex_count), 2.0 * pi);
  double sum = 0.0;
  for (const double t : input.target) sum += t;
  input.target[static_cast<std::size_t>(cone)] +=
      pi * static_cast<double>(surface.faces.rows()) - sum;
  return input;
}

// Targets that differ from the angles of the surface itself by waves, their sum being the same:
// near by, and in the conformal class.
inline conformal::EngineInput waves(const mesh::Surface& surface, double height,
                                    ExecutionContext& context) {
  conformal::EngineInput input = flat_but_one(surface, 0);
  const auto engine = conformal::make_engine(input, 53, context);
  conformal::Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  double mean = 0.0;
  const std::size_t n = input.target.size();
  for (std::size_t v = 0; v < n; ++v)
    mean += std::sin(0.9 * static_cast<double>(v)) / static_cast<double>(n);
  for (std::size_t v = 0; v < n; ++v)
    input.target[v] +=
        -gradient.value[v] + height * (std::sin(0.9 * static_cast<double>(v)) - mean);
  return input;
}

}  // namespace flipfree::test
