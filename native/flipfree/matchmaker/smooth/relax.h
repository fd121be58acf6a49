// Lowering the distortion of a refined map on the way: a few Newton steps, of the whole or near
// what has changed.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/refined/refined_map.h"
#include "flipfree/numeric/cholesky/elimination_memory.h"

namespace flipfree::matchmaker {

struct RelaxOptions {
  int steps = 5;
  bool lengthen = false;                         // MinimizeOptions::lengthen
  numeric::EliminationMemory* memory = nullptr;  // MinimizeOptions::memory, by vertex
};

// Some Newton steps with these vertices where they are. False if the map is too squeezed for the
// Newton system; it is then as before, and valid.
bool relax(mesh::RefinedMap& map, const std::vector<VertexId>& fixed, const RelaxOptions& options,
           ExecutionContext& context);

// The same for the vertices within `rings` edges of the seeds alone, at the scale that is the best
// for the whole map. Cost: a few sweeps over the map, Newton steps of the neighbourhood.
bool relax_near(mesh::RefinedMap& map, const std::vector<VertexId>& seeds, int rings,
                const std::vector<VertexId>& fixed, const RelaxOptions& options,
                ExecutionContext& context);

// Its symmetric Dirichlet energy at the best scale; infinite if it cannot be told.
double energy_of(const mesh::RefinedMap& map, ExecutionContext& context);

}  // namespace flipfree::matchmaker
