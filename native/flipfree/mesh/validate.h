// Validation of user meshes: names every defect with its place and its cure.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct ValidateOptions {
  bool require_connected = false;
  bool require_disk = false;  // connected, one boundary loop, Euler characteristic 1
  bool allow_isolated_vertices = true;
  bool reject_zero_area = true;  // faces whose three points are exactly collinear or equal
};

// Those of the numbers alone: no faces, indices that do not exist or are repeated in a face,
// coordinates that are not finite; as find_defects() lists them.
std::vector<Error> value_defects(const Surface& surface);

// All defects found, in the order in which they are checked, one entry per kind with its elements
// listed. Checks that need an earlier one to hold (topology needs valid indices) are not run when
// it failed. Cost: O(#F) and the sorting of each vertex' neighbours.
// Throws Cancelled.
std::vector<Error> find_defects(const Surface& surface, const ValidateOptions& options = {},
                                const ExecutionContext& context = ExecutionContext());

// Throws InvalidInput with the first defect (and the number of further ones in its message), if
// there is any.
void validate(const Surface& surface, const ValidateOptions& options = {},
              const ExecutionContext& context = ExecutionContext());

}  // namespace flipfree::mesh
